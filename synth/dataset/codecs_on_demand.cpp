#include "synth/dataset/codecs.h"
#include "synth/dataset/module.h"

namespace dlsd {

const ImageCodecs& imageCodecs() {
  static const auto& codecs =
      *static_cast<const ImageCodecs*>(moduleTable("codecs", "dlsd_image_codecs"));
  return codecs;
}

}  // namespace dlsd
