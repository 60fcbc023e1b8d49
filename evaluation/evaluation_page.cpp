#include "evaluation/evaluation_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <tuple>
#include <utility>

#include "cameras/calibration/files.h"
#include "evaluation/picture.h"
#include "evaluation/report_page.h"
#include "evaluation/svg_plot.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;
constexpr int kCropMarginPx = 20, kCropLeastPx = 120, kCropShownPx = 480;
constexpr size_t kCasesPerImage = 2;

struct Box {
  Vector2d min, max;
  [[nodiscard]] bool meets(const Box& other) const {
    return (min.array() <= other.max.array()).all() && (other.min.array() <= max.array()).all();
  }
};

Box boxOf(const std::vector<Vector2d>& points) {
  Box box{points.front(), points.front()};
  for (const Vector2d& p : points) {
    box.min = box.min.cwiseMin(p);
    box.max = box.max.cwiseMax(p);
  }
  return box;
}

/// First pixel and number of pixels of a crop in one direction.
std::pair<int, int> cropRange(double from, double to, int size) {
  const double span = std::max(double(kCropLeastPx), to - from + 2 * kCropMarginPx);
  const int count = std::min(size, int(std::ceil(span)));
  const int first = std::clamp(int(std::floor((from + to - span) / 2)), 0, size - count);
  return {first, count};
}

void keepWorst(std::vector<WorstCase>& cases, WorstCase&& one) {
  const auto worse = [](const WorstCase& a, const WorstCase& b) { return a.rank > b.rank; };
  cases.insert(std::upper_bound(cases.begin(), cases.end(), one, worse), std::move(one));
  if (cases.size() > WorstCases::kCases) {
    cases.pop_back();
  }
}

std::string cropHtml(const WorstCase& one) {
  std::string out = fmt::format(
      "<figure><svg viewBox=\"{:g} {:g} {} {}\"><image href=\"data:image/png;base64,{}\" "
      "x=\"{:g}\" "
      "y=\"{:g}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\"/>",
      one.x - 0.5,
      one.y - 0.5,
      one.width,
      one.height,
      base64(encodePng(one.picture)),
      one.x - 0.5,
      one.y - 0.5,
      one.width,
      one.height);
  for (const WorstCase::Curve& curve : one.curves) {
    out += fmt::format("<polyline class=\"{}\" points=\"", curve.style);
    for (const Vector2d& p : curve.points) {
      out += fmt::format("{:.1f},{:.1f} ", p.x(), p.y());
    }
    out += "\"/>";
  }
  return out + fmt::format("</svg><figcaption><b>{}</b>{}</figcaption></figure>\n",
                           escapedHtml(one.title),
                           escapedHtml(one.note));
}

std::string casesHtml(const std::string& title, const std::vector<WorstCase>& cases) {
  std::string out = "<h3>" + escapedHtml(title) + "</h3>\n";
  if (cases.empty()) {
    return out + "<p>None.</p>\n";
  }
  out += "<div class=\"cases\">\n";
  for (const WorstCase& one : cases) {
    out += cropHtml(one);
  }
  return out + "</div>\n";
}

/// The value; below it its interval and what was counted.
std::string cell(const Figure* figure) {
  if (figure == nullptr) {
    return "<td></td>";
  }
  std::string value = valueText(*figure), below;
  if (const size_t from = value.find(" ["), to = value.find(']'); from != std::string::npos) {
    below = value.substr(from + 1, to - from);
    value.erase(from, to + 1 - from);
  }
  if (figure->ratio) {
    below += fmt::format(
        "{}{}/{}", below.empty() ? "" : " &nbsp;", figure->ratio->counted, figure->ratio->total);
  }
  return "<td>" + escapedHtml(value) + (below.empty() ? "" : "<small>" + below + "</small>") +
         "</td>";
}

std::string tableHtml(const std::vector<std::string>& columns, const std::string& rows) {
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (const std::string& column : columns) {
    out += "<th>" + escapedHtml(column) + "</th>";
  }
  return out + "</tr></thead><tbody>" + rows + "</tbody></table></div>\n";
}

std::string headlineHtml(const std::vector<EvaluatedDetections>& all) {
  const EvaluationOptions& options = all.front().summary.options;
  const std::string at_least = fmt::format(">= {:g} deg", options.headline_angle_rad * kDegrees);
  std::string rows;
  for (const EvaluatedDetections& one : all) {
    for (const double rho : options.rho_px) {
      const Figures& f = one.figures;
      rows += fmt::format("<tr><td>{}</td><td>{:g}</td>",
                          rho == options.rho_px.front() ? escapedHtml(one.name) : "",
                          rho);
      for (const Figure* figure : {f.find("found", "headline", rho),
                                   f.find("right", at_least, rho),
                                   f.find("F", "headline", rho),
                                   f.find("merged", at_least, rho),
                                   f.find("fragments per found run", "headline", rho),
                                   f.find("found", "crowded", rho)}) {
        rows += cell(figure);
      }
      rows += "</tr>";
    }
  }
  return tableHtml({"detections",
                    "rho, px",
                    "headline labels found",
                    "detections " + at_least + " right",
                    "F",
                    "merged",
                    "fragments per found run",
                    "crowded labels found"},
                   rows);
}

/// One row per detector: figures without rho.
std::string valuesHtml(
    const std::vector<EvaluatedDetections>& all,
    const std::vector<std::array<std::string, 3>>& columns /* heading, table, stratum */) {
  std::vector<std::string> headings{"detections"};
  for (const auto& column : columns) {
    headings.push_back(column[0]);
  }
  std::string rows;
  for (const EvaluatedDetections& one : all) {
    rows += "<tr><td>" + escapedHtml(one.name) + "</td>";
    for (const auto& column : columns) {
      rows += cell(one.figures.find(column[1], column[2]));
    }
    rows += "</tr>";
  }
  return tableHtml(headings, rows);
}

std::string normalsHtml(const std::vector<EvaluatedDetections>& all) {
  std::string rows;
  for (const EvaluatedDetections& one : all) {
    bool first = true;
    for (const Figure* median : one.figures.of("normal deg")) {
      const size_t comma = median->stratum.rfind(", median");
      if (comma == std::string::npos) {
        continue;
      }
      const std::string length = median->stratum.substr(0, comma);
      const Figures& f = one.figures;
      rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td>",
                          first ? escapedHtml(one.name) : "",
                          escapedHtml(length),
                          median->samples.value_or(0));
      first = false;
      for (const Figure* figure : {median,
                                   f.find("normal deg", length + ", rms"),
                                   f.find("normal deg", length + ", p95"),
                                   f.find("normal bound", length + ", bound rms deg"),
                                   f.find("normal over bound", length + ", offset, median"),
                                   f.find("normal over bound", length + ", offset, rms"),
                                   f.find("normal over bound", length + ", roll, median"),
                                   f.find("normal over bound", length + ", roll, rms")}) {
        rows += cell(figure);
      }
      rows += "</tr>";
    }
  }
  return tableHtml({"detections",
                    "label",
                    "labels",
                    "median, deg",
                    "rms, deg",
                    "p95, deg",
                    "bound on rms, deg",
                    "offset / bound (median)",
                    "(rms)",
                    "roll / bound (median)",
                    "(rms)"},
                   rows);
}

struct PlottedDimension {
  const char* name;
  const char* axis;
  bool ordered;
};
constexpr PlottedDimension kDimensions[] = {
    {"length px", "length, px", true},
    {"length deg", "length, degrees", true},
    {"contrast", "contrast, grey levels", true},
    {"field angle deg", "field angle of the middle, degrees", true},
    {"kind", "kind", false},
    {"crowded", "crowded", false},
    {"noise", "read noise, grey levels", true},
    {"camera model", "camera model", false}};

/// Series: the tolerances if there is one detector, else the detectors at one tolerance.
std::vector<std::string> seriesNames(const std::vector<EvaluatedDetections>& all, double rho) {
  std::vector<std::string> names;
  if (all.size() > 1) {
    for (const EvaluatedDetections& one : all) {
      names.push_back(fmt::format("{}, rho = {:g} px", one.name, rho));
    }
  } else {
    for (const double each : all.front().summary.options.rho_px) {
      names.push_back(fmt::format("rho = {:g} px", each));
    }
  }
  return names;
}

std::string strataPlot(const std::vector<EvaluatedDetections>& all,
                       double plotted_rho,
                       const std::string& what,
                       const PlottedDimension& dimension) {
  const std::string table = what + " by " + dimension.name;
  std::vector<std::string> categories;
  for (const Figure* figure : all.front().figures.of(table, plotted_rho)) {
    categories.push_back(figure->stratum);
  }
  std::vector<PlotSeries> series;
  const auto add = [&](const std::string& name, const Figures& figures, double rho) {
    PlotSeries& one = series.emplace_back();
    one.name = name;
    one.joined = dimension.ordered;
    size_t i = 0;
    for (const Figure* figure : figures.of(table, rho)) {
      if (figure->value) {
        one.points.push_back({double(i), *figure->value, figure->interval});
      }
      ++i;
    }
  };
  if (all.size() > 1) {
    for (const EvaluatedDetections& one : all) {
      add(one.name, one.figures, plotted_rho);
    }
  } else {
    for (const double rho : all.front().summary.options.rho_px) {
      add(fmt::format("rho = {:g} px", rho), all.front().figures, rho);
    }
  }
  const char* whose = what == "found" ? "Labels" : "Detections";
  return linePlot(fmt::format("{} {}", whose, table),
                  {.title = dimension.axis, .categories = categories},
                  shareAxis("share", series),
                  series);
}

std::string precisionRecallPlot(const std::vector<EvaluatedDetections>& all, size_t plotted) {
  std::vector<PlotSeries> series;
  const auto add = [&](const EvaluatedDetections& one, size_t r) {
    PlotSeries& curve = series.emplace_back();
    curve.name = one.name;
    curve.markers = false;
    for (const CurvePoint& point : one.figures.precision_recall[r]) {
      curve.points.push_back({point.recall, point.precision});
    }
  };
  if (all.size() > 1) {
    for (const EvaluatedDetections& one : all) {
      add(one, plotted);
    }
  } else {
    for (size_t r = 0; r < all.front().figures.precision_recall.size(); ++r) {
      add(all.front(), r);
    }
  }
  return linePlot("Precision and recall, as the least score falls",
                  {.title = "recall: headline labels found", .percent = true},
                  shareAxis("precision: detections right", series),
                  series);
}

std::string histogramPlot(const std::vector<EvaluatedDetections>& all,
                          const std::string& title,
                          PlotAxis x,
                          const Histogram Figures::*histogram) {
  std::vector<PlotSeries> series;
  double most = 0;
  for (const EvaluatedDetections& one : all) {
    const Histogram& h = one.figures.*histogram;
    double total = double(h.below + h.above);
    for (const long count : h.counts) {
      total += double(count);
    }
    PlotSeries& curve = series.emplace_back();
    curve.name = one.name;
    curve.markers = false;
    for (size_t i = 0; i < h.counts.size(); ++i) {
      const double share = total > 0 ? double(h.counts[i]) / total : 0;
      most = std::max(most, share);
      curve.points.push_back({h.edges[i], share});
      curve.points.push_back({h.edges[i + 1], share});
    }
    x.from = h.edges.front();
    x.to = h.edges.back();
  }
  return linePlot(title,
                  x,
                  {.title = "share", .from = 0, .to = most > 0 ? 1.05 * most : 1, .percent = true},
                  series);
}

std::string timesPlot(const std::vector<EvaluatedDetections>& all) {
  std::vector<PlotBar> bars;
  for (size_t i = 0; i < all.size(); ++i) {
    for (const char* stage : {"detection", "rectification"}) {
      const Figure* mean = all[i].figures.find("time ms", std::string(stage) + ", mean");
      if (mean == nullptr || !mean->value) {
        continue;
      }
      const Figure* deviation =
          all[i].figures.find("time ms", std::string(stage) + ", standard deviation");
      bars.push_back(
          {all[i].name + (std::string_view(stage) == "detection" ? "" : ", rectification"),
           *mean->value,
           deviation ? deviation->value : std::nullopt,
           i});
    }
  }
  return bars.empty() ? "" : barPlot("Time per image (whiskers: standard deviation)", "ms", bars);
}

std::string strataHtml(const std::vector<EvaluatedDetections>& all) {
  const std::vector<double>& rhos = all.front().summary.options.rho_px;
  std::vector<std::string> tables;
  for (const Figure& figure : all.front().figures.list) {
    if (figure.table.find(" by ") != std::string::npos &&
        std::find(tables.begin(), tables.end(), figure.table) == tables.end()) {
      tables.push_back(figure.table);
    }
  }
  std::vector<std::string> columns{"", ""};
  for (const EvaluatedDetections& one : all) {
    for (const double rho : rhos) {
      columns.push_back(fmt::format("{}, {:g} px", one.name, rho));
    }
  }
  std::string rows;
  for (const std::string& table : tables) {
    bool first = true;
    for (const Figure* row : all.front().figures.of(table, rhos.front())) {
      rows += fmt::format(
          "<tr><td>{}</td><td>{}</td>", first ? escapedHtml(table) : "", escapedHtml(row->stratum));
      first = false;
      for (const EvaluatedDetections& one : all) {
        for (const double rho : rhos) {
          rows += cell(one.figures.find(table, row->stratum, rho));
        }
      }
      rows += "</tr>";
    }
  }
  return "<details><summary>All strata, counted/total</summary>" + tableHtml(columns, rows) +
         "</details>\n";
}

constexpr std::string_view kPageStyle = R"css(
h3 { font-size: 15px; margin: 22px 0 8px; }
table { font-size: 14px; } td { vertical-align: top; } td small { display: block; margin: 0; line-height: 1.25; }
th { white-space: normal; min-width: 78px; vertical-align: bottom; }
details { margin-top: 14px; } summary { cursor: pointer; font-weight: 600; }
.cases { display: grid; grid-template-columns: repeat(auto-fill, minmax(230px, 1fr)); gap: 14px; }
figure { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 8px; overflow: hidden; }
figure svg { display: block; width: 100%; height: 220px; background: #101112; } figure image { image-rendering: pixelated; }
figcaption { padding: 7px 11px; overflow-wrap: anywhere; font-size: 13px; color: var(--dim); } figcaption b { color: var(--text); display: block; }
.key i { display: inline-block; width: 18px; height: 3px; border-radius: 2px; vertical-align: middle; margin: 0 5px 0 14px; }
.other-label { stroke: #4aa8ff; stroke-opacity: .8; } .miss, .false-alarm { stroke-width: 2.4; }
)css";

}  // namespace

void WorstCases::add(const FrameEvaluation& frame, const Dataset& dataset) {
  const size_t last = options_.rho_px.size() - 1;
  const FrameOutcome& outcome = frame.outcome;
  const auto& labels = frame.labels.lines;
  const auto& detections = frame.detections.lines;
  struct Candidate {
    double rank;
    size_t index;
  };
  const auto top = [](std::vector<Candidate> candidates, const std::vector<WorstCase>& kept) {
    std::erase_if(candidates, [&](const Candidate& c) {
      return kept.size() == kCases && !(c.rank > kept.back().rank);
    });
    std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
      return a.rank > b.rank;
    });
    candidates.resize(std::min(candidates.size(), kCasesPerImage));
    return candidates;
  };
  std::vector<Candidate> missed, wrong;
  for (size_t i = 0; i < labels.size(); ++i) {
    if (outcome.strata[i] == Stratum::kHeadline && !outcome.labels[last][i].found) {
      missed.push_back({labels[i].contrast * labels[i].length_px, i});
    }
  }
  for (size_t i = 0; i < detections.size(); ++i) {
    const DetectionOutcome& at_rho = outcome.detections[last][i];
    if (!at_rho.right && !at_rho.merged &&
        outcome.detection_angle_rad[i] >= options_.headline_angle_rad) {
      wrong.push_back({outcome.detection_score[i], i});
    }
  }
  missed = top(std::move(missed), misses_);
  wrong = top(std::move(wrong), false_alarms_);
  if (missed.empty() && wrong.empty()) {
    return;
  }
  const Image image = dataset.image(frame.labels);
  const auto makeCase = [&](double rank, const std::vector<Vector2d>& points) {
    WorstCase one;
    one.rank = rank;
    const Box box = boxOf(points);
    std::tie(one.x, one.width) = cropRange(box.min.x(), box.max.x(), image.width);
    std::tie(one.y, one.height) = cropRange(box.min.y(), box.max.y(), image.height);
    one.picture = shrunk(cropped(image, one.x, one.y, one.width, one.height), kCropShownPx);
    const Box shown{{one.x, one.y}, {one.x + one.width, one.y + one.height}};
    const auto addCurve = [&](const std::vector<Vector2d>& curve, const char* style) {
      if (boxOf(curve).meets(shown)) {
        one.curves.push_back({curve, style});
      }
    };
    for (const LabelLine& label : labels) {
      addCurve(label.points, "other-label");
    }
    for (size_t i = 0; i < detections.size(); ++i) {
      const DetectionOutcome& at_rho = outcome.detections[last][i];
      addCurve(detections[i].points,
               at_rho.right    ? "right-line"
               : at_rho.merged ? "merged-line"
                               : "false-alarm");
    }
    return one;
  };
  const std::string name =
      (std::filesystem::path(dataset.folder()) / frame.labels.image).lexically_normal().string();
  for (const Candidate& candidate : missed) {
    const LabelLine& label = labels[candidate.index];
    WorstCase one = makeCase(candidate.rank, label.points);
    one.curves.push_back({label.points, "miss"});
    one.title = fmt::format("{}, label {}", name, label.id);
    one.note = fmt::format("{}, contrast {:.0f}, {:.0f} px, {:.1f} deg, {:.0f} % covered",
                           toString(label.kind),
                           label.contrast,
                           label.length_px,
                           label.angle_rad * kDegrees,
                           100 * outcome.labels[last][candidate.index].coverage);
    keepWorst(misses_, std::move(one));
  }
  for (const Candidate& candidate : wrong) {
    WorstCase one = makeCase(candidate.rank, detections[candidate.index].points);
    one.curves.push_back({detections[candidate.index].points, "false-alarm"});
    one.title = fmt::format("{}, detection {}", name, candidate.index);
    one.note = fmt::format("score {:.1f}, {:.0f} px, {:.1f} deg, {:.0f} % on its best carrier",
                           candidate.rank,
                           outcome.detection_length_px[candidate.index],
                           outcome.detection_angle_rad[candidate.index] * kDegrees,
                           100 * outcome.detections[last][candidate.index].coverage);
    keepWorst(false_alarms_, std::move(one));
  }
}

ordered_json evaluationJson(const std::vector<EvaluatedDetections>& all) {
  ordered_json results = ordered_json::array();
  for (const EvaluatedDetections& one : all) {
    ordered_json result{{"detections", one.name}};
    result.update(toJson(one.summary));
    result["figures"] = toJson(one.figures);
    results.push_back(std::move(result));
  }
  return {{"format", "dlsd-evaluation/1"}, {"results", std::move(results)}};
}

std::string pageOf(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n"
      "<style>{1}{2}{3}</style></head>\n<body><main>\n<h1>{0}</h1>\n{4}</main></body></html>\n",
      escapedHtml(title),
      kReportStyle,
      kPlotStyle,
      kPageStyle,
      body);
}

void writeEvaluationPage(const std::vector<EvaluatedDetections>& all,
                         const std::string& title,
                         const std::string& folder) {
  const EvaluationOptions& options = all.front().summary.options;
  const GroupSummary& group = all.front().summary.all;
  const size_t plotted = options.rho_px.size() / 2;
  const double rho = options.rho_px[plotted];

  std::string body = fmt::format(
      "<p>{} images, {} labels, {} of them headline: contrast &ge; {:g} grey levels, length &ge; "
      "{:g}&deg; and {:g} px, no other label within {:g} px. Intervals: 95 %, bootstrap over "
      "images. What each figure means: docs/evaluation.md.</p>\n",
      group.frames,
      group.labels,
      group.at_rho.front().found[size_t(Stratum::kHeadline)].total,
      options.headline_contrast,
      options.headline_angle_rad * kDegrees,
      options.headline_length_px,
      options.crowded_px);
  body += headlineHtml(all);
  body += "<h2>Where lines are found</h2>\n" + plotLegend(seriesNames(all, rho)) +
          "<div class=\"plots\">\n";
  for (const PlottedDimension& dimension : kDimensions) {
    body += strataPlot(all, rho, "found", dimension);
  }
  for (const PlottedDimension& dimension : {kDimensions[1], kDimensions[3]}) {
    body += strataPlot(all, rho, "right", dimension);
  }
  body += precisionRecallPlot(all, plotted) + "</div>\n";
  body += strataHtml(all);

  std::vector<std::string> names;
  for (const EvaluatedDetections& one : all) {
    names.push_back(one.name);
  }
  body += "<h2>How well they lie</h2>\n<p>Headline labels that were found.</p>\n";
  body += valuesHtml(all,
                     {{"distance, mean px", "localisation", "mean px"},
                      {"rms px", "localisation", "rms px"},
                      {"p95 px", "localisation", "p95 px"},
                      {"mean mrad", "localisation", "mean mrad"},
                      {"rms mrad", "localisation", "rms mrad"},
                      {"ends along, median px", "end points", "along, median px"},
                      {"median of size", "end points", "along, median of size px"},
                      {"p95 of size", "end points", "along, p95 of size px"},
                      {"ends across, rms px", "end points", "across, rms px"}});
  body += "<h3>Plane normals</h3>\n" + normalsHtml(all);
  body += plotLegend(names) + "<div class=\"plots\">\n";
  body += histogramPlot(all,
                        "Distance of label samples to their detection",
                        {.title = "px", .from = 0, .to = 1},
                        &Figures::distance_px);
  body += histogramPlot(all,
                        "Angle between the planes",
                        {.title = "degrees", .from = 1e-4, .to = 10, .logarithmic = true},
                        &Figures::normal_deg);
  body += timesPlot(all) + "</div>\n";

  body +=
      "<h2>Structural average precision</h2>\n<p>As other projects report it, at 128 x 128: "
      "thresholds 5, 10, 15 are errors of 1.6 to 2.7 px there. Clear labels: neither faint nor "
      "short; detections of the others are left out.</p>\n";
  for (const char* kind : {"curve", "chord"}) {
    std::vector<std::array<std::string, 3>> columns;
    for (const char* labels : {"all labels", "clear labels"}) {
      for (const char* what : {"T = 5", "T = 10", "T = 15", "mean"}) {
        columns.push_back({fmt::format("{}, {}, {}", kind, labels, what),
                           fmt::format("sAP {}", kind),
                           fmt::format("{}, {}", labels, what)});
      }
    }
    body += valuesHtml(all, columns);
  }

  body += fmt::format(
      "<h2>Worst cases at &rho; = {:g} px</h2>\n<p class=\"key\"><i "
      "style=\"background:#ff4d6d\"></i>"
      "missed label<i style=\"background:#4aa8ff\"></i>labels<i style=\"background:#22d3ee\"></i>"
      "right<i style=\"background:#fb923c\"></i>merged<i "
      "style=\"background:#facc15\"></i>wrong</p>\n",
      options.rho_px.back());
  for (const EvaluatedDetections& one : all) {
    body += casesHtml(one.name + ": missed headline labels, by contrast times length",
                      one.worst.misses());
    body += casesHtml(one.name + ": detections on nothing, by score", one.worst.falseAlarms());
  }

  std::string csv(kFiguresCsvHeader);
  for (const EvaluatedDetections& one : all) {
    csv += toCsv(one.figures, one.name);
  }
  makeFolders(folder);
  writeFileAtomically(folder + "/figures.csv", csv);
  writeFileAtomically(folder + "/evaluation.json", evaluationJson(all).dump(1) + "\n");
  writeFileAtomically(folder + "/index.html", pageOf(title, body));
}

}  // namespace dlsd
