#pragma once
// DetectorOptions::Method::kConvexPolygons: the paper's algorithm.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "cameras/ray_table.h"
#include "detector/detector.h"
#include "detector/edge_drawing.h"
#include "detector/gradient.h"
#include "detector/options.h"
#include "detector/polygonal_chain.h"
#include "detector/usable_mask.h"

namespace dlsd {

class PaperDetector {
 public:
  PaperDetector(const RayTable& rays, const DetectorOptions& options);

  /// Appends lines, whose from_px and to_px are left to the caller, and adds to the times of the
  /// stages. Edges are only looked for where `usable` is set.
  void detect(const ImageView& image,
              const BitRows& usable,
              std::vector<DetectedLine>* lines,
              StageTimes* times);

 private:
  void addPolygon(std::span<const Eigen::Vector2d> pixels,
                  std::span<const StraightPiece> group,
                  std::vector<DetectedLine>* lines,
                  StageTimes* times);

  const RayTable& rays_;
  const Camera& camera_;
  DetectorOptions options_;
  GradientFilter filter_;
  EdgeDrawer drawer_;
  GradientField field_;
  EdgeChains chains_;
  std::vector<Eigen::Vector2d> points_;
  std::vector<StraightPiece> straight_;
  std::vector<ConvexGroup> groups_;
  std::vector<Eigen::Vector3d> group_rays_;
};

}  // namespace dlsd
