#pragma once
// The report of an evaluation: one static page without anything from elsewhere, and its figures as
// CSV and JSON.

#include <string>
#include <vector>

#include "evaluation/dataset_evaluation.h"
#include "evaluation/figures.h"
#include "evaluation/summary.h"
#include "synth/dataset/dataset.h"

namespace dlsd {

/// A label that was missed or a detection that is wrong, and what is around it.
struct WorstCase {
  double rank = 0;  ///< Larger is worse.
  std::string title, note;
  Image picture;              ///< The part of the image that it is in.
  int x = 0, y = 0;           ///< Of the picture's first pixel.
  int width = 0, height = 0;  ///< Of the part, before the picture was made smaller.
  struct Curve {
    std::vector<Eigen::Vector2d> points;
    const char* style;
  };
  std::vector<Curve> curves;
};

/// Keeps the worst cases of the frames that come by: at most kCases of each kind, at most two of an
/// image. At the largest rho, missed headline labels by contrast times length, and detections of
/// the headline's angle that are neither right nor merged by score.
class WorstCases {
 public:
  static constexpr size_t kCases = 12;

  explicit WorstCases(const EvaluationOptions& options) : options_(options) {}
  /// In a fixed order of frames, for the same cases.
  void add(const FrameEvaluation& frame, const Dataset& dataset);

  [[nodiscard]] const std::vector<WorstCase>& misses() const { return misses_; }
  [[nodiscard]] const std::vector<WorstCase>& falseAlarms() const { return false_alarms_; }

 private:
  EvaluationOptions options_;
  std::vector<WorstCase> misses_, false_alarms_;
};

/// One detector on all frames.
struct EvaluatedDetections {
  std::string name;
  Summary summary;
  Figures figures;
  WorstCases worst;
};

/// {"format": "dlsd-evaluation/1", "results": [...]} (docs/evaluation.md).
[[nodiscard]] nlohmann::ordered_json evaluationJson(const std::vector<EvaluatedDetections>& all);

/// Writes index.html, figures.csv and evaluation.json into `folder`, which is made if absent. The
/// same bytes for the same evaluations. Throws SystemError if a file can't be written.
void writeEvaluationPage(const std::vector<EvaluatedDetections>& all,
                         const std::string& title,
                         const std::string& folder);

/// A page with the style of all: what stands in its <main>, below the title.
[[nodiscard]] std::string pageOf(const std::string& title, const std::string& body);

}  // namespace dlsd
