#pragma once
// Detections against exact labels: found, right, merged, fragments, localisation error.
// docs/evaluation.md defines every figure.

#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/records.h"

namespace dlsd {

/// Curves are sampled at the middles of equal pieces of at most this length.
inline constexpr double kSampleStepPx = 0.5;
/// Left out at each end of a label when it is looked for; a quarter of its length if that is less.
inline constexpr double kLabelTrimPx = 3;
/// A detection may bridge this much without label evidence before it is a merge.
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
  void check() const;     ///< Throws std::invalid_argument naming field, value, range.
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

/// Which row a label belongs to: exactly one. In this order: faint if its mean contrast is below
/// headline_contrast, else short if it is below headline_angle_rad or headline_length_px, else
/// crowded if another label comes nearer than crowded_px anywhere (shared ends apart), else
/// headline.
enum class Stratum { kHeadline, kCrowded, kShort, kFaint };
inline constexpr size_t kStratumCount = 4;
[[nodiscard]] std::string_view toString(Stratum stratum);

/// What happened to one label at one rho.
struct LabelOutcome {
  bool found = false;
  int detection = -1;   ///< The detection that covers most of it, or -1.
  double coverage = 0;  ///< Share of its (trimmed) arc length within rho of that detection.
  int fragments = 0;    ///< Detections with >= 50 % of their length on it.
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
  std::vector<Stratum> strata;                            ///< One per label.
  std::vector<std::vector<LabelOutcome>> labels;          ///< [rho][label]
  std::vector<std::vector<DetectionOutcome>> detections;  ///< [rho][detection]
  std::vector<double> detection_angle_rad;  ///< [detection], angle between its end rays
  /// [stratum] At the largest rho: distances of the found labels' (trimmed) samples to the
  /// detection that found them, samples farther than rho left out.
  std::array<DistanceStats, kStratumCount> localisation;
};

/// Matches one frame. Deterministic: the same figures, to the last bit, in whatever order labels
/// and detections come and in whichever direction their curves run (`detection` is the lowest index
/// among equals). Time grows with the length of the curves, not with labels times detections.
/// Throws std::invalid_argument if a curve has fewer than two points or no length, has a point that
/// is not finite or more than an image size outside the image.
[[nodiscard]] FrameOutcome evaluateFrame(const Camera& camera,
                                         const std::vector<LabelLine>& labels,
                                         const std::vector<DetectionLine>& detections,
                                         const EvaluationOptions& options);

}  // namespace dlsd
