#pragma once
// Between images, the detector and detection records.

#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "detector/detector.h"
#include "detector/image_view.h"
#include "detector/options.h"
#include "synth/dataset/image.h"
#include "synth/dataset/records.h"

namespace dlsd {

/// Names of the built-in detectors: "dlsd" (the default options) and "dlsd-paper".
[[nodiscard]] const std::vector<std::string>& builtinDetectors();

/// Throws InputError listing the names if there is no such detector.
[[nodiscard]] DetectorOptions builtinOptions(const std::string& name);

/// The image as the detector takes it; valid as long as the image.
[[nodiscard]] ImageView viewOf(const Image& image);

/// A detected line as a record, every field set. The curve keeps within 0.01 px of the arc's image.
[[nodiscard]] DetectionLine toDetectionLine(const Camera& camera, const DetectedLine& line);

/// Runs the detector; lines in its order, i.e. in descending score.
/// Throws std::invalid_argument if the image's size is not the camera's.
[[nodiscard]] std::vector<DetectionLine> detectLines(Detector& detector, const Image& image);

/// The records of a detections file in the order of `images` (paths relative to `folder`). A record
/// belongs to the image whose relative path it gives, or that its path (taken from here) points to,
/// else to the only image with the same stem. Throws InputError naming `source` (the file) and the
/// image if a record belongs to no image or to several, an image has no record or two.
[[nodiscard]] std::vector<DetectionRecord> matchToImages(std::vector<DetectionRecord> records,
                                                         const std::vector<std::string>& images,
                                                         const std::string& folder,
                                                         const std::string& source);

}  // namespace dlsd
