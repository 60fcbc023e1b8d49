#pragma once
#include <vector>

#include "synth/dataset/image.h"
#include "synth/dataset/records.h"

namespace dlsd::cli {

/// The image in 8-bit colour with the curves drawn on it, anti-aliased, colours going round.
[[nodiscard]] Image drawOverlay(const Image& image, const std::vector<DetectionLine>& lines);

}  // namespace dlsd::cli
