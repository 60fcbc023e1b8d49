#include "properties/checks/picture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <stdexcept>

#include "cameras/calibration/files.h"
#include "detector/detector.h"
#include "detector/options.h"
#include "detector/test_scene.h"
#include "evaluation/detections.h"
#include "properties/checks/case.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Scene;

constexpr std::array<std::string_view, kPicturePropertyCount> kNames{"any-picture",
                                                                     "noise",
                                                                     "mirrored",
                                                                     "transposed",
                                                                     "turned",
                                                                     "part",
                                                                     "empty-border",
                                                                     "grey-levels",
                                                                     "other-pinhole",
                                                                     "straight",
                                                                     "other-camera",
                                                                     "equation-8",
                                                                     "painted-again",
                                                                     "curved"};

// --- Pictures and what is found in them ---

/// A line and its image.
struct Seen {
  DetectedLine line;
  std::vector<Vector2d> curve;
};

/// All lines, or none and a failure of the case if one of them is no sound record: what is measured
/// on lines may take for granted that they are.
std::vector<Seen> detectIn(const Camera& camera,
                           const std::vector<float>& grey,
                           const DetectorOptions& options,
                           PictureOutcome* outcome) {
  Detector detector(camera, options);
  const ImageView view{grey.data(),
                       camera.width(),
                       camera.height(),
                       1,
                       static_cast<ptrdiff_t>(sizeof(float)) * camera.width(),
                       PixelType::kF32,
                       false};
  const std::vector<DetectedLine> lines = detector.detect(view);
  if (const auto defect = defectOf(camera, options, lines)) {
    if (outcome->failure.empty()) outcome->failure = *defect;
    return {};
  }
  std::vector<Seen> result;
  for (const DetectedLine& line : lines) {
    result.push_back({line, imageCurve(camera, line.arc, 0, 1, 0.02)});
  }
  return result;
}

/// The larger one; what is no number is larger than all.
double worse(double worst, double value) {
  return value <= worst      ? worst
         : std::isnan(value) ? std::numeric_limits<double>::infinity()
                             : value;
}

float bilinear(const std::vector<float>& grey, int width, int height, const Vector2d& p) {
  const int x = std::clamp(static_cast<int>(std::floor(p.x())), 0, width - 2);
  const int y = std::clamp(static_cast<int>(std::floor(p.y())), 0, height - 2);
  const auto fx = static_cast<float>(p.x() - x), fy = static_cast<float>(p.y() - y);
  const float* row =
      grey.data() + static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  return (1 - fy) * ((1 - fx) * row[0] + fx * row[1]) +
         fy * ((1 - fx) * row[width] + fx * row[width + 1]);
}

/// Least contrast of the picture across a line, 3 px to each side, its ends left out.
double contrastAlong(const std::vector<float>& grey, const Camera& camera, const Arc& arc) {
  double least = std::numeric_limits<double>::infinity();
  for (const double t : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const auto p = camera.project(arc.at(t)), q = camera.project(arc.at(t + 0.01));
    if (!p || !q) return 0;
    const Vector2d along = (*q - *p).normalized(), across(-along.y(), along.x());
    least = std::min(least,
                     static_cast<double>(std::abs(
                         bilinear(grey, camera.width(), camera.height(), *p + 3 * across) -
                         bilinear(grey, camera.width(), camera.height(), *p - 3 * across))));
  }
  return least;
}

/// Whether the picture shows an edge 12 px beyond one of the line's ends, too, such as a fainter
/// one: then it is chance where the line ends.
bool goesOn(const std::vector<float>& grey, const Camera& camera, const DetectedLine& line) {
  constexpr double kBesidePx = 2, kLevels = 4;
  const auto isInside = [&](double t) {
    const auto p = camera.project(line.arc.at(t));
    return p && camera.inImage(*p);
  };
  for (const bool at_from : {true, false}) {
    // Or nearer, if that is beyond the border.
    const auto shareAt = [&](double px) {
      return at_from ? -px / line.length_px : 1 + px / line.length_px;
    };
    const double t = isInside(shareAt(12)) ? shareAt(12) : shareAt(6);
    const auto p = camera.project(line.arc.at(t)), q = camera.project(line.arc.at(t + 0.01));
    if (!p || !q || !camera.inImage(*p)) continue;
    const Vector2d along = (*q - *p).normalized();
    const Vector2d beside = kBesidePx * Vector2d(-along.y(), along.x());
    const int w = camera.width(), h = camera.height();
    if (std::abs(static_cast<double>(bilinear(grey, w, h, *p + beside) -
                                     bilinear(grey, w, h, *p - beside))) >= kLevels) {
      return true;
    }
  }
  return false;
}

/// Whether a pixel is so far from the image's border and rim.
bool isClear(const Camera& camera, const Vector2d& px, double distance_px) {
  for (int k = 0; k < 8; ++k) {
    const double angle_rad = k * M_PI / 4;
    const Vector2d q = px + distance_px * Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    if (!camera.inImage(q) || !camera.unproject(q)) return false;
  }
  return true;
}

/// Whether it is even on both sides of a line, 3 to 9 px from it, `corner_px` at its ends left out.
bool isEvenBeside(const std::vector<float>& grey,
                  const Camera& camera,
                  const DetectedLine& line,
                  double corner_px) {
  constexpr float kLevels = 8;
  const double from = corner_px / line.length_px;
  const int count = static_cast<int>(line.length_px / 4);
  for (int i = 0; i <= count; ++i) {
    const double t = from + (1 - 2 * from) * i / count;
    const auto p = camera.project(line.arc.at(t)), q = camera.project(line.arc.at(t + 0.01));
    if (!p || !q) return false;
    const Vector2d along = (*q - *p).normalized(), across(-along.y(), along.x());
    for (const double side : {-1.0, 1.0}) {
      float least = 255, most = 0;
      for (const double distance : {3.0, 5.0, 7.0, 9.0}) {
        const float value =
            bilinear(grey, camera.width(), camera.height(), *p + side * distance * across);
        least = std::min(least, value);
        most = std::max(most, value);
      }
      if (!(most - least <= kLevels)) return false;
    }
  }
  return true;
}

/// Whether nothing disturbs a line: 60 px long, of 25 grey levels, 10 px from all other lines and
/// from border and rim, what is within 15 px of its own ends left out, where there may be one other
/// line (of a corner, or of what hides the rest); with two it is chance which of them ends it. And
/// the picture itself is even on both sides, should the detector have missed another edge.
bool isIsolated(const Seen& seen,
                const std::vector<Seen>& all,
                const Camera& camera,
                const std::vector<float>& grey) {
  if (!(seen.line.length_px >= 60) || seen.curve.size() < 2) return false;
  constexpr double kClear = 10, kCorner = 15;
  const auto atEnd = [&](const Vector2d& p) {
    return std::min((p - seen.line.from_px).norm(), (p - seen.line.to_px).norm()) < kCorner;
  };
  std::vector<Vector2d> samples;
  const int count = static_cast<int>(seen.line.length_px / 4);
  for (int i = 0; i <= count; ++i) {
    if (const auto p = camera.project(seen.line.arc.at(static_cast<double>(i) / count))) {
      samples.push_back(*p);
    }
  }
  for (const Vector2d& p : samples) {
    if (!isClear(camera, p, kClear)) return false;
  }
  int at_from = 0, at_to = 0;
  for (const Seen& other : all) {
    if (&other == &seen || other.curve.size() < 2) continue;
    for (const Vector2d& p : samples) {
      if (!atEnd(p) && !(test::distanceToPolyline(p, other.curve) >= kClear)) return false;
    }
    at_from += test::distanceToPolyline(seen.line.from_px, other.curve) < kCorner ? 1 : 0;
    at_to += test::distanceToPolyline(seen.line.to_px, other.curve) < kCorner ? 1 : 0;
  }
  if (std::max(at_from, at_to) > 1) return false;
  return !goesOn(grey, camera, seen.line) && contrastAlong(grey, camera, seen.line.arc) >= 25 &&
         isEvenBeside(grey, camera, seen.line, kCorner);
}

/// How a picture was changed: where its pixels went.
using PixelMap = std::function<Vector2d(const Vector2d&)>;

struct Match {
  double across_px, ends_px;
  const Seen* line;
};

/// The line of the changed picture that is nearest to a line of the first, by the distance of 21
/// points of that one across; of those nearer than `same_px` (an edge may go on behind what hides
/// it) the one whose ends are nearest.
Match nearest(const Seen& seen,
              const Camera& camera,
              const PixelMap& forward,
              const std::vector<Seen>& changed,
              const Camera& changed_camera,
              double same_px) {
  Match best{std::numeric_limits<double>::infinity(), 0, nullptr};
  for (const Seen& candidate : changed) {
    double across = 0;
    for (int i = 0; i <= 20; ++i) {
      const auto p = camera.project(seen.line.arc.at(i / 20.0));
      const auto ray = p ? changed_camera.unproject(forward(*p)) : std::nullopt;
      const auto J = ray ? changed_camera.jacobian(*ray) : std::nullopt;
      if (!J) {
        across = std::numeric_limits<double>::infinity();
        break;
      }
      // Px per rad across the line: that of the direction of the normal.
      const Vector3d& n = candidate.line.arc.normal;
      const Vector3d tangent = n.cross(*ray).normalized(), side = ray->cross(tangent);
      const Vector2d along_px = (*J * tangent).normalized(), side_px = *J * side;
      const double scale = std::abs(side_px.x() * along_px.y() - side_px.y() * along_px.x());
      across = worse(across, std::abs(candidate.line.arc.angleToPlane(*ray)) * scale);
    }
    if (!(across < std::max(best.across_px, same_px))) continue;
    const Vector2d a = forward(seen.line.from_px), b = forward(seen.line.to_px);
    const Vector2d &c = candidate.line.from_px, &d = candidate.line.to_px;
    const double ends = std::min(std::max((a - c).norm(), (b - d).norm()),
                                 std::max((a - d).norm(), (b - c).norm()));
    const bool both_same = across <= same_px && best.across_px <= same_px;
    if (both_same ? ends < best.ends_px : across < best.across_px) {
      best = {across, ends, &candidate};
    }
  }
  return best;
}

/// The case's scene; its directions are within `angle_rad` of +z.
Scene sceneOf(const PictureCase& c, double angle_rad) {
  const bool round = c.property == PictureProperty::kCurved;
  Scene scene = test::randomScene(c.seed, round ? 0 : 4, round ? 1 : 0, std::min(angle_rad, 1.75));
  std::vector<test::Shape> kept;
  for (size_t i = 0; i < scene.shapes.size(); ++i) {
    if (round || (c.shapes >> i & 1U) != 0) kept.push_back(scene.shapes[i]);
  }
  scene.shapes = std::move(kept);
  return scene;
}

uint8_t shownLevel(double grey) {
  return std::isfinite(grey) ? static_cast<uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0))) : 0;
}

ShownPicture shownOf(const Camera& camera, const std::vector<float>& grey) {
  ShownPicture shown;
  shown.image.width = camera.width();
  shown.image.height = camera.height();
  shown.image.bytes.resize(grey.size());
  std::transform(grey.begin(), grey.end(), shown.image.bytes.begin(), [](float value) {
    return shownLevel(static_cast<double>(value));
  });
  return shown;
}

/// One picture and the lines found there.
struct View {
  const Camera camera;
  const std::vector<float> grey;
  const std::vector<Seen> lines;

  View(const Camera& its_camera,
       std::vector<float> its_grey,
       const DetectorOptions& options,
       PictureOutcome* outcome)
      : camera(its_camera),
        grey(std::move(its_grey)),
        lines(detectIn(camera, grey, options, outcome)) {}
  [[nodiscard]] bool isIsolated(const Seen& seen) const {
    return dlsd::isIsolated(seen, lines, camera, grey);
  }
  [[nodiscard]] ShownPicture shown() const {
    ShownPicture picture = shownOf(camera, grey);
    for (const Seen& seen : lines) picture.lines.push_back(seen.curve);
    return picture;
  }
};

std::string placeOf(const Seen& seen) {
  return fmt::format("line from ({:.2f}, {:.2f}) to ({:.2f}, {:.2f})",
                     seen.line.from_px.x(),
                     seen.line.from_px.y(),
                     seen.line.to_px.x(),
                     seen.line.to_px.y());
}

/// Notes a failure of the property at this line, the first one as the case's.
void failAt(const Seen& seen,
            const std::string& what,
            ShownPicture* shown,
            PictureOutcome* outcome) {
  if (outcome->failure.empty()) outcome->failure = placeOf(seen) + ": " + what;
  if (shown != nullptr) shown->failed.push_back(seen.curve);
}

double& param(std::vector<double>& params, const Camera& camera, std::string_view name) {
  const auto specs = camera.paramSpecs();
  const auto found =
      std::find_if(specs.begin(), specs.end(), [&](const ParamSpec& s) { return s.name == name; });
  if (found == specs.end()) throw std::logic_error("no parameter " + std::string(name));
  return params[static_cast<size_t>(found - specs.begin())];
}
bool hasParam(const Camera& camera, std::string_view name) {
  const auto specs = camera.paramSpecs();
  return std::any_of(
      specs.begin(), specs.end(), [&](const ParamSpec& s) { return s.name == name; });
}
Camera with(const Camera& camera, const std::vector<double>& params, int width, int height) {
  return makeCamera(camera.modelName(), params, width, height, camera.maxFieldAngleLimit());
}

/// Without what has no counterpart when rows and columns change places.
Camera withoutShear(const Camera& camera) {
  std::vector<double> p = camera.params();
  for (const std::string_view name : {"skew", "d", "e"}) {
    if (hasParam(camera, name)) param(p, camera, name) = 0;
  }
  for (const std::string_view name : {"c", "aspect"}) {
    if (hasParam(camera, name)) param(p, camera, name) = 1;
  }
  return with(camera, p, camera.width(), camera.height());
}

/// Rows and columns have changed places.
Camera transposedCamera(const Camera& camera) {
  std::vector<double> p = camera.params();
  std::swap(param(p, camera, "cx"), param(p, camera, "cy"));
  if (hasParam(camera, "fy")) std::swap(param(p, camera, "fx"), param(p, camera, "fy"));
  if (hasParam(camera, "p1")) std::swap(param(p, camera, "p1"), param(p, camera, "p2"));
  return with(camera, p, camera.height(), camera.width());
}

std::vector<float> remapped(const std::vector<float>& grey,
                            int width,
                            int height,
                            int new_width,
                            int new_height,
                            const PixelMap& forward) {
  std::vector<float> result(static_cast<size_t>(new_width) * static_cast<size_t>(new_height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector2d p = forward(Vector2d(x, y));
      result[static_cast<size_t>(p.y()) * static_cast<size_t>(new_width) +
             static_cast<size_t>(p.x())] =
          grey[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
    }
  }
  return result;
}

// --- The same lines in a changed picture ---

/// How a picture was changed.
struct Change {
  PixelMap forward;                               ///< Where its pixels went.
  std::function<Vector3d(const Vector3d&)> turn;  ///< Where its directions went.
  int polarity = 1;                               ///< -1: inverted.
  double across_px = kAcrossPx;
  double ends_px = kMostEndsPx;
  bool in_part = false;  ///< Lines whose pixels leave the changed picture are not asked for.
};

Vector3d unchanged(const Vector3d& ray) {
  return ray;
}
Vector2d samePlace(const Vector2d& pixel) {
  return pixel;
}

/// Whether the changed picture sees the whole line, clear of its border and rim.
bool staysInside(const Seen& seen,
                 const Camera& camera,
                 const Camera& changed,
                 const PixelMap& map) {
  for (int i = 0; i <= 20; ++i) {
    const auto p = camera.project(seen.line.arc.at(i / 20.0));
    if (!p) return false;
    if (!isClear(changed, map(*p), 12)) return false;
  }
  return true;
}

/// Every isolated line of the first picture is there in the changed one, and nothing but its place
/// has changed.
void compare(const View& view,
             const View& changed,
             const Change& change,
             bool with_shown,
             PictureOutcome* outcome) {
  ShownPicture shown;
  if (with_shown) shown = view.shown();
  for (const Seen& seen : view.lines) {
    if (!view.isIsolated(seen)) continue;
    if (change.in_part && !staysInside(seen, view.camera, changed.camera, change.forward)) continue;
    ++outcome->counted;
    const Match match =
        nearest(seen, view.camera, change.forward, changed.lines, changed.camera, change.across_px);
    if (match.line == nullptr || !(match.across_px <= change.across_px) ||
        !(match.ends_px <= change.ends_px)) {
      failAt(seen,
             fmt::format("{:.3f} px across, {:.3f} px at the ends from the nearest line of the "
                         "changed picture",
                         match.across_px,
                         match.ends_px),
             &shown,
             outcome);
      continue;
    }
    outcome->across_px.push_back(match.across_px);
    outcome->ends_px.push_back(match.ends_px);
    const double side = change.turn(seen.line.arc.normal).dot(match.line->line.arc.normal);
    const int polarity = side > 0 ? match.line->line.polarity : -match.line->line.polarity;
    if (polarity != change.polarity * seen.line.polarity) {
      failAt(seen, "the brighter side is another one in the changed picture", &shown, outcome);
    }
  }
  if (with_shown) outcome->shown = {shown, changed.shown()};
}

PictureOutcome checkChanged(const PictureCase& c, const DetectorOptions& options, bool with_shown) {
  PictureOutcome outcome;
  const bool is_transposed = c.property == PictureProperty::kTransposed;
  const Camera camera = is_transposed ? withoutShear(c.camera) : c.camera;
  const int w = camera.width(), h = camera.height();
  // A scene near the axis leaves a border without edges; one that turns must stay in the picture.
  const double angle =
      imageFieldAngle(camera) * (c.property == PictureProperty::kEmptyBorder ? 0.5 : 1);
  const Scene scene = sceneOf(c, angle);
  const View view(camera, test::render(scene, camera), options, &outcome);
  Change change{samePlace, unchanged};
  switch (c.property) {
    case PictureProperty::kMirrored: {
      change.forward = [w](const Vector2d& p) { return Vector2d(w - 1 - p.x(), p.y()); };
      change.turn = [](const Vector3d& n) { return Vector3d(-n.x(), n.y(), n.z()); };
      const View changed(mirroredCamera(camera),
                         remapped(view.grey, w, h, w, h, change.forward),
                         options,
                         &outcome);
      compare(view, changed, change, with_shown, &outcome);
      break;
    }
    case PictureProperty::kTransposed: {
      change.forward = [](const Vector2d& p) { return Vector2d(p.y(), p.x()); };
      change.turn = [](const Vector3d& n) { return Vector3d(n.y(), n.x(), n.z()); };
      const View changed(transposedCamera(camera),
                         remapped(view.grey, w, h, h, w, change.forward),
                         options,
                         &outcome);
      compare(view, changed, change, with_shown, &outcome);
      break;
    }
    case PictureProperty::kTurned: {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(c.amount, Vector3d::UnitZ()).toRotationMatrix();
      Scene turned = scene;
      for (test::Shape& shape : turned.shapes) {
        shape.axis = turn * shape.axis;
        for (Vector3d& v : shape.vertices) v = turn * v;
      }
      change.forward = [&camera, turn](const Vector2d& p) -> Vector2d {
        const auto ray = camera.unproject(p);
        const auto q = ray ? camera.project(turn * *ray) : std::nullopt;
        return q ? *q : Vector2d(-1e6, -1e6);
      };
      change.turn = [turn](const Vector3d& n) { return Vector3d(turn * n); };
      change.in_part = true;
      // Two paintings of 64 samples a pixel, each right to a part of this.
      change.across_px = 0.15;
      const View changed(camera, test::render(turned, camera), options, &outcome);
      compare(view, changed, change, with_shown, &outcome);
      break;
    }
    case PictureProperty::kPart:
    case PictureProperty::kEmptyBorder: {
      // What is kept: columns left ... right, rows top ... bottom.
      int left = c.left, top = c.top, right = w - 1, bottom = h - 1;
      const bool is_empty = c.property == PictureProperty::kEmptyBorder;
      if (is_empty) {
        int min_x = w, max_x = -1, min_y = h, max_y = -1;
        const float corner = view.grey[0];
        for (int y = 0; y < h; ++y) {
          for (int x = 0; x < w; ++x) {
            const float value =
                view.grey[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)];
            if (value == corner) continue;
            min_x = std::min(min_x, x);
            max_x = std::max(max_x, x);
            min_y = std::min(min_y, y);
            max_y = std::max(max_y, y);
          }
        }
        left = std::max(0, min_x - c.left);
        top = std::max(0, min_y - c.left);
        right = std::min(w - 1, max_x + c.left);
        bottom = std::min(h - 1, max_y + c.left);
        outcome.applies = max_x >= 0 && (right - left < w - 1 || bottom - top < h - 1);
        if (!outcome.applies) break;
        // Nothing that is near any line has changed.
        change.across_px = 0.05;
        change.ends_px = 0.5;
      }
      const int pw = right - left + 1, ph = bottom - top + 1;
      std::vector<float> part;
      for (int y = top; y <= bottom; ++y) {
        const auto row = view.grey.begin() + static_cast<ptrdiff_t>(y) * w;
        part.insert(part.end(), row + left, row + right + 1);
      }
      // From the part to the whole: a line of the part that is isolated there has nothing near it
      // in the whole either, but what is cut off.
      change.forward = [=](const Vector2d& p) { return Vector2d(p.x() + left, p.y() + top); };
      const View of_part(
          croppedCamera(camera, left, top, pw, ph), std::move(part), options, &outcome);
      compare(of_part, view, change, with_shown, &outcome);
      // The grid of rays lies elsewhere, by which rounding differs; where it is nearly undecided
      // whether an edge is an arc, a line more or less may be found.
      const size_t with = view.lines.size(), without = of_part.lines.size();
      if (is_empty) {
        outcome.counted = static_cast<long>(std::max(with, without));
        outcome.uncompared = outcome.counted - static_cast<long>(outcome.across_px.size());
      }
      if (is_empty && std::max(with, without) > std::min(with, without) + 1 &&
          outcome.failure.empty()) {
        outcome.failure = fmt::format("{} lines with the border, {} without it", with, without);
      }
      break;
    }
    case PictureProperty::kGreyLevels: {
      std::vector<float> grey = view.grey;
      for (float& value : grey) {
        value = static_cast<float>(c.offset) +
                static_cast<float>(c.amount) * (c.inverted ? 255 - value : value);
      }
      change.polarity = c.inverted ? -1 : 1;
      const View changed(camera, std::move(grey), options, &outcome);
      compare(view, changed, change, with_shown, &outcome);
      break;
    }
    default: {  // kOtherPinhole
      if (!c.other) throw std::invalid_argument("a property of two cameras needs the other one");
      const View changed(*c.other, view.grey, options, &outcome);
      compare(view, changed, change, with_shown, &outcome);
      break;
    }
  }
  return outcome;
}

// --- Another camera ---

// Of the coarser camera. What hides behind the last px of an edge in one picture, and not in the
// other, may turn a line a little more.
constexpr double kOtherCameraPx = 0.15, kOtherCameraWorst = 2;
/// Further apart than this are different edges, however coarse a camera is there (at the fold of a
/// model a px is any angle).
constexpr double kSameEdgeRad = 0.1;

/// Whether a picture shows the middle half of an arc as an edge that should be found: 40 px long,
/// clear of border and rim, of 25 grey levels and even on both sides.
bool showsEdge(const View& view, const Arc& arc) {
  const auto middle = arcBetween(arc.at(0.25), arc.at(0.75));
  if (!middle) return false;
  DetectedLine line;
  line.arc = *middle;
  auto previous = view.camera.project(middle->from);
  constexpr int kPieces = 20;
  for (int i = 0; i <= kPieces; ++i) {
    const auto p = view.camera.project(middle->at(static_cast<double>(i) / kPieces));
    if (!p || !previous || !isClear(view.camera, *p, 12)) return false;
    line.length_px += (*p - *previous).norm();
    previous = p;
  }
  return line.length_px >= 40 && contrastAlong(view.grey, view.camera, *middle) >= 25 &&
         isEvenBeside(view.grey, view.camera, line, 0);
}

PictureOutcome checkOtherCamera(const PictureCase& c,
                                const DetectorOptions& options,
                                bool with_shown) {
  if (!c.other) throw std::invalid_argument("a property of two cameras needs the other one");
  PictureOutcome outcome;
  const Scene scene = sceneOf(c, std::min(imageFieldAngle(c.camera), imageFieldAngle(*c.other)));
  const View first(c.camera, test::render(scene, c.camera), options, &outcome);
  const View second(*c.other, test::render(scene, *c.other), options, &outcome);
  ShownPicture shown;
  if (with_shown) shown = first.shown();
  for (const Seen& seen : first.lines) {
    if (!first.isIsolated(seen)) continue;
    const Arc& arc = seen.line.arc;
    const Vector3d forward = arc.from.cross(arc.to).normalized();
    const auto share = [&](const Vector3d& ray) {
      return std::atan2(arc.from.cross(ray).dot(forward), arc.from.dot(ray)) / arc.angle();
    };
    // The other camera's line along its middle half, if that has one.
    double best = std::numeric_limits<double>::infinity(), allowed = 0;
    for (const Seen& other : second.lines) {
      if (other.line.length_px < 40) continue;
      double t0 = share(other.line.arc.from), t1 = share(other.line.arc.to);
      if (t0 > t1) std::swap(t0, t1);
      if (!(t0 < 0.25 && t1 > 0.75 && t1 - t0 < 1.5)) continue;
      double off = 0, coarsest = 0;
      for (const double t : {0.25, 0.5, 0.75}) {
        const Vector3d ray = arc.at(t);
        off = worse(off, std::abs(other.line.arc.angleToPlane(ray)));
        for (const Camera* camera : {&c.camera, &*c.other}) {
          const auto J = camera->jacobian(ray);
          if (!J) continue;
          const Eigen::JacobiSVD<ProjectionJacobian> svd(*J);
          coarsest = std::max(coarsest, 1 / svd.singularValues()(1));
        }
      }
      if (off < best) {
        best = off;
        allowed = kOtherCameraPx * coarsest;
      }
    }
    // Else it is a line of another edge, and this one is missing.
    const bool is_found = best <= std::min(20 * allowed, kSameEdgeRad);
    if (!is_found && !showsEdge(second, arc)) continue;
    ++outcome.counted;
    if (!is_found) {
      failAt(seen, "missing in the other picture, which shows it", &shown, &outcome);
      continue;
    }
    outcome.shares.push_back(best / allowed);
    if (!(best <= kOtherCameraWorst * allowed)) {
      failAt(seen, fmt::format("{:.3g} of {:.3g} rad", best, allowed), &shown, &outcome);
    }
  }
  if (with_shown) outcome.shown = {shown, second.shown()};
  return outcome;
}

// --- What lines say ---

constexpr double kFilterPx = 3;  ///< Nearer to border and rim the picture shows no edge.

/// Of the grey levels across a curve: values at distances of 0.25 px from -reach to reach.
struct Across {
  Vector2d at, side;
};
std::optional<Across> acrossAt(const Camera& camera, const Arc& arc, double t, double step) {
  const auto p = camera.project(arc.at(t)), q = camera.project(arc.at(std::min(1.0, t + step)));
  if (!p || !q || (*q - *p).norm() == 0) return std::nullopt;
  const Vector2d along = (*q - *p).normalized();
  return Across{*p, Vector2d(-along.y(), along.x())};
}

PictureOutcome checkEquation8(const PictureCase& c,
                              const DetectorOptions& options,
                              bool with_shown) {
  PictureOutcome outcome;
  const View view(
      c.camera, test::render(sceneOf(c, imageFieldAngle(c.camera)), c.camera), options, &outcome);
  const double rho_px = options.validation.rho_px;
  const int w = c.camera.width(), h = c.camera.height();
  ShownPicture shown;
  if (with_shown) shown = view.shown();
  for (const Seen& seen : view.lines) {
    if (seen.line.length_px < 60) continue;  // Corners are much of the shorter ones.
    // Equal steps in angle may be of very different length in the image.
    const int count = 2 * static_cast<int>(seen.line.length_px);
    double on_edge_px = 0, asked_px = 0, seen_px = 0;
    for (int i = 1; i < count; ++i) {
      const auto across =
          acrossAt(c.camera, seen.line.arc, static_cast<double>(i) / count, 0.2 / count);
      const auto previous = c.camera.project(seen.line.arc.at((i - 1.0) / count));
      if (!across || !previous) continue;
      const Vector2d& p = across->at;
      if (!isClear(c.camera, p, kFilterPx)) continue;
      // The slope across has a maximum within rho.
      const auto slopeAt = [&](double shift) {
        return std::abs(
            static_cast<double>(bilinear(view.grey, w, h, p + (shift + 0.5) * across->side) -
                                bilinear(view.grey, w, h, p + (shift - 0.5) * across->side)));
      };
      // Where another edge crosses, grey levels change along the line, too.
      const auto isCrossed = [&] {
        const Vector2d along(across->side.y(), -across->side.x());
        return std::abs(bilinear(view.grey, w, h, p + along) -
                        bilinear(view.grey, w, h, p - along)) > 0.5F;
      };
      bool found = false;
      for (int k = -10; k <= 10 && !found; ++k) {
        const double shift = 0.1 * k * rho_px, here = slopeAt(shift);
        found = here > 0.5 && here >= slopeAt(shift - 0.7) && here >= slopeAt(shift + 0.7);
      }
      const double step_px = (p - *previous).norm();
      seen_px += step_px;
      if (!found && isCrossed()) continue;
      asked_px += step_px;
      if (found) on_edge_px += step_px;
    }
    if (!(seen_px >= 1)) continue;
    outcome.counted += static_cast<int>(asked_px);
    const double crossed = 1 - asked_px / seen_px;
    const double off = 1 - on_edge_px / std::max(asked_px, 1.0);
    outcome.shares.push_back(off);
    if (!(off <= 0.1 && crossed <= 0.2)) {
      failAt(seen,
             fmt::format("{:.2f} of it has no edge within rho, {:.2f} is crossed", off, crossed),
             &shown,
             &outcome);
    }
  }
  if (with_shown) outcome.shown = {shown};
  return outcome;
}

PictureOutcome checkStraight(const PictureCase& c,
                             const DetectorOptions& options,
                             bool with_shown) {
  PictureOutcome outcome;
  const View view(
      c.camera, test::render(sceneOf(c, imageFieldAngle(c.camera)), c.camera), options, &outcome);
  const int w = c.camera.width(), h = c.camera.height();
  ShownPicture shown;
  if (with_shown) shown = view.shown();
  for (const Seen& seen : view.lines) {
    if (!view.isIsolated(seen)) continue;
    ++outcome.counted;
    ++outcome.uncompared;  // Until its edge is measured.
    // Where the grey levels step, every px along the straight piece between the line's ends but for
    // 12 px at each: the mean place of their change from 4 px before to 4 px behind.
    const Vector2d from = seen.line.from_px, d = seen.line.to_px - from;
    const double length = d.norm();
    const Vector2d along = d / length, side(-along.y(), along.x());
    std::vector<Vector2d> points;
    for (double s = 12; s <= length - 12; s += 1) {
      double weight = 0, sum = 0;
      for (int k = -16; k < 16; ++k) {
        const auto greyAt = [&](int i) {
          return static_cast<double>(bilinear(view.grey, w, h, from + s * along + 0.25 * i * side));
        };
        const double change = greyAt(k + 1) - greyAt(k);
        weight += change;
        sum += change * 0.25 * (k + 0.5);
      }
      if (std::abs(weight) >= 10) points.push_back(from + s * along + sum / weight * side);
    }
    if (points.size() < 20) continue;
    // The straight line through them by least squares, three times, without those that are far from
    // the last one: another edge's corner may disturb some.
    Vector2d mean, normal;
    for (int round = 0; round < 3; ++round) {
      if (round > 0) {
        std::erase_if(points,
                      [&](const Vector2d& p) { return std::abs(normal.dot(p - mean)) > 0.2; });
      }
      mean = Vector2d::Zero();
      for (const Vector2d& p : points) mean += p / static_cast<double>(points.size());
      Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
      for (const Vector2d& p : points) scatter += (p - mean) * (p - mean).transpose();
      normal = Eigen::JacobiSVD<Eigen::Matrix2d>(scatter, Eigen::ComputeFullU).matrixU().col(1);
    }
    if (points.size() < 20) continue;
    --outcome.uncompared;
    double across = 0;
    for (int i = 0; i <= 10; ++i) {
      const auto p = c.camera.project(seen.line.arc.at(i / 10.0));
      across = p ? worse(across, std::abs(normal.dot(*p - mean)))
                 : std::numeric_limits<double>::infinity();
    }
    outcome.across_px.push_back(across);
    if (!(across <= kAcrossPx)) {
      failAt(seen, fmt::format("{:.3f} px from the straight line", across), &shown, &outcome);
    }
  }
  if (with_shown) outcome.shown = {shown};
  return outcome;
}

/// Direction in which the image of an arc leaves its start.
std::optional<Vector2d> startOf(const Camera& camera, const Arc& arc) {
  const auto p = camera.project(arc.from), q = camera.project(arc.at(0.01));
  if (!p || !q || (*q - *p).norm() == 0) return std::nullopt;
  return (*q - *p).normalized();
}

/// A triangle with the arc as a side, whose corners there have 30 degrees or more in the image:
/// sharper ones end lines long before. Seen from its inside, anticlockwise.
std::optional<std::vector<Vector3d>> triangleOn(const Camera& camera, const Arc& arc) {
  constexpr double kHeight = 0.6;  // Over the side's length.
  const auto from = camera.project(arc.from), to = camera.project(arc.to);
  const auto middle = camera.project(arc.at(0.5));
  if (!from || !to || !middle) return std::nullopt;
  const Vector2d side = *to - *from;
  for (const double height : {kHeight, -kHeight}) {
    const auto tip = camera.unproject(*middle + height * Vector2d(-side.y(), side.x()));
    if (!tip) continue;
    bool is_wide = true;
    for (const auto& [corner, other] : {std::pair(arc.from, arc.to), {arc.to, arc.from}}) {
      const auto along = arcBetween(corner, other), up = arcBetween(corner, *tip);
      const auto a = along ? startOf(camera, *along) : std::nullopt;
      const auto b = up ? startOf(camera, *up) : std::nullopt;
      is_wide = is_wide && a && b && a->dot(*b) <= std::cos(M_PI / 6);
    }
    if (!is_wide) continue;
    std::vector<Vector3d> corners{arc.from, arc.to, *tip};
    if (arc.from.cross(arc.to).dot(*tip) < 0) std::swap(corners[0], corners[1]);
    return corners;
  }
  return std::nullopt;
}

PictureOutcome checkPaintedAgain(const PictureCase& c,
                                 const DetectorOptions& options,
                                 bool with_shown) {
  constexpr double kPaintedAcrossPx = 0.2;
  PictureOutcome outcome;
  const View view(
      c.camera, test::render(sceneOf(c, imageFieldAngle(c.camera)), c.camera), options, &outcome);
  ShownPicture shown;
  if (with_shown) shown = view.shown();
  for (const Seen& seen : view.lines) {
    if (outcome.counted == 2 || !view.isIsolated(seen)) continue;
    const auto corners = triangleOn(c.camera, seen.line.arc);
    if (!corners) continue;
    ++outcome.counted;
    Scene scene;
    scene.background = 60;
    const Vector3d centre = (*corners)[0] + (*corners)[1] + (*corners)[2];
    scene.shapes.push_back({*corners, centre.normalized(), 1, 200});
    const View again(c.camera, test::render(scene, c.camera), options, &outcome);
    const Match match = nearest(seen, c.camera, samePlace, again.lines, c.camera, kPaintedAcrossPx);
    if (!(match.across_px <= kPaintedAcrossPx) || !(match.ends_px <= kMostEndsPx)) {
      failAt(seen,
             fmt::format("painted alone, {:.3f} px across, {:.2f} px at the ends",
                         match.across_px,
                         match.ends_px),
             &shown,
             &outcome);
      if (with_shown && outcome.shown.empty()) outcome.shown = {again.shown()};
      continue;
    }
    outcome.across_px.push_back(match.across_px);
    outcome.ends_px.push_back(match.ends_px);
  }
  if (with_shown) outcome.shown.insert(outcome.shown.begin(), shown);
  return outcome;
}

/// Nearer to border and rim than so many px lines are taken on unseen: what is 1.5 px beside them
/// is looked at where it is 2 px clear of the rim.
constexpr double kSeenPx = 4;

/// Length of a line where the picture shows an edge.
double shownLength(const Camera& camera, const DetectedLine& line) {
  double length = 0;
  const int count = 2 * static_cast<int>(line.length_px);
  for (int i = 1; i <= count; ++i) {
    const auto p = camera.project(line.arc.at((i - 1.0) / count)),
               q = camera.project(line.arc.at(static_cast<double>(i) / count));
    if (p && q && isClear(camera, *p, kSeenPx) && isClear(camera, *q, kSeenPx)) {
      length += (*q - *p).norm();
    }
  }
  return length;
}

/// Length of the longest shown piece of a cone's outline that a great circle fits within `rho_px`.
double longestStraightPiece(const Camera& camera, const test::Shape& cone, double rho_px) {
  // The outline, and px per rad across it.
  constexpr int kPoints = 720;
  const Vector3d a = cone.axis.unitOrthogonal(), b = cone.axis.cross(a);
  const double sine = std::sqrt(1 - cone.cos_radius * cone.cos_radius);
  std::vector<Vector3d> rays;
  std::vector<std::optional<Vector2d>> pixels;
  std::vector<double> scales;
  for (int i = 0; i < kPoints; ++i) {
    const double t = 2 * M_PI * i / kPoints;
    rays.push_back(cone.cos_radius * cone.axis + sine * (std::cos(t) * a + std::sin(t) * b));
    auto p = camera.project(rays.back());
    const auto J = p ? camera.jacobian(rays.back()) : std::nullopt;
    scales.push_back(J ? Eigen::JacobiSVD<ProjectionJacobian>(*J).singularValues()(1) : 0.0);
    pixels.push_back(J && isClear(camera, *p, kFilterPx) ? p : std::nullopt);
  }
  // From each outline point on, as far as the run's middle is within 2 rho_px of the plane through
  // its ends: the plane half way between that one and the tangent plane is within rho_px of all.
  double longest = 0;
  for (int i = 0; i < kPoints; ++i) {
    double length = 0;
    for (int n = 1; n < kPoints; ++n) {
      const auto index = [&](int k) { return static_cast<size_t>((i + k) % kPoints); };
      if (!pixels[index(n - 1)] || !pixels[index(n)]) break;
      length += (*pixels[index(n)] - *pixels[index(n - 1)]).norm();
      if (n < 4) continue;
      const Vector3d chord = rays[index(0)].cross(rays[index(n)]).normalized();
      const double sagitta =
          std::abs(std::asin(std::clamp(chord.dot(rays[index(n / 2)]), -1.0, 1.0))) *
          scales[index(n / 2)];
      if (sagitta > 2 * rho_px) break;
      longest = std::max(longest, length);
    }
  }
  return longest;
}

PictureOutcome checkCurved(const PictureCase& c, const DetectorOptions& options, bool with_shown) {
  PictureOutcome outcome;
  const Scene scene = sceneOf(c, imageFieldAngle(c.camera));
  const test::Shape& cone = scene.shapes[0];
  outcome.applies = std::abs(cone.grey - scene.background) >= 25;
  if (!outcome.applies) return outcome;
  const View view(c.camera, test::render(scene, c.camera), options, &outcome);
  ShownPicture shown;
  if (with_shown) shown = view.shown();
  constexpr double kRowsPx = 4;
  // A line's ends are known to the four rows it ends in; and any piece of an outline may be as long
  // as the detector's shortest lines.
  const double straight = longestStraightPiece(c.camera, cone, options.validation.tight_rho_px);
  const double allowed = std::max(straight, options.validation.min_length_px) + kRowsPx;
  for (const Seen& seen : view.lines) {
    ++outcome.counted;
    const double length_px = shownLength(c.camera, seen.line);
    outcome.shares.push_back(length_px / allowed);
    if (!(length_px <= allowed)) {
      failAt(seen,
             fmt::format("{:.1f} px where {:.1f} px are straight", length_px, straight),
             &shown,
             &outcome);
    }
  }
  if (with_shown) outcome.shown = {shown};
  return outcome;
}

// --- Any picture ---

bool same(const DetectedLine& a, const DetectedLine& b) {
  return a.arc.normal == b.arc.normal && a.arc.from == b.arc.from && a.arc.to == b.arc.to &&
         a.from_px == b.from_px && a.to_px == b.to_px && a.normal_cov == b.normal_cov &&
         a.rms_px == b.rms_px && a.max_px == b.max_px && a.length_px == b.length_px &&
         a.score == b.score && a.contrast == b.contrast && a.polarity == b.polarity;
}

ShownPicture shownOf(const TestImage& image, const Camera& camera, const auto& lines) {
  ShownPicture shown;
  shown.image.width = image.width;
  shown.image.height = image.height;
  const size_t pixel = image.channels * (image.type == PixelType::kU8    ? size_t{1}
                                         : image.type == PixelType::kU16 ? size_t{2}
                                                                         : size_t{4});
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::byte* at =
          image.bytes.data() + y * image.stride_bytes + static_cast<ptrdiff_t>(pixel) * x;
      double value = static_cast<double>(*at);
      if (image.type == PixelType::kU16) {
        uint16_t level = 0;
        std::memcpy(&level, at, sizeof level);
        value = level / 257.0;
      } else if (image.type == PixelType::kF32) {
        float level = 0;
        std::memcpy(&level, at, sizeof level);
        value = static_cast<double>(level);
      }
      shown.image.bytes.push_back(shownLevel(value));
    }
  }
  for (const DetectedLine& line : lines) {
    shown.lines.push_back(imageCurve(camera, line.arc, 0, 1, 0.02));
  }
  return shown;
}

/// Checked builds take many times as long.
constexpr double kBuildSlowness =
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
    20;
#else
    1;
#endif

/// Processor time that a detector and its first picture may take: far more than it does, but no
/// minutes.
double allowedSeconds(const TestImageSpec& image) {
  return kBuildSlowness * (2 + 20e-6 * image.width * image.height);
}

PictureOutcome checkTestImage(const PictureCase& c,
                              const DetectorOptions& options,
                              bool with_shown) {
  PictureOutcome outcome;
  const TestImage image = makeTestImage(c.image), before = image;
  if (image.width != c.camera.width() || image.height != c.camera.height()) {
    throw std::invalid_argument("the camera's size is not the picture's");
  }
  const std::clock_t start = std::clock();
  Detector detector(c.camera, options);
  const std::vector<DetectedLine> lines = detector.detect(image.view());
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  outcome.seconds_share = seconds / allowedSeconds(c.image);
  outcome.counted = static_cast<long>(lines.size());
  for (const DetectedLine& line : lines) {
    outcome.long_lines += line.length_px >= kLongLinePx ? 1 : 0;
  }
  if (c.property == PictureProperty::kNoise) {
    if (!(outcome.long_lines <= kMostNoiseLines)) {
      outcome.failure = fmt::format("{} lines of 40 px in noise", outcome.long_lines);
    }
  } else {
    const std::vector<DetectedLine> second = detector.detect(image.view());
    const std::vector<DetectedLine> third = Detector(c.camera, options).detect(image.view());
    const auto defect = defectOf(c.camera, options, lines);
    if (before.bytes != image.bytes) {
      outcome.failure = "the picture's bytes have changed";
    } else if (!std::equal(lines.begin(), lines.end(), second.begin(), second.end(), same)) {
      outcome.failure = "other lines the second time";
    } else if (!std::equal(lines.begin(), lines.end(), third.begin(), third.end(), same)) {
      outcome.failure = "other lines from another detector";
    } else if (defect) {
      outcome.failure = *defect;
    }
  }
  if (!(outcome.seconds_share <= 1) && outcome.failure.empty()) {
    outcome.failure =
        fmt::format("{:.1f} s of processor time, allowed {:.1f}", seconds, allowedSeconds(c.image));
  }
  if (with_shown) outcome.shown = {shownOf(image, c.camera, lines)};
  return outcome;
}

constexpr std::array<const char*, 3> kTypeNames{"u8", "u16", "f32"};

}  // namespace

std::string_view nameOf(PictureProperty property) {
  return kNames[static_cast<size_t>(property)];
}

std::optional<PictureProperty> picturePropertyFromName(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<PictureProperty>(found - kNames.begin());
}

std::optional<std::string> defectOf(const Camera& camera,
                                    const DetectorOptions& options,
                                    const std::vector<DetectedLine>& lines) {
  double previous_score = std::numeric_limits<double>::infinity();
  for (const DetectedLine& line : lines) {
    const bool finite = line.arc.normal.allFinite() && line.arc.from.allFinite() &&
                        line.arc.to.allFinite() && line.from_px.allFinite() &&
                        line.to_px.allFinite() && line.normal_cov.allFinite() &&
                        std::isfinite(line.rms_px) && std::isfinite(line.max_px) &&
                        std::isfinite(line.length_px) && std::isfinite(line.score);
    if (!finite) return "a value that is no finite number";
    if (!(std::abs(line.arc.normal.norm() - 1) <= 1e-12)) return "a normal that is no unit vector";
    if (!(std::abs(line.arc.normal.dot(line.arc.from)) <= 1e-12)) return "a start off the plane";
    if (!(std::abs(line.arc.normal.dot(line.arc.to)) <= 1e-12)) return "an end off the plane";
    if (camera.project(line.arc.from) != line.from_px) return "a start that is not its ray's pixel";
    if (camera.project(line.arc.to) != line.to_px) return "an end that is not its ray's pixel";
    if (!camera.inImage(line.from_px) || !camera.inImage(line.to_px)) return "an end off the image";
    if (!(line.rms_px <= line.max_px)) return "rms > max";
    // The paper looks at the ends of straight pieces only.
    if (options.method == DetectorOptions::Method::kPlanarPieces &&
        !(line.max_px <= 2 * options.validation.rho_px)) {
      return "a residual of more than 2 rho";
    }
    if (!(line.length_px > 0)) return "no length";
    if (line.polarity != 1 && line.polarity != -1) return "no polarity";
    if (!(line.score <= previous_score)) return "scores that rise";
    previous_score = line.score;
    if (imageSpans(camera, line.arc).size() != 1) return "an arc that leaves the image";
  }
  return std::nullopt;
}

bool takesImage(PictureProperty property) {
  return property == PictureProperty::kAnyPicture || property == PictureProperty::kNoise;
}

nlohmann::ordered_json toJson(const PictureCase& c) {
  nlohmann::ordered_json json{{"format", "dlsd-case/1"},
                              {"property", nameOf(c.property)},
                              {"camera", cameraToJson(c.camera)}};
  if (c.other) json["other_camera"] = cameraToJson(*c.other);
  if (takesImage(c.property)) {
    json["picture"] = {{"fill", nameOf(c.image.fill)},
                       {"width", c.image.width},
                       {"height", c.image.height},
                       {"channels", c.image.channels},
                       {"type", kTypeNames[static_cast<size_t>(c.image.type)]},
                       {"padding", c.image.padding},
                       {"bgr", c.image.bgr ? 1 : 0},
                       {"seed", c.image.seed},
                       {"noise_sigma", c.image.noise_sigma},
                       {"blur_px", c.image.blur_px}};
  } else {
    json["picture"] = {{"seed", c.seed}, {"shapes", c.shapes}};
    json["change"] = {{"left", c.left},
                      {"top", c.top},
                      {"amount", c.amount},
                      {"offset", c.offset},
                      {"inverted", c.inverted ? 1 : 0}};
  }
  json["detector"] = c.detector;
  return json;
}

PictureCase pictureCaseFromJson(const nlohmann::json& json, const std::string& source) {
  const JsonField root(json, source);
  if (root["format"].text() != "dlsd-case/1") root["format"].fail("is not dlsd-case/1");
  const auto property = picturePropertyFromName(root["property"].text());
  if (!property)
    root["property"].fail(fmt::format("is unknown: allowed is {}", fmt::join(kNames, ", ")));
  PictureCase c{.property = *property, .camera = cameraFromJson(root["camera"])};
  if (root.has("other_camera")) c.other = cameraFromJson(root["other_camera"]);
  const JsonField picture = root["picture"];
  constexpr int kMaxSide = Camera::kMaxImageSize;
  if (takesImage(c.property)) {
    const auto fill = fillFromName(picture["fill"].text());
    if (!fill) picture["fill"].fail("is unknown");
    const auto type = std::find(kTypeNames.begin(), kTypeNames.end(), picture["type"].text());
    if (type == kTypeNames.end()) picture["type"].fail("is not u8, u16 or f32");
    c.image = {*fill,
               picture["width"].integer(1, kMaxSide),
               picture["height"].integer(1, kMaxSide),
               picture["channels"].integer(1, 4),
               static_cast<PixelType>(type - kTypeNames.begin()),
               picture["padding"].integer(0, 1000),
               picture["bgr"].integer(0, 1) == 1,
               picture["seed"].counter(),
               picture["noise_sigma"].number(),
               picture["blur_px"].number()};
    if (c.image.width != c.camera.width() || c.image.height != c.camera.height()) {
      picture["width"].fail("and height are not the camera's");
    }
  } else {
    c.seed = picture["seed"].counter();
    c.shapes = static_cast<unsigned>(picture["shapes"].integer(0, 15));
    const JsonField change = root["change"];
    c.left = change["left"].integer(0, c.camera.width() - 1);
    c.top = change["top"].integer(0, c.camera.height() - 1);
    c.amount = change["amount"].number();
    c.offset = change["offset"].number();
    c.inverted = change["inverted"].integer(0, 1) == 1;
  }
  if ((c.property == PictureProperty::kOtherPinhole ||
       c.property == PictureProperty::kOtherCamera) &&
      !c.other) {
    root.fail("lacks other_camera");
  }
  c.detector = oneOf(builtinDetectors(), root["detector"]);
  return c;
}

PictureOutcome checkPicture(const PictureCase& c, bool with_shown) {
  const DetectorOptions options = builtinOptions(c.detector);
  switch (c.property) {
    case PictureProperty::kAnyPicture:
    case PictureProperty::kNoise:
      return checkTestImage(c, options, with_shown);
    case PictureProperty::kOtherCamera:
      return checkOtherCamera(c, options, with_shown);
    case PictureProperty::kEquation8:
      return checkEquation8(c, options, with_shown);
    case PictureProperty::kStraight:
      return checkStraight(c, options, with_shown);
    case PictureProperty::kPaintedAgain:
      return checkPaintedAgain(c, options, with_shown);
    case PictureProperty::kCurved:
      return checkCurved(c, options, with_shown);
    default:
      return checkChanged(c, options, with_shown);
  }
}

}  // namespace dlsd
