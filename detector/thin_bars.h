#pragma once
// Wires and other bars so thin that an image tells little of their width: both sides are one line,
// in their middle.

#include <vector>

#include "cameras/ray_table.h"
#include "detector/detector.h"

namespace dlsd {

class ThinBarMerger {
 public:
  explicit ThinBarMerger(const RayTable& rays) : rays_(rays) {}

  /// Two lines of opposite polarity that run at most kMaxApartPx (kMaxEvenApartPx) apart beside
  /// each other (the shorter side, in pieces or not, along at least three tenths of the longer one)
  /// become one in the middle between them, from the first to the last of the four ends. It keeps
  /// the longer one's polarity, score, residuals and covariance. from_px and to_px must be set, and
  /// are.
  void merge(std::vector<DetectedLine>* lines);

  /// The middle is within 1 px of both sides. (Where the sides are: BarProfiles.)
  static constexpr double kMaxApartPx = 2;
  /// Where both sides have the same contrast, as those of a rod or wire in front of something have.
  static constexpr double kMaxEvenApartPx = 2.5;

 private:
  struct Middle {
    Eigen::Vector3d ray;
    double px_per_rad;
    Eigen::Vector2d px;
  };
  [[nodiscard]] bool isBeside(const DetectedLine& line,
                              const Middle& middle,
                              const DetectedLine& of,
                              double* offset_px) const;
  bool mergeInto(DetectedLine* line,
                 const std::vector<DetectedLine>& lines,
                 const std::vector<size_t>& partners);

  const RayTable& rays_;
  std::vector<size_t> order_, left_, right_;
  std::vector<Middle> middles_;
  std::vector<uint8_t> gone_;
  std::vector<Eigen::Vector3d> centres_;
};

}  // namespace dlsd
