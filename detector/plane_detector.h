#pragma once
// DetectorOptions::Method::kPlanarPieces: chains of crests are split where the plane stops fitting,
// and each piece is traced along its plane's image.

#include <vector>

#include "cameras/ray_table.h"
#include "detector/detector.h"
#include "detector/edge_linking.h"
#include "detector/edge_map.h"
#include "detector/line_tracer.h"
#include "detector/options.h"
#include "detector/planar_chain.h"
#include "detector/usable_mask.h"

namespace dlsd {

class PlaneDetector {
 public:
  PlaneDetector(const RayTable& rays, const DetectorOptions& options);

  /// Appends lines, whose from_px and to_px are left to the caller, and adds to the times of the
  /// stages. Edges are only looked for where `usable` is set; where `seen` is not, the camera ends.
  void detect(const ImageView& image,
              const BitRows& usable,
              const BitRows& seen,
              std::vector<DetectedLine>* lines,
              StageTimes* times);

 private:
  void loadPixels(const ImageView& image);
  void traceAll(std::vector<DetectedLine>* lines);
  void trace(const PlanarPiece& piece, std::vector<DetectedLine>* lines);
  void keepRest(const PlanarPiece& piece);
  [[nodiscard]] bool isClaimed(const PlanarPiece& piece) const;
  [[nodiscard]] size_t claimedQuads() const;
  bool removePartsOf(const Arc& whole, std::vector<DetectedLine>* lines) const;
  void claim();

  const RayTable& rays_;
  DetectorOptions options_;
  EdgeMapper mapper_;
  EdgeLinker linker_;
  PlanarSplitter splitter_;
  LineTracer tracer_;

  GreyPixels pixels_;
  std::vector<uint16_t> fixed_;  // pixels of other types than 8-bit grey
  EdgeMap map_;
  CrestChains chains_;
  std::vector<PlanarPiece> pieces_, rest_;
  std::vector<uint32_t> order_;
  BitRows claimed_;
};

}  // namespace dlsd
