#pragma once
// Properties of the detector on one picture, or on a picture and a changed one: cases, and the
// predicates that judge them. No RapidCheck here, so that `dlsd replay` and the suites use the very
// same code. docs/properties.md says what each property means.
//
// The pictures are painted by detector/test_scene.h, which shares no code with synth, or made by no
// scene at all (test_image.h).

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "detector/detector.h"
#include "properties/checks/counterexample.h"
#include "properties/checks/test_image.h"

namespace dlsd {

enum class PictureProperty {
  kAnyPicture,    ///< Finite, consistent records, the same ones again, in time; image: `image`.
  kNoise,         ///< Few lines of 40 px; image: `image`.
  kMirrored,      ///< Mirrored left to right: the mirrored lines.
  kTransposed,    ///< Rows and columns exchanged. Ignores skew; not for panoramas.
  kTurned,        ///< The scene turned about the optical axis by `amount` rad.
  kPart,          ///< Without `left` columns and `top` rows.
  kEmptyBorder,   ///< Without the empty border but for `left` px of it.
  kGreyLevels,    ///< Grey levels times `amount`, plus `offset`, inverted if `inverted`.
  kOtherPinhole,  ///< Seen through the pinhole `other`: the same lines in pixels.
  kStraight,      ///< A pinhole's lines are the straight lines through the picture's edges.
  kOtherCamera,   ///< Seen through `other` from the same place: the same arcs.
  kEquation8,     ///< Every pixel of a line is on an edge within rho.
  kPaintedAgain,  ///< Each line, painted alone, is found.
  kCurved,        ///< A cone's outline gives no long line.
};
inline constexpr int kPicturePropertyCount = 14;
[[nodiscard]] std::string_view nameOf(PictureProperty property);
[[nodiscard]] std::optional<PictureProperty> picturePropertyFromName(std::string_view name);

/// Whether the property is of a picture that no scene made.
[[nodiscard]] bool takesImage(PictureProperty property);

/// Everything that is needed to judge a property again. What a property does not read stays at its
/// default.
struct PictureCase {
  PictureProperty property = PictureProperty::kAnyPicture;
  Camera camera;
  std::optional<Camera> other = std::nullopt;
  uint64_t seed = 0;     ///< Of the painted scene.
  unsigned shapes = 15;  ///< Bit i: whether its shape i is painted, of four.
  TestImageSpec image = {};
  int left = 0, top = 0;
  double amount = 1, offset = 0;
  bool inverted = false;
  std::string detector = "dlsd";  ///< One of builtinDetectors().
};

[[nodiscard]] nlohmann::ordered_json toJson(const PictureCase& picture_case);
/// Throws InputError with source, key and value for anything missing, unknown or out of range.
[[nodiscard]] PictureCase pictureCaseFromJson(const nlohmann::json& json,
                                              const std::string& source);

/// What came of a case.
struct PictureOutcome {
  /// False: the case says nothing about the property (e.g. a cone that does not stand out).
  bool applies = true;
  std::string failure;  ///< Empty: the property holds. Else one line: what, where, by how much.
  /// Of what the property speaks: isolated lines, pixels of lines (kEquation8), or all lines
  /// (kAnyPicture, kNoise, kCurved, kEmptyBorder).
  long counted = 0;
  /// Of these, lines whose places are not compared: without a measured edge (kStraight), or not
  /// isolated (kEmptyBorder, which compares their number all the same).
  long uncompared = 0;
  double seconds_share = 0;  ///< kAnyPicture, kNoise: processor time over what is allowed.
  long long_lines = 0;       ///< kNoise: of 40 px or more.
  /// Of each isolated line that was compared; ends of the properties that compare them.
  std::vector<double> across_px, ends_px;
  /// kOtherCamera: angle over the allowed one; kEquation8: share of a line without an edge;
  /// kCurved: length over what is straight within the detector's tight bound.
  std::vector<double> shares;
  std::vector<ShownPicture> shown;
};

/// The goal for the ends is 2 px for every line. Nearly all reach it; but whether two edges are
/// taken to meet in a corner is decided by how near they come to it, up to 12 px, and where that is
/// a near thing, one picture has the corner and the other hasn't (and ends four rows before).
inline constexpr double kAcrossPx = 0.1, kEndsPx = 2, kMostEndsPx = 16;
/// A line of noise counts from this length; a picture of noise has no more of them than this. (On
/// average it is 1 at most, which is for many pictures to show.)
inline constexpr double kLongLinePx = 40;
inline constexpr long kMostNoiseLines = 8;

/// What is wrong with the records of the lines that were found in a picture, if anything: values
/// that are not finite, or that do not fit each other, the camera or the options.
[[nodiscard]] std::optional<std::string> defectOf(const Camera& camera,
                                                  const DetectorOptions& options,
                                                  const std::vector<DetectedLine>& lines);

/// Makes the case's pictures, runs the detector on them and judges. `with_shown`: fills in `shown`.
[[nodiscard]] PictureOutcome checkPicture(const PictureCase& picture_case, bool with_shown = false);

}  // namespace dlsd
