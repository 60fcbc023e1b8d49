#pragma once
// The experiment of the D-LSD paper (CAIP 2021, section 5) on a sequence with exact labels: its
// Table 1 and Fig. 4, and what it could not show, true recall and precision.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "cameras/rectification.h"
#include "evaluation/dataset_evaluation.h"
#include "synth/dataset/dataset.h"

namespace dlsd {

/// TUM mono's wide-angle camera, which the paper's sequence was taken with
/// (fixtures/calibrations/tum_mono_wide.yaml).
[[nodiscard]] Camera paperCamera();

/// The paper's tolerance, and a tight one beside it.
inline constexpr std::array<double, 2> kPaperRhosPx{1, 4};
/// Least lengths in percent of the field of view, the abscissa of Fig. 4.
inline constexpr std::array<double, 11> kPaperPercents{1, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50};
/// What 100 % are, degrees. The paper gives a vertical field of view of 122 degrees, but prints
/// 25 % as 61 degrees, which are 25 % of 244.
inline constexpr std::array<double, 2> kPaperFieldsDeg{244, 122};

struct ExperimentDetector {
  std::string name;
  DetectionSource source;  ///< Timed.
  bool ours = false;       ///< Works on the distorted image; its recall is asked for.
};

struct MeanAndDeviation {
  long count = 0;
  double mean = 0, deviation = 0;
};

/// Lines at least `min_angle_rad` long.
struct ExperimentRow {
  double field_deg = 0, percent = 0, min_angle_rad = 0;
  struct OfDetector {
    long lines = 0;
    std::array<Ratio, kPaperRhosPx.size()> right{};  ///< [rho] right / lines
    std::array<Ratio, kPaperRhosPx.size()> found{};  ///< [rho] labels found / labels
    std::array<Ratio, kPaperRhosPx.size()>
        found_in_view{};  ///< Those wholly in the rectified view.
    /// [detector] Lines of this one of which >= 90 % lie within 4 px of one line of that one,
    /// pooled (ratio) and as the mean over the images that have any (the reference code's way).
    std::vector<Ratio> recovered_by;
    std::vector<std::optional<double>> mean_recovered_by;
  };
  std::vector<OfDetector> detectors;
};

struct Experiment {
  size_t frames = 0;
  std::vector<std::string> detectors;
  std::vector<bool> ours;
  std::vector<MeanAndDeviation> detection_ms, rectification_ms;  ///< [detector]
  std::vector<ExperimentRow> rows;                               ///< All fields and percents.

  [[nodiscard]] const ExperimentRow& row(double field_deg, double percent) const;
};

/// Runs all detectors on every frame in turn, in one thread. True recall counts labels of contrast
/// >= 20 that no other one is nearer to than 6 px.
/// @param view  What the rectified images show, if some detector works on them.
[[nodiscard]] Experiment runPaperExperiment(const Dataset& dataset,
                                            const std::vector<ExperimentDetector>& detectors,
                                            const std::optional<VirtualView>& view,
                                            const std::function<void(size_t done)>& on_progress);

/// Table 1, Fig. 4 and the truth, as text.
[[nodiscard]] std::string table(const Experiment& experiment);

/// Writes index.html, experiment.csv and experiment.json into `folder`, which is made if absent.
void writeExperiment(const Experiment& experiment,
                     const std::string& title,
                     const std::string& folder);

}  // namespace dlsd
