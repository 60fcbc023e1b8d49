#include "evaluation/figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

using hand_made::detection;
using hand_made::frame;
using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::shifted;

/// 20 frames of a 640 x 480 pinhole camera. In each: a headline label that is found with an offset
/// of 0.5 px in the first 15 frames and missed in the others; a crowded pair, one of them found; a
/// detection on nothing in frames 0, 2, 4, ...
Summary exampleSummary(const std::vector<double>& noises = {2}) {
  const Camera camera = pinholeCamera();
  const LabelLine line = label(camera, {100, 200}, {300, 200}, 0);
  LabelLine near = label(camera, {100, 400}, {300, 400}, 1);
  const LabelLine nearer = label(camera, {100, 403}, {300, 403}, 2);
  near.kind = LineKind::kMaterial;
  Summary summary{EvaluationOptions{}};
  for (size_t i = 0; i < 20; ++i) {
    std::vector<DetectionLine> lines{shifted(near, {0, 0})};
    lines.back().score = 50;
    if (i < 15) {
      lines.push_back(shifted(line, {0, 0.5}));
      lines.back().score = 100 - double(i);
    }
    if (i % 2 == 0) {
      lines.push_back(detection({{400, 50}, {500, 50}}));
      lines.back().score = 10;
    }
    FrameEvaluation one = frame("cam", camera, {line, near, nearer}, lines);
    one.labels.sensor["read_noise_levels"] = noises[i % noises.size()];
    summary.add(one, camera);
  }
  return summary;
}

double value(const Figures& figures,
             const std::string& table,
             const std::string& stratum,
             std::optional<double> rho = std::nullopt) {
  const Figure* figure = figures.find(table, stratum, rho);
  EXPECT_NE(figure, nullptr) << table << ", " << stratum;
  return figure && figure->value ? *figure->value : std::nan("");
}

Ratio ratio(const Figures& figures,
            const std::string& table,
            const std::string& stratum,
            double rho) {
  const Figure* figure = figures.find(table, stratum, rho);
  EXPECT_TRUE(figure && figure->ratio) << table << ", " << stratum;
  return figure && figure->ratio ? *figure->ratio : Ratio{};
}

TEST(Figures, CountsAndF) {
  const Figures figures = makeFigures(exampleSummary());
  EXPECT_EQ(ratio(figures, "found", "headline", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found", "crowded", 1), (Ratio{20, 40}));
  EXPECT_EQ(ratio(figures, "right", ">= 5 deg", 1), (Ratio{35, 45}));
  // 2 P R / (P + R) with P = 7/9, R = 3/4.
  EXPECT_NEAR(value(figures, "F", "headline", 1), 2 * (7.0 / 9) * 0.75 / (7.0 / 9 + 0.75), 1e-12);
  EXPECT_EQ(value(figures, "fragments per found run", "headline", 1), 1);
  // The interval is that of 20 images of which 15 have it.
  const Figure* found = figures.find("found", "headline", 1);
  ASSERT_TRUE(found->interval);
  const double sigma = std::sqrt(0.75 * 0.25 / 20);
  EXPECT_NEAR(found->interval->low, 0.75 - 1.96 * sigma, 0.06);
  EXPECT_NEAR(found->interval->high, 0.75 + 1.96 * sigma, 0.06);
}

TEST(Figures, OrderAndDirectionDoNotMatterToTheLastBit) {
  const Camera camera = pinholeCamera();
  std::vector<LabelLine> labels;
  std::vector<DetectionLine> detections;
  for (int i = 0; i < 12; ++i) {
    const double y = 20 + 38 * i;
    labels.push_back(label(camera, {100.0 + i, y}, {300.0 + 7 * i, y + 11}, i));
    detections.push_back(shifted(labels.back(), {1.3 * std::sin(i), 1.7 * std::cos(3 * i)}));
  }
  const auto figuresOf = [&] {
    Summary summary{EvaluationOptions{}};
    const nlohmann::ordered_json sensor{
        {"psf_sigma_px", 0.5}, {"read_noise_levels", 2}, {"encoding", "linear"}, {"bits", 8}};
    summary.add(frame("cam", camera, labels, detections, sensor), camera);
    return toJson(makeFigures(summary)).dump(1);
  };
  const std::string as_made = figuresOf();
  EXPECT_THAT(as_made, testing::HasSubstr("offset, rms"));
  std::reverse(detections.begin(), detections.end());
  for (DetectionLine& line : detections) {
    line = hand_made::reversed(line);
  }
  EXPECT_EQ(figuresOf(), as_made);
  for (size_t shift = 1; shift < labels.size(); shift += 2) {
    std::rotate(labels.begin(), labels.begin() + long(shift), labels.end());
    std::reverse(labels[shift].points.begin(), labels[shift].points.end());
    EXPECT_EQ(figuresOf(), as_made) << shift;
  }
}

TEST(Figures, StrataHoldTheOtherConditionsOfTheHeadline) {
  const Figures figures = makeFigures(exampleSummary({0, 8}));
  EXPECT_EQ(ratio(figures, "found by crowded", "no", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found by crowded", "yes", 1), (Ratio{20, 40}));
  EXPECT_EQ(ratio(figures, "found by kind", "crease", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found by kind", "material", 1), (Ratio{0, 0}));  // those are crowded
  EXPECT_EQ(ratio(figures, "found by contrast", "40-80", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found by length px", "160-320", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found by length px", "< 20", 1), (Ratio{0, 0}));
  EXPECT_EQ(ratio(figures, "found by length deg", "20-40", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found by field angle deg", "15-30", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "found by noise", "0", 1), (Ratio{8, 10}));
  EXPECT_EQ(ratio(figures, "found by noise", "8", 1), (Ratio{7, 10}));
  EXPECT_EQ(ratio(figures, "found by camera model", "pinhole", 1), (Ratio{15, 20}));
  EXPECT_EQ(ratio(figures, "right by length px", "80-160", 1), (Ratio{0, 10}));
  EXPECT_EQ(ratio(figures, "right by length px", "160-320", 1), (Ratio{35, 35}));
  EXPECT_EQ(ratio(figures, "right by noise", "0", 1), (Ratio{18, 28}));
  // A stratum without labels has no share.
  EXPECT_FALSE(figures.find("found by kind", "shadow", 1)->value);
  // Every table counts each label once.
  for (const auto& [table, total] : {std::pair("found by kind", 20L),
                                     {"found by contrast", 20L},
                                     {"found by length px", 20L},
                                     {"found by length deg", 20L},
                                     {"found by field angle deg", 20L},
                                     {"found by noise", 20L},
                                     {"found by camera model", 20L},
                                     {"found by crowded", 60L},
                                     {"right by length px", 45L},
                                     {"right by length deg", 45L},
                                     {"right by field angle deg", 45L},
                                     {"right by noise", 45L},
                                     {"right by camera model", 45L}}) {
    long sum = 0;
    for (const Figure* figure : figures.of(table, 1)) {
      sum += figure->ratio->total;
    }
    EXPECT_EQ(sum, total) << table;
  }
}

TEST(Figures, LocalisationEndsAndNormals) {
  const Figures figures = makeFigures(exampleSummary());
  EXPECT_NEAR(value(figures, "localisation", "mean px"), 0.5, 1e-9);
  EXPECT_NEAR(value(figures, "localisation", "rms px"), 0.5, 1e-9);
  EXPECT_NEAR(value(figures, "localisation", "p95 px"), 0.5, DistanceStats::kBinPx);
  // 0.5 px of 400 px a radian, less towards the side.
  EXPECT_LE(value(figures, "localisation", "mean mrad"), 1.25);
  EXPECT_GE(value(figures, "localisation", "mean mrad"), 1.0);
  EXPECT_NEAR(value(figures, "end points", "along, mean px"), 0, 1e-9);
  EXPECT_NEAR(value(figures, "end points", "along, p95 of size px"), 0, 1e-9);
  EXPECT_NEAR(value(figures, "end points", "across, rms px"), 0.5, 1e-9);
  EXPECT_EQ(figures.find("end points", "across, rms px")->samples, 30);
  EXPECT_NEAR(value(figures, "normal deg", "length 20-40 deg, median"),
              value(figures, "normal deg", "all, rms"),
              1e-9);
  EXPECT_FALSE(figures.find("normal deg", "length < 10 deg, median")->value);
  // The noise is told, but no blur: no bound.
  EXPECT_EQ(figures.find("normal over bound", "all, offset, rms")->samples, 0);
  // [0.48, 0.52): 0.5 but for rounding.
  EXPECT_EQ(figures.distance_px.counts.at(24) + figures.distance_px.counts.at(25), 15 * 388);
  EXPECT_EQ(figures.distance_px.above, 0);
  EXPECT_FALSE(figures.find("time ms", "detection, mean"));
}

TEST(Figures, NormalsInTermsOfTheBound) {
  const Camera camera = pinholeCamera();
  const LabelLine line = label(camera, {100, 240}, {540, 240}, 0);
  FrameEvaluation one = frame("cam", camera, {line}, {});
  one.labels.sensor = {{"psf_sigma_px", 0.7}, {"read_noise_levels", 2.0}, {"encoding", "linear"}};
  const ImageNoise noise = imageNoise(one.labels).value();
  // Off by twice the bound of the offset, in the middle of the image.
  const double shift = 2 * offsetBoundPx(noise, line.contrast, line.length_px);
  one.detections.lines = {shifted(line, {0, shift})};
  one.outcome = evaluateFrame(camera, {line}, one.detections.lines, EvaluationOptions{}, noise);
  Summary summary{EvaluationOptions{}};
  summary.add(one, camera);
  const Figures figures = makeFigures(summary);
  // Nearly a pure offset: towards the sides the rays are longer, so it is a little more.
  EXPECT_NEAR(value(figures, "normal over bound", "all, offset, rms"), 2, 0.05);
  EXPECT_NEAR(value(figures, "normal over bound", "all, roll, rms"), 0, 0.01);
  EXPECT_NEAR(value(figures, "normal over bound", "all, offset, median") * 0.67449, 2, 0.05);
}

TEST(Figures, PrecisionRecallAsTheScoreFalls) {
  const Figures figures = makeFigures(exampleSummary());
  const std::vector<CurvePoint>& curve = figures.precision_recall.at(0);
  ASSERT_EQ(curve.size(), 17U);  // 15 different scores above 50, then 20 at 50, then 10 at 10
  EXPECT_EQ(curve[0].score, 100);
  EXPECT_NEAR(curve[0].recall, 1.0 / 20, 1e-12);
  EXPECT_EQ(curve[0].precision, 1);
  EXPECT_NEAR(curve[14].recall, 15.0 / 20, 1e-12);
  EXPECT_NEAR(curve[15].recall, 15.0 / 20, 1e-12);
  EXPECT_EQ(curve[15].precision, 1);
  EXPECT_NEAR(curve[16].precision, 35.0 / 45, 1e-12);
}

TEST(Figures, NothingAtAllHasNoValues) {
  const Figures figures = makeFigures(Summary{EvaluationOptions{}});
  for (const Figure& figure : figures.list) {
    EXPECT_FALSE(figure.value) << figure.table << ", " << figure.stratum;
    EXPECT_FALSE(figure.interval);
  }
  EXPECT_GT(figures.list.size(), 100U);
  EXPECT_THAT(table(figures, EvaluationOptions{}), testing::Not(testing::HasSubstr("nan")));
}

TEST(Figures, JsonAndCsvHoldTheSameList) {
  const Figures figures = makeFigures(exampleSummary());
  const auto json = toJson(figures);
  ASSERT_EQ(json.size(), figures.list.size());
  const std::string csv = toCsv(figures, "a,\"b\"");
  EXPECT_EQ(size_t(std::count(csv.begin(), csv.end(), '\n')), figures.list.size());
  EXPECT_THAT(csv, testing::StartsWith("\"a,\"\"b\"\"\",found,headline,1,15,20,,0.75,"));
  EXPECT_EQ(json[0].at("counted"), 15);
  EXPECT_EQ(json[0].at("value"), 0.75);
  EXPECT_FALSE(json[0].contains("samples"));
  EXPECT_THAT(csv + json.dump(), testing::Not(testing::HasSubstr("nan")));
}

TEST(Figures, TextOfValues) {
  Figure figure;
  EXPECT_EQ(valueText(figure), "-");
  figure.value = 0.08712;
  EXPECT_EQ(valueText(figure), "0.0871");
  figure.value = 12.345;
  EXPECT_EQ(valueText(figure), "12.3");
  figure.interval = Interval{1, 20};
  EXPECT_EQ(valueText(figure), "12.3 [1.00, 20.0]");
  figure.ratio = Ratio{7, 8};
  figure.value = 0.875;
  figure.interval = Interval{0.75, 1};
  EXPECT_EQ(valueText(figure), "87.5 [75.0, 100.0] %");
}

}  // namespace
}  // namespace dlsd
