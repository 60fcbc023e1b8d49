#pragma once
// Detections against exact labels: found, right, merged, fragments, errors.
// docs/evaluation.md defines every figure.

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "evaluation/normal_bound.h"
#include "synth/dataset/records.h"

namespace dlsd {

/// Curves are sampled at the middles of equal pieces of at most this length.
inline constexpr double kSampleStepPx = 0.5;
/// Left out at each end of a label when it is looked for; a quarter of its length if that is less.
inline constexpr double kLabelTrimPx = 3;
/// A detection may bridge this much without label evidence before it is a merge, and labels of one
/// carrier that are nearer than this to each other are one run.
inline constexpr double kMaxBridgePx = 5;
/// Label ends nearer than this to each other are one shared end point.
inline constexpr double kSharedEndPx = 0.5;
/// Around a shared end point, the labels that meet there do not crowd each other.
inline constexpr double kSharedEndRadiusPx = 15;

/// Tolerances in one evaluation at most; the report's page keeps a bit for each.
inline constexpr size_t kMaxTolerances = 8;

struct EvaluationOptions {
  /// Tolerances, ascending, each in (0, 100]; 1 to kMaxTolerances of them.
  std::vector<double> rho_px{1, 2, 4};
  double headline_contrast = 20;  ///< 8-bit grey levels.
  double headline_angle_rad = 5 * M_PI / 180;
  double headline_length_px = 40;
  double crowded_px = 6;  ///< Labels nearer than this to another one are "crowded".
  /// A detection's points are joined by the Bezier curve through them (interpolatingBezier), not by
  /// straight pieces. Read by evaluateFrames.
  bool bezier = false;
  void check() const;  ///< Throws std::invalid_argument naming field, value, range.
};

/// counted / total, always reported as both.
struct Ratio {
  long counted = 0, total = 0;
  Ratio& operator+=(const Ratio& other) {
    counted += other.counted;
    total += other.total;
    return *this;
  }
  bool operator==(const Ratio&) const = default;
};

/// What makes a label hard to find.
struct LabelConditions {
  bool faint = false;     ///< Its mean contrast is below headline_contrast.
  bool is_short = false;  ///< It is below headline_angle_rad or headline_length_px.
  bool crowded = false;   ///< Another label comes nearer than crowded_px (shared ends apart).
};

/// Which row a label belongs to: exactly one, the first that fits of faint, short, crowded; else
/// headline.
enum class Stratum { kHeadline, kCrowded, kShort, kFaint };
inline constexpr size_t kStratumCount = 4;
[[nodiscard]] std::string_view toString(Stratum stratum);
[[nodiscard]] Stratum stratumOf(const LabelConditions& conditions);

/// What happened to one label at one rho.
struct LabelOutcome {
  bool found = false;
  int detection = -1;      ///< The detection that covers most of it, or -1.
  double coverage = 0;     ///< Share of its (trimmed) arc length within rho of that detection.
  double found_score = 0;  ///< If found: the largest score of the detections that find it.
};

/// What happened to one run (labels of one carrier without gaps of more than kMaxBridgePx: what an
/// image shows as one line) at one rho.
struct RunOutcome {
  bool found = false;  ///< One of its labels is.
  /// Detections that have >= 50 % of their length on it or find one of its labels: at least 1 if it
  /// is found.
  int fragments = 0;
};

/// An end of a found label against that end of its detection.
struct EndError {
  double along_px = 0;   ///< Positive: the detection goes on beyond the label's end.
  double across_px = 0;  ///< Distance between the two curves there.
};

/// A label found at the largest rho against the detection that found it (the one that covers most).
struct LabelErrors {
  /// Over the label's (trimmed) samples within rho of the detection: distance to it.
  long samples = 0;
  double sum_px = 0, sum2_px2 = 0;
  /// The same in angles: between the ray of the detection's nearest point and the label's plane.
  /// Samples whose nearest point has no ray are left out.
  long angle_samples = 0;
  double sum_rad = 0, sum2_rad2 = 0;
  /// First and last point of the label's curve. None where its run goes on.
  std::array<std::optional<EndError>, 2> ends;
  /// Angle between the planes; none if the detection's points have no plane.
  std::optional<double> normal_rad;
  /// Headline labels only: that error in terms of what noise explains, where this is known.
  std::optional<NormalErrorInSigmas> normal_sigmas;
};

/// What happened to one detection at one rho.
struct DetectionOutcome {
  bool right = false;
  /// In position along one carrier, bridges counted as such, and bridges > 5 px without label
  /// evidence. Also right, unless the bridges are more than a tenth of it.
  bool merged = false;
  double coverage = 0;  ///< Share of its length within rho of the best carrier's labels.
  int carrier = -1;     ///< That carrier, or -1 if it is near none.
};

/// Distances of samples, for mean, RMS and quantiles; can be added up.
struct DistanceStats {
  static constexpr double kBinPx = 0.002;
  double sum_px = 0, sum2_px2 = 0;
  long count = 0;
  std::vector<long> bins;  ///< bins[i]: distances in [i, i + 1) kBinPx; as long as needed.

  void add(double distance_px);
  DistanceStats& operator+=(const DistanceStats& other);
  [[nodiscard]] double mean() const { return count > 0 ? sum_px / double(count) : 0; }
  [[nodiscard]] double rms() const { return count > 0 ? std::sqrt(sum2_px2 / double(count)) : 0; }
  /// Quantile q in [0, 1], interpolated inside its bin: exact to kBinPx. 0 without samples.
  [[nodiscard]] double quantile(double q) const;
};

struct FrameOutcome {
  std::vector<LabelConditions> conditions;                ///< One per label.
  std::vector<Stratum> strata;                            ///< One per label.
  std::vector<std::vector<LabelOutcome>> labels;          ///< [rho][label]
  std::vector<std::optional<LabelErrors>> errors;         ///< [label], if found at the largest rho.
  std::vector<int> run_of;                                ///< [label] index of its run.
  std::vector<Stratum> run_strata;                        ///< [run], that of its longest label.
  std::vector<std::vector<RunOutcome>> runs;              ///< [rho][run]
  std::vector<std::vector<DetectionOutcome>> detections;  ///< [rho][detection]
  std::vector<double> detection_angle_rad;  ///< [detection], angle between its end rays
  std::vector<double> detection_length_px;  ///< [detection]
  /// [detection] its score, or without one its length in px, so that longer ones count as surer.
  std::vector<double> detection_score;
  /// [detection] angle of the ray of its middle point to +z, if that has one.
  std::vector<std::optional<double>> detection_field_angle_rad;
  /// [stratum] At the largest rho: distances of the found labels' (trimmed) samples to the
  /// detection that found them, samples farther than rho left out.
  std::array<DistanceStats, kStratumCount> localisation;
};

/// Matches one frame. Deterministic: the same figures, to the last bit, in whatever order labels
/// and detections come and in whichever direction their curves run (`detection` is the lowest index
/// among equals). Time grows with the length of the curves, not with labels times detections.
/// Throws std::invalid_argument if a curve has fewer than two points or no length, has a point that
/// is not finite or more than an image size outside the image.
/// @param noise  Of the image, if known: then errors of plane normals are said in sigmas, too.
[[nodiscard]] FrameOutcome evaluateFrame(const Camera& camera,
                                         const std::vector<LabelLine>& labels,
                                         const std::vector<DetectionLine>& detections,
                                         const EvaluationOptions& options,
                                         const std::optional<ImageNoise>& noise = std::nullopt);

/// Which of `lines` lie within rho of one of `detections` over at least `share` of their length,
/// ends included: the paper's correspondence of two detectors' lines. Throws as evaluateFrame.
[[nodiscard]] std::vector<bool> coveredByOne(const Camera& camera,
                                             const std::vector<DetectionLine>& lines,
                                             const std::vector<DetectionLine>& detections,
                                             double rho_px,
                                             double share);

}  // namespace dlsd
