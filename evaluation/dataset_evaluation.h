#pragma once
// Detections of a whole dataset against its labels.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/evaluate.h"
#include "evaluation/structural_ap.h"
#include "synth/dataset/dataset.h"

namespace dlsd {

/// The lines of one frame, and how long they took if that was measured.
struct Detections {
  std::vector<DetectionLine> lines;
  std::optional<double> time_ms;           ///< Of detection alone.
  std::optional<double> rectification_ms;  ///< Of rectification, where the detector needs it.
  std::string source{};                    ///< For complaints: the file, the program. May be empty.
};

/// The detections of frame i of a dataset.
using FrameDetections = std::function<Detections(size_t, const LabelRecord&)>;

/// Makes the above, one for each thread.
using DetectionSource = std::function<FrameDetections()>;

/// Detections of a record. Throws InputError if it gives another image size than the labels.
[[nodiscard]] Detections detectionsOf(const DetectionRecord& record,
                                      const LabelRecord& labels,
                                      const std::string& source);

/// A detections file (JSON Lines), matched to the dataset's images. Throws InputError as
/// readDetections and matchToImages do; when a frame is read also if its record gives another image
/// size.
[[nodiscard]] DetectionSource detectionsOfFile(const Dataset& dataset, const std::string& path);

/// A built-in detector run on the images, each with its own camera. Throws InputError for an
/// unknown name.
/// @param timed  Measure times, which makes no two runs the same.
[[nodiscard]] DetectionSource detectionsOfDetector(const Dataset& dataset,
                                                   const std::string& name,
                                                   bool timed = false);

/// Which sAP: of curves or of chords, over all labels or over the clear ones (neither faint nor
/// short).
enum StructuralKind : size_t { kCurveAll, kCurveClear, kChordAll, kChordClear, kStructuralKinds };

/// What a frame shows.
struct FrameEvaluation {
  LabelRecord labels;
  Detections detections;
  FrameOutcome outcome;
  std::array<StructuralOutcome, kStructuralKinds> structure;  ///< [StructuralKind]
};

/// Fills the outcome and the structure from the labels and the detections, whose points become
/// those of their curves. Throws std::invalid_argument as evaluateFrame does, and with
/// options.bezier for lines of fewer than 2 or more than 8 points.
void evaluate(const Camera& camera, const EvaluationOptions& options, FrameEvaluation* frame);

/// "wide" of "cameras/wide.yaml".
[[nodiscard]] std::string cameraName(const LabelRecord& labels);

/// Evaluates frames in `jobs` threads (0: one per core) and hands them over in the order of the
/// dataset, one at a time, from the calling thread or another: the same calls whatever the number
/// of threads. Errors are thrown as InputError naming the detections' source and the image; that
/// of the first frame that has one.
void evaluateFrames(const Dataset& dataset,
                    const DetectionSource& source,
                    const EvaluationOptions& options,
                    int jobs,
                    const std::function<void(FrameEvaluation&&)>& take);

}  // namespace dlsd
