#pragma once
// Small pictures for pages.

#include <string>
#include <string_view>

#include "synth/dataset/image.h"

namespace dlsd {

/// Made smaller by a whole factor, so that it is at most max_width wide: means of blocks, 8 bits.
/// The image itself if it is no wider.
[[nodiscard]] Image shrunk(const Image& image, int max_width);

/// The pixels [x, x + width) x [y, y + height), which must lie in the image.
[[nodiscard]] Image cropped(const Image& image, int x, int y, int width, int height);

/// As in data: URLs (RFC 4648, with padding).
[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace dlsd
