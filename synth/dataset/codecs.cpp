#include "synth/dataset/codecs.h"

namespace dlsd {

const ImageCodecs& imageCodecs() {
  return dlsd_image_codecs;
}

}  // namespace dlsd
