#pragma once
// Structural average precision: sAP of L-CNN for chords and of ULSD for curves, as their evaluation
// programs define it. It compares at 128 x 128 and asks for a few points only: read it beside found
// and right, which look at the whole curve at full resolution.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dlsd {

/// Points that stand for a curve: at equal arc length, ends included.
inline constexpr size_t kStructuralPoints = 7;
/// Images are scaled to this in both directions, whatever their shape.
inline constexpr double kStructuralSizePx = 128;
/// Thresholds on the squared distance at that size.
inline constexpr std::array<double, 3> kStructuralThresholds{5, 10, 15};

/// Scaled to 128 x 128.
using StructuralCurve = std::array<Eigen::Vector2d, kStructuralPoints>;

/// Of a polyline of two or more points and some length, in an image of width x height.
[[nodiscard]] StructuralCurve structuralCurve(const std::vector<Eigen::Vector2d>& polyline,
                                              int width,
                                              int height);

/// Of a curve that is given as ULSD's predictions are (interpolatingBezier): at equally spaced
/// parameters.
[[nodiscard]] StructuralCurve structuralCurveOfBezier(std::span<const Eigen::Vector2d> points,
                                                      int width,
                                                      int height);

/// The Bezier curve that passes through 2 to 8 points at equally spaced parameters, at parameter t
/// in [0, 1].
[[nodiscard]] Eigen::Vector2d interpolatingBezier(std::span<const Eigen::Vector2d> points,
                                                  double t);

/// Mean of the squared distances of corresponding points, times two, in the direction in which it
/// is less (ULSD). `chord`: of the two end points alone, so the sum of two squares (L-CNN).
[[nodiscard]] double structuralDistance(const StructuralCurve& a,
                                        const StructuralCurve& b,
                                        bool chord);

/// What a detection counts as at one threshold.
enum class StructuralMatch : uint8_t { kFalse, kTrue, kIgnored };

struct StructuralDetection {
  double score = 0;
  std::array<StructuralMatch, kStructuralThresholds.size()> matches{};  ///< [threshold]
};

/// One image.
struct StructuralOutcome {
  std::vector<StructuralDetection> detections;  ///< In descending score, else as they came.
  long labels = 0;                              ///< Those that count.
};

/// In descending score, a detection belongs to the nearest label; it is true if the distance is
/// below the threshold and no earlier detection took that label. `counts[i]`: whether label i
/// counts; a detection below the threshold of one that does not is ignored.
[[nodiscard]] StructuralOutcome matchStructure(const std::vector<StructuralCurve>& labels,
                                               const std::vector<bool>& counts,
                                               const std::vector<StructuralCurve>& detections,
                                               const std::vector<double>& scores,
                                               bool chord);

/// The detections of many images, in descending score; those of one score come in together.
class StructuralAp {
 public:
  explicit StructuralAp(std::span<const StructuralOutcome> images);

  /// Area under the monotone envelope of precision over recall, in [0, 1]; 0 without labels.
  /// @param threshold  Index into kStructuralThresholds.
  /// @param weights  How often each image counts; empty: each once.
  [[nodiscard]] double averagePrecision(size_t threshold,
                                        std::span<const uint8_t> weights = {}) const;

 private:
  struct Entry {
    double score;
    size_t image;
    std::array<StructuralMatch, kStructuralThresholds.size()> matches;
  };
  std::vector<Entry> entries_;
  std::vector<long> labels_;  ///< [image]
};

}  // namespace dlsd
