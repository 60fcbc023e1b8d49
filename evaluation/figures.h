#pragma once
// Every figure of an evaluation with its 95 % interval, as one list that the table, the JSON, the
// CSV and the report's page all read. docs/evaluation.md defines them.

#include <optional>
#include <string>
#include <vector>

#include "evaluation/bootstrap.h"
#include "evaluation/summary.h"

namespace dlsd {

/// One number. A share has counted and total (value = counted / total), others a number of samples.
struct Figure {
  std::string table;    ///< "found", "found by contrast", "sAP curve", ...
  std::string stratum;  ///< Row of the table: "headline", "20-40", ...
  std::optional<double> rho_px;
  std::optional<Ratio> ratio;
  std::optional<long> samples;
  std::optional<double> value;       ///< None without samples: 0 would read as a result.
  std::optional<Interval> interval;  ///< 95 %, bootstrap over images. Not for all.
};

/// Precision (right / detections of the headline's angle) and recall (headline labels found) of the
/// detections with at least this score.
struct CurvePoint {
  double score, recall, precision;
};

/// Counts of values in [edges[i], edges[i + 1]), and of those outside.
struct Histogram {
  std::vector<double> edges;
  std::vector<long> counts;
  long below = 0, above = 0;
};

struct Figures {
  std::vector<Figure> list;
  std::vector<std::vector<CurvePoint>> precision_recall;  ///< [rho], in descending score.
  Histogram distance_px;  ///< Headline labels' samples to their detection.
  Histogram normal_deg;   ///< Headline labels' plane normals, logarithmic.

  /// The first of that table and stratum at that rho (if any is given); null if there is none.
  [[nodiscard]] const Figure* find(const std::string& table,
                                   const std::string& stratum,
                                   std::optional<double> rho_px = std::nullopt) const;
  /// All of one table at one rho, or those without rho.
  [[nodiscard]] std::vector<const Figure*> of(const std::string& table,
                                              std::optional<double> rho_px = std::nullopt) const;
};

/// The same for the same summary, to the last bit.
[[nodiscard]] Figures makeFigures(const Summary& summary);

/// "0.871 [0.850, 0.892]" with three significant decimals; "-" without a value.
[[nodiscard]] std::string valueText(const Figure& figure);

/// What the table of counts (summary.h) leaves out, ending in a newline: intervals, F, sAP, errors.
[[nodiscard]] std::string table(const Figures& figures, const EvaluationOptions& options);

/// [{"table", "stratum", "rho_px", "counted", "total", "samples", "value", "low", "high"}], each
/// key only where it has a value.
[[nodiscard]] nlohmann::ordered_json toJson(const Figures& figures);

/// The same as lines of comma-separated values below `kFiguresCsvHeader`.
inline constexpr std::string_view kFiguresCsvHeader =
    "detections,table,stratum,rho_px,counted,total,samples,value,low,high\n";
[[nodiscard]] std::string toCsv(const Figures& figures, const std::string& detections);

}  // namespace dlsd
