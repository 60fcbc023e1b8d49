#include "evaluation/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

namespace dlsd {
namespace {

using nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;
/// Average precision costs a pass over all detections for each resample.
constexpr size_t kApResamples = 200;
/// Median of |x| for standard normal x.
constexpr double kNormalMedian = 0.6744897501960817;

/// A row of a table: its name, and what belongs to it.
template <class Row>
struct Part {
  std::string name;
  std::function<bool(const Row&)> holds;
};

/// What labels and detections are sorted into.
template <class Row>
struct Dimension {
  std::string table;
  std::function<bool(const Row&)> counts;  ///< Rows that the table is about.
  std::vector<Part<Row>> parts;
};

/// Strata "< e0", "e0-e1", ..., ">= en" of a number.
template <class Row>
std::vector<Part<Row>> bins(const std::vector<double>& edges,
                            const std::function<std::optional<double>(const Row&)>& of) {
  std::vector<Part<Row>> parts;
  for (size_t i = 0; i <= edges.size(); ++i) {
    const std::string name = i == 0              ? fmt::format("< {:g}", edges[0])
                             : i == edges.size() ? fmt::format(">= {:g}", edges.back())
                                                 : fmt::format("{:g}-{:g}", edges[i - 1], edges[i]);
    parts.push_back({name, [=](const Row& row) {
                       const std::optional<double> x = of(row);
                       return x && (i == 0 || *x >= edges[i - 1]) &&
                              (i == edges.size() || *x < edges[i]);
                     }});
  }
  return parts;
}

/// Edges of the bins, for labels and detections.
const std::vector<double> kContrastEdges{5, 10, 20, 40, 80};
const std::vector<double> kLengthEdgesPx{20, 40, 80, 160, 320};
const std::vector<double> kLengthEdgesDeg{2, 5, 10, 20, 40};
const std::vector<double> kFieldEdgesDeg{15, 30, 45, 60, 75, 90};

template <class Row>
void addImageDimensions(const Summary& summary,
                        const std::string& what,
                        const std::function<bool(const Row&)>& counts,
                        std::vector<Dimension<Row>>& dimensions) {
  const auto& images = summary.images;
  std::set<std::optional<double>> noises;
  std::set<std::string> models;
  for (const ImageRow& image : images) {
    noises.insert(image.noise_levels);
    models.insert(image.model);
  }
  Dimension<Row> noise{what + " by noise", counts, {}};
  for (const std::optional<double>& value : noises) {
    noise.parts.push_back(
        {value ? fmt::format("{:g}", *value) : "unknown",
         [&images, value](const Row& row) { return images[row.image].noise_levels == value; }});
  }
  Dimension<Row> model{what + " by camera model", counts, {}};
  for (const std::string& value : models) {
    model.parts.push_back(
        {value, [&images, value](const Row& row) { return images[row.image].model == value; }});
  }
  dimensions.push_back(std::move(noise));
  dimensions.push_back(std::move(model));
}

/// In each table the conditions of the headline hold that are not what the table is about.
std::vector<Dimension<LabelRow>> labelDimensions(const Summary& summary) {
  using Row = LabelRow;
  const auto headline = [](const Row& row) {
    return stratumOf(row.conditions) == Stratum::kHeadline;
  };
  const auto any_length = [](const Row& row) {
    return !row.conditions.faint && !row.conditions.crowded;
  };
  std::vector<Dimension<Row>> dimensions;
  Dimension<Row> kinds{"found by kind", headline, {}};
  for (const LineKind kind : {LineKind::kCrease,
                              LineKind::kSilhouette,
                              LineKind::kMaterial,
                              LineKind::kWire,
                              LineKind::kShadow}) {
    kinds.parts.push_back(
        {std::string(toString(kind)), [kind](const Row& row) { return row.kind == kind; }});
  }
  dimensions.push_back(std::move(kinds));
  dimensions.push_back(
      {"found by contrast",
       [](const Row& row) { return !row.conditions.is_short && !row.conditions.crowded; },
       bins<Row>(kContrastEdges, [](const Row& row) { return row.contrast; })});
  dimensions.push_back({"found by length px",
                        any_length,
                        bins<Row>(kLengthEdgesPx, [](const Row& row) { return row.length_px; })});
  dimensions.push_back(
      {"found by length deg", any_length, bins<Row>(kLengthEdgesDeg, [](const Row& row) {
         return row.angle_rad * kDegrees;
       })});
  dimensions.push_back(
      {"found by field angle deg", headline, bins<Row>(kFieldEdgesDeg, [](const Row& row) {
         return row.field_angle_rad * kDegrees;
       })});
  dimensions.push_back(
      {"found by crowded",
       [](const Row& row) { return !row.conditions.faint && !row.conditions.is_short; },
       {{"no", [](const Row& row) { return !row.conditions.crowded; }},
        {"yes", [](const Row& row) { return row.conditions.crowded; }}}});
  addImageDimensions<Row>(summary, "found", headline, dimensions);
  return dimensions;
}

std::vector<Dimension<DetectionRow>> detectionDimensions(const Summary& summary) {
  using Row = DetectionRow;
  const double min_angle_rad = summary.options.headline_angle_rad;
  const auto all = [](const Row&) { return true; };
  const auto at_least = [=](const Row& row) { return row.angle_rad >= min_angle_rad; };
  std::vector<Dimension<Row>> dimensions;
  dimensions.push_back({"right by length px", all, bins<Row>(kLengthEdgesPx, [](const Row& row) {
                          return row.length_px;
                        })});
  dimensions.push_back({"right by length deg", all, bins<Row>(kLengthEdgesDeg, [](const Row& row) {
                          return row.angle_rad * kDegrees;
                        })});
  dimensions.push_back({"right by field angle deg",
                        at_least,
                        bins<Row>(kFieldEdgesDeg, [](const Row& row) -> std::optional<double> {
                          if (!row.field_angle_rad) {
                            return std::nullopt;
                          }
                          return *row.field_angle_rad * kDegrees;
                        })});
  addImageDimensions<Row>(summary, "right", at_least, dimensions);
  return dimensions;
}

/// Interpolated quantile of values, which are sorted by it.
std::optional<double> quantile(std::vector<double>& values, double q) {
  if (values.empty()) {
    return std::nullopt;
  }
  std::sort(values.begin(), values.end());
  return dlsd::quantile(values, q);
}

/// The same whatever their order: sorts them first.
std::optional<double> rms(std::vector<double>& values) {
  if (values.empty()) {
    return std::nullopt;
  }
  std::sort(values.begin(), values.end());
  double sum2 = 0;
  for (const double value : values) {
    sum2 += value * value;
  }
  return std::sqrt(sum2 / double(values.size()));
}

/// Builds the list.
class Maker {
 public:
  explicit Maker(const Summary& summary)
      : summary_(summary), rhos_(summary.options.rho_px), bootstrap_(summary.images.size()) {
    for (const LabelRow& row : summary_.labels) {
      if (row.errors && stratumOf(row.conditions) == Stratum::kHeadline) {
        with_errors_.push_back(&row);
      }
    }
    // Sums of floating-point numbers depend on their order: take one that labels can't change.
    const auto key = [](const LabelRow* row) {
      const LabelErrors& e = *row->errors;
      return std::tuple(row->image, e.sum_px, e.sum2_px2, e.sum_rad, e.sum2_rad2);
    };
    std::sort(with_errors_.begin(), with_errors_.end(), [&](const auto* a, const auto* b) {
      return key(a) < key(b);
    });
  }

  Figures make() {
    counts();
    for (const auto& dimension : labelDimensions(summary_)) {
      strata(summary_.labels, dimension, [](const LabelRow& row) { return row.found; });
    }
    for (const auto& dimension : detectionDimensions(summary_)) {
      strata(summary_.detections, dimension, [](const DetectionRow& row) { return row.right; });
    }
    structuralAp();
    localisation();
    ends();
    normals();
    times();
    precisionRecall();
    return std::move(figures_);
  }

 private:
  using PerImage = std::vector<double>;
  struct Sums {
    PerImage counted, total;
  };

  [[nodiscard]] Sums empty() const {
    return {PerImage(summary_.images.size()), PerImage(summary_.images.size())};
  }

  Figure& add(std::string table, std::string stratum) {
    Figure& figure = figures_.list.emplace_back();
    figure.table = std::move(table);
    figure.stratum = std::move(stratum);
    return figure;
  }

  /// A share, and the sums that it was made of.
  template <class Row, class Counts, class Bits>
  Sums share(const std::string& table,
             const std::string& stratum,
             size_t rho,
             const std::vector<Row>& rows,
             const Counts& counts,
             const Bits& bits) {
    Sums sums = empty();
    Ratio ratio;
    for (const Row& row : rows) {
      if (counts(row)) {
        const long one = (bits(row) >> rho) & 1U;
        ratio += {one, 1};
        sums.counted[row.image] += double(one);
        sums.total[row.image] += 1;
      }
    }
    Figure& figure = add(table, stratum);
    figure.rho_px = rhos_[rho];
    figure.ratio = ratio;
    if (ratio.total > 0) {
      figure.value = double(ratio.counted) / double(ratio.total);
      figure.interval = bootstrap_.ofRatio(sums.counted, sums.total);
    }
    return sums;
  }

  void counts() {
    const double min_angle_rad = summary_.options.headline_angle_rad;
    const std::string at_least = fmt::format(">= {:g} deg", min_angle_rad * kDegrees);
    const auto found = [](const LabelRow& row) { return row.found; };
    const auto right = [](const DetectionRow& row) { return row.right; };
    const auto merged = [](const DetectionRow& row) { return row.merged; };
    const auto is_long = [&](const DetectionRow& row) { return row.angle_rad >= min_angle_rad; };
    const auto all = [](const auto&) { return true; };
    for (size_t r = 0; r < rhos_.size(); ++r) {
      Sums recall;
      for (const Stratum s :
           {Stratum::kHeadline, Stratum::kCrowded, Stratum::kShort, Stratum::kFaint}) {
        Sums sums = share(
            "found",
            std::string(toString(s)),
            r,
            summary_.labels,
            [s](const LabelRow& row) { return stratumOf(row.conditions) == s; },
            found);
        if (s == Stratum::kHeadline) {
          recall = std::move(sums);
        }
      }
      const Sums precision = share("right", at_least, r, summary_.detections, is_long, right);
      share("right", "all", r, summary_.detections, all, right);
      share("merged", at_least, r, summary_.detections, is_long, merged);
      share("merged", "all", r, summary_.detections, all, merged);
      fOf(recall, precision, r);
      const Ratio& fragments = summary_.all.at_rho[r].fragments[size_t(Stratum::kHeadline)];
      Figure& figure = add("fragments per found run", "headline");
      figure.rho_px = rhos_[r];
      figure.ratio = fragments;
      if (fragments.total > 0) {
        figure.value = double(fragments.counted) / double(fragments.total);
      }
    }
  }

  void fOf(const Sums& recall, const Sums& precision, size_t rho) {
    const auto f = [&](std::span<const uint8_t> weights) -> std::optional<double> {
      double found = 0, labels = 0, right = 0, detections = 0;
      for (size_t i = 0; i < recall.total.size(); ++i) {
        const double weight = weights.empty() ? 1 : weights[i];
        found += weight * recall.counted[i];
        labels += weight * recall.total[i];
        right += weight * precision.counted[i];
        detections += weight * precision.total[i];
      }
      if (!(labels > 0 && detections > 0)) {
        return std::nullopt;
      }
      const double r = found / labels, p = right / detections;
      return r + p > 0 ? 2 * r * p / (r + p) : 0;
    };
    Figure& figure = add("F", "headline");
    figure.rho_px = rhos_[rho];
    figure.value = f({});
    figure.interval = bootstrap_.of(bootstrap_.resamples(), f);
  }

  template <class Row, class Bits>
  void strata(const std::vector<Row>& rows, const Dimension<Row>& dimension, const Bits& bits) {
    for (const Part<Row>& part : dimension.parts) {
      for (size_t r = 0; r < rhos_.size(); ++r) {
        share(
            dimension.table,
            part.name,
            r,
            rows,
            [&](const Row& row) { return dimension.counts(row) && part.holds(row); },
            bits);
      }
    }
  }

  void structuralAp() {
    constexpr std::array<std::pair<const char*, const char*>, kStructuralKinds> kNames{
        {{"sAP curve", "all labels"},
         {"sAP curve", "clear labels"},
         {"sAP chord", "all labels"},
         {"sAP chord", "clear labels"}}};
    for (size_t k = 0; k < kStructuralKinds; ++k) {
      const StructuralAp ap(summary_.structure[k]);
      long labels = 0;
      for (const StructuralOutcome& image : summary_.structure[k]) {
        labels += image.labels;
      }
      double sum = 0;
      for (size_t t = 0; t < kStructuralThresholds.size(); ++t) {
        const auto at = [&](std::span<const uint8_t> weights) -> std::optional<double> {
          return ap.averagePrecision(t, weights);
        };
        Figure& figure =
            add(kNames[k].first,
                fmt::format("{}, T = {:g}", kNames[k].second, kStructuralThresholds[t]));
        figure.samples = labels;
        if (labels > 0) {
          figure.value = *at({});
          sum += *figure.value;
          figure.interval = bootstrap_.of(kApResamples, at);
        }
      }
      Figure& mean = add(kNames[k].first, fmt::format("{}, mean", kNames[k].second));
      mean.samples = labels;
      if (labels > 0) {
        mean.value = sum / double(kStructuralThresholds.size());
      }
    }
  }

  void value(const std::string& table,
             const std::string& stratum,
             long samples,
             std::optional<double> number,
             std::optional<Interval> interval = std::nullopt) {
    Figure& figure = add(table, stratum);
    figure.samples = samples;
    if (samples > 0) {
      figure.value = number;
      figure.interval = interval;
    }
  }

  /// Mean and RMS from sums per image.
  void meanAndRms(const std::string& table,
                  const std::string& unit,
                  const PerImage& sum,
                  const PerImage& sum2,
                  const PerImage& count) {
    double all = 0, all2 = 0, samples = 0;
    for (size_t i = 0; i < count.size(); ++i) {
      all += sum[i];
      all2 += sum2[i];
      samples += count[i];
    }
    value(table,
          "mean " + unit,
          long(samples),
          all / samples,
          samples > 0 ? bootstrap_.ofRatio(sum, count) : std::nullopt);
    std::optional<Interval> interval;
    if (samples > 0 && (interval = bootstrap_.ofRatio(sum2, count))) {
      interval = Interval{std::sqrt(interval->low), std::sqrt(interval->high)};
    }
    value(table, "rms " + unit, long(samples), std::sqrt(all2 / samples), interval);
  }

  void localisation() {
    const size_t n = summary_.images.size();
    PerImage px(n), px2(n), count(n), mrad(n), mrad2(n), angle_count(n);
    for (const LabelRow* row : with_errors_) {
      const LabelErrors& errors = *row->errors;
      px[row->image] += errors.sum_px;
      px2[row->image] += errors.sum2_px2;
      count[row->image] += double(errors.samples);
      mrad[row->image] += 1e3 * errors.sum_rad;
      mrad2[row->image] += 1e6 * errors.sum2_rad2;
      angle_count[row->image] += double(errors.angle_samples);
    }
    meanAndRms("localisation", "px", px, px2, count);
    const DistanceStats& stats = summary_.all.localisation[size_t(Stratum::kHeadline)];
    value("localisation", "p95 px", stats.count, stats.quantile(0.95));
    meanAndRms("localisation", "mrad", mrad, mrad2, angle_count);

    Histogram& histogram = figures_.distance_px;
    constexpr double kWidthPx = 0.02, kEndPx = 1;
    for (double edge = 0; edge < kEndPx + kWidthPx / 2; edge += kWidthPx) {
      histogram.edges.push_back(edge);
    }
    histogram.counts.assign(histogram.edges.size() - 1, 0);
    for (size_t i = 0; i < stats.bins.size(); ++i) {
      const auto bin = size_t((double(i) + 0.5) * DistanceStats::kBinPx / kWidthPx);
      (bin < histogram.counts.size() ? histogram.counts[bin] : histogram.above) += stats.bins[i];
    }
  }

  void ends() {
    std::vector<double> along, along_size, across;
    for (const LabelRow* row : with_errors_) {
      for (const std::optional<EndError>& end : row->errors->ends) {
        if (end) {
          along.push_back(end->along_px);
          along_size.push_back(std::abs(end->along_px));
          across.push_back(end->across_px);
        }
      }
    }
    const auto n = long(along.size());
    const std::optional<double> across_p95 = quantile(across, 0.95);  // sorts, as sums need it
    const std::optional<double> along_median = quantile(along, 0.5);
    value("end points",
          "along, mean px",
          n,
          std::accumulate(along.begin(), along.end(), 0.0) / double(n));
    value("end points", "along, median px", n, along_median);
    value("end points", "along, median of size px", n, quantile(along_size, 0.5));
    value("end points", "along, p95 of size px", n, quantile(along_size, 0.95));
    value("end points", "across, rms px", n, rms(across));
    value("end points", "across, p95 px", n, across_p95);
  }

  void normals() {
    const auto all = [](const LabelRow&) { return true; };
    auto parts =
        bins<LabelRow>({10, 20, 40}, [](const LabelRow& row) { return row.angle_rad * kDegrees; });
    parts.push_back({"all", all});
    for (const Part<LabelRow>& part : parts) {
      std::vector<double> deg, offset, roll, angle, bound_deg;
      for (const LabelRow* row : with_errors_) {
        if (!part.holds(*row)) {
          continue;
        }
        if (row->errors->normal_rad) {
          deg.push_back(*row->errors->normal_rad * kDegrees);
        }
        if (const std::optional<NormalErrorInSigmas>& sigmas = row->errors->normal_sigmas) {
          offset.push_back(sigmas->offset);
          roll.push_back(sigmas->roll);
          angle.push_back(sigmas->angle);
          bound_deg.push_back(sigmas->bound_rad * kDegrees);
        }
      }
      if (part.name == "all") {
        logHistogram(deg);
      }
      const std::string length = part.name == "all" ? part.name : "length " + part.name + " deg";
      const auto n = long(deg.size());
      value("normal deg", length + ", median", n, quantile(deg, 0.5));
      value("normal deg", length + ", rms", n, rms(deg));
      value("normal deg", length + ", p95", n, quantile(deg, 0.95));
      const auto m = long(offset.size());
      value("normal bound", length + ", bound rms deg", m, rms(bound_deg));
      const auto relative = [&](const std::string& what, std::vector<double>& sigmas) {
        value("normal over bound", length + ", " + what + ", rms", m, rms(sigmas));
        const std::optional<double> median = quantile(sigmas, 0.5);
        value("normal over bound",
              length + ", " + what + ", median",
              m,
              median ? std::optional(*median / kNormalMedian) : std::nullopt);
      };
      relative("offset", offset);
      relative("roll", roll);
      value("normal over bound", length + ", angle, rms", m, rms(angle));
    }
  }

  void logHistogram(const std::vector<double>& deg) {
    Histogram& histogram = figures_.normal_deg;
    constexpr int kFrom = -4, kTo = 1, kPerDecade = 8;
    for (int i = kFrom * kPerDecade; i <= kTo * kPerDecade; ++i) {
      histogram.edges.push_back(std::pow(10, double(i) / kPerDecade));
    }
    histogram.counts.assign(histogram.edges.size() - 1, 0);
    for (const double value : deg) {
      const auto it = std::upper_bound(histogram.edges.begin(), histogram.edges.end(), value);
      if (it == histogram.edges.begin()) {
        ++histogram.below;
      } else if (it == histogram.edges.end()) {
        ++histogram.above;
      } else {
        ++histogram.counts[size_t(it - histogram.edges.begin()) - 1];
      }
    }
  }

  void times() {
    const auto one = [&](const char* stage, std::optional<double> ImageRow::*ms) {
      double sum = 0, sum2 = 0;
      long n = 0;
      for (const ImageRow& image : summary_.images) {
        if (image.*ms) {
          sum += *(image.*ms);
          ++n;
        }
      }
      const double mean = sum / double(n);
      for (const ImageRow& image : summary_.images) {
        if (image.*ms) {
          sum2 += (*(image.*ms) - mean) * (*(image.*ms) - mean);
        }
      }
      if (n > 0) {
        value("time ms", std::string(stage) + ", mean", n, mean);
        value("time ms",
              std::string(stage) + ", standard deviation",
              n,
              n > 1 ? std::optional(std::sqrt(sum2 / double(n - 1))) : std::nullopt);
      }
    };
    one("detection", &ImageRow::time_ms);
    one("rectification", &ImageRow::rectification_ms);
  }

  void precisionRecall() {
    constexpr size_t kPoints = 400;
    for (size_t r = 0; r < rhos_.size(); ++r) {
      std::vector<std::pair<double, bool>> detections;
      for (const DetectionRow& row : summary_.detections) {
        if (row.angle_rad >= summary_.options.headline_angle_rad) {
          detections.emplace_back(row.score, (row.right >> r & 1U) != 0);
        }
      }
      std::vector<double> found;
      long labels = 0;
      for (const LabelRow& row : summary_.labels) {
        if (stratumOf(row.conditions) == Stratum::kHeadline) {
          ++labels;
          if ((row.found >> r & 1U) != 0) {
            found.push_back(row.found_score[r]);
          }
        }
      }
      const auto descending = [](const auto& a, const auto& b) { return a > b; };
      std::sort(detections.begin(), detections.end(), descending);
      std::sort(found.begin(), found.end(), descending);
      std::vector<CurvePoint>& curve = figures_.precision_recall.emplace_back();
      const size_t every = std::max<size_t>(1, detections.size() / kPoints);
      size_t right = 0, found_so_far = 0;
      for (size_t i = 0; i < detections.size() && labels > 0; ++i) {
        const double score = detections[i].first;
        right += detections[i].second ? 1 : 0;
        // Detections of one score come in together.
        const bool last = i + 1 == detections.size();
        if (!last && (detections[i + 1].first == score || i % every != every - 1)) {
          continue;
        }
        while (found_so_far < found.size() && found[found_so_far] >= score) {
          ++found_so_far;
        }
        curve.push_back(
            {score, double(found_so_far) / double(labels), double(right) / double(i + 1)});
      }
    }
  }

  const Summary& summary_;
  /// Headline labels that were found at the largest rho.
  std::vector<const LabelRow*> with_errors_;
  const std::vector<double>& rhos_;
  Bootstrap bootstrap_;
  Figures figures_;
};

std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) {
    return text;
  }
  std::string out = "\"";
  for (const char c : text) {
    out += c == '"' ? std::string("\"\"") : std::string(1, c);
  }
  return out + "\"";
}

}  // namespace

const Figure* Figures::find(const std::string& table,
                            const std::string& stratum,
                            std::optional<double> rho_px) const {
  const auto it = std::find_if(list.begin(), list.end(), [&](const Figure& figure) {
    return figure.table == table && figure.stratum == stratum && figure.rho_px == rho_px;
  });
  return it == list.end() ? nullptr : &*it;
}

std::vector<const Figure*> Figures::of(const std::string& table,
                                       std::optional<double> rho_px) const {
  std::vector<const Figure*> figures;
  for (const Figure& figure : list) {
    if (figure.table == table && figure.rho_px == rho_px) {
      figures.push_back(&figure);
    }
  }
  return figures;
}

Figures makeFigures(const Summary& summary) {
  return Maker(summary).make();
}

std::string valueText(const Figure& figure) {
  if (!figure.value) {
    return "-";
  }
  // Three digits after the first that is not 0.
  const auto number = [](double x) {
    const double size = std::abs(x);
    const int decimals =
        size >= 100 || size == 0 ? 1 : std::clamp(2 - int(std::floor(std::log10(size))), 0, 6);
    return fmt::format("{:.{}f}", x, decimals);
  };
  if (figure.ratio && figure.table != "fragments per found run") {
    const auto percent = [](double x) { return fmt::format("{:.1f}", 100 * x); };
    std::string out = percent(*figure.value);
    if (figure.interval) {
      out += " [" + percent(figure.interval->low) + ", " + percent(figure.interval->high) + "]";
    }
    return out + " %";
  }
  std::string out = number(*figure.value);
  if (figure.interval) {
    out += " [" + number(figure.interval->low) + ", " + number(figure.interval->high) + "]";
  }
  return out;
}

std::string table(const Figures& figures, const EvaluationOptions& options) {
  std::string out = "\nAll cameras, with 95 % intervals (bootstrap over images)\n";
  const auto line = [&](const std::string& name, const std::vector<std::string>& cells) {
    std::string row = fmt::format("{:<28}", name);
    for (const std::string& cell : cells) {
      row += fmt::format("  {:>26}", cell);
    }
    out += row + "\n";
  };
  const auto text = [](const Figure* figure) { return figure ? valueText(*figure) : "-"; };
  const auto one = [&](const std::string& name, const std::string& stratum) {
    return text(figures.find(name, stratum));
  };
  line("rho_px", {"found (headline)", "right (>= 5 deg)", "F"});
  const std::string at_least = fmt::format(">= {:g} deg", options.headline_angle_rad * kDegrees);
  for (const double rho : options.rho_px) {
    line(fmt::format("{:g}", rho),
         {text(figures.find("found", "headline", rho)),
          text(figures.find("right", at_least, rho)),
          text(figures.find("F", "headline", rho))});
  }
  out += "\n";
  line("sAP at 128 x 128", {"T = 5", "T = 10", "T = 15"});
  for (const char* kind : {"curve", "chord"}) {
    for (const char* labels : {"all labels", "clear labels"}) {
      const std::string name = std::string("sAP ") + kind;
      line(std::string(kind) + ", " + labels,
           {one(name, std::string(labels) + ", T = 5"),
            one(name, std::string(labels) + ", T = 10"),
            one(name, std::string(labels) + ", T = 15")});
    }
  }
  out += "\n";
  line("found headline labels", {"mean", "rms", "p95"});
  line("distance px",
       {one("localisation", "mean px"),
        one("localisation", "rms px"),
        one("localisation", "p95 px")});
  line("distance mrad", {one("localisation", "mean mrad"), one("localisation", "rms mrad"), ""});
  out += "\n";
  line("their ends, px", {"median", "median of size", "p95 of size"});
  line("along (+: beyond the label)",
       {one("end points", "along, median px"),
        one("end points", "along, median of size px"),
        one("end points", "along, p95 of size px")});
  line("across",
       {"", "rms " + one("end points", "across, rms px"), one("end points", "across, p95 px")});
  out += "\n";
  const auto relative = [&](const std::string& what) {
    return fmt::format("{} ({})",
                       one("normal over bound", what + ", median"),
                       one("normal over bound", what + ", rms"));
  };
  line("their plane normals",
       {"median deg",
        "rms deg",
        "bound rms deg",
        "offset / bound (rms)",
        "roll / bound (rms)",
        "labels"});
  for (const Figure* figure : figures.of("normal deg")) {
    const size_t comma = figure->stratum.rfind(", median");
    if (comma == std::string::npos) {
      continue;
    }
    const std::string length = figure->stratum.substr(0, comma);
    line(length,
         {valueText(*figure),
          one("normal deg", length + ", rms"),
          one("normal bound", length + ", bound rms deg"),
          relative(length + ", offset"),
          relative(length + ", roll"),
          fmt::format("{}", figure->samples.value_or(0))});
  }
  if (const Figure* mean = figures.find("time ms", "detection, mean")) {
    out += "\n";
    line("time ms", {"mean", "standard deviation", "images"});
    for (const char* stage : {"detection", "rectification"}) {
      if (figures.find("time ms", std::string(stage) + ", mean")) {
        line(stage,
             {one("time ms", std::string(stage) + ", mean"),
              one("time ms", std::string(stage) + ", standard deviation"),
              fmt::format("{}", mean->samples.value_or(0))});
      }
    }
  }
  return out;
}

ordered_json toJson(const Figures& figures) {
  ordered_json list = ordered_json::array();
  for (const Figure& figure : figures.list) {
    ordered_json j{{"table", figure.table}, {"stratum", figure.stratum}};
    if (figure.rho_px) {
      j["rho_px"] = *figure.rho_px;
    }
    if (figure.ratio) {
      j["counted"] = figure.ratio->counted;
      j["total"] = figure.ratio->total;
    }
    if (figure.samples) {
      j["samples"] = *figure.samples;
    }
    if (figure.value) {
      j["value"] = *figure.value;
    }
    if (figure.interval) {
      j["low"] = figure.interval->low;
      j["high"] = figure.interval->high;
    }
    list.push_back(std::move(j));
  }
  return list;
}

std::string toCsv(const Figures& figures, const std::string& detections) {
  std::string out;
  const auto number = [](const std::optional<double>& value) {
    return value ? fmt::format("{}", *value) : std::string();
  };
  for (const Figure& figure : figures.list) {
    out += fmt::format("{},{},{},{},{},{},{},{},{},{}\n",
                       csvField(detections),
                       csvField(figure.table),
                       csvField(figure.stratum),
                       number(figure.rho_px),
                       figure.ratio ? fmt::format("{}", figure.ratio->counted) : "",
                       figure.ratio ? fmt::format("{}", figure.ratio->total) : "",
                       figure.samples ? fmt::format("{}", *figure.samples) : "",
                       number(figure.value),
                       figure.interval ? fmt::format("{}", figure.interval->low) : "",
                       figure.interval ? fmt::format("{}", figure.interval->high) : "");
  }
  return out;
}

}  // namespace dlsd
