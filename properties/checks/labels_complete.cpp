// Every straight border in the picture belongs to a label. Borders are found by rays between
// neighbouring pixels, without the scene's edges.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "properties/checks/label_view.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Things by square cells of the image.
template <class T>
class ImageGrid {
 public:
  ImageGrid(const Camera& camera, int cell)
      : cell_(cell),
        columns_(camera.width() / cell + 1),
        rows_(camera.height() / cell + 1),
        cells_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {}

  /// Calls function(list) for all cells within `reach` of the box.
  template <class Function>
  void forEachCell(const Vector2d& lo, const Vector2d& hi, double reach, const Function& function) {
    const auto clamped = [&](double x, int count) {
      return std::clamp(static_cast<int>(std::floor((x + 0.5) / cell_)), 0, count - 1);
    };
    for (int j = clamped(lo.y() - reach, rows_); j <= clamped(hi.y() + reach, rows_); ++j) {
      for (int i = clamped(lo.x() - reach, columns_); i <= clamped(hi.x() + reach, columns_); ++i) {
        function(cells_[static_cast<size_t>(j * columns_ + i)]);
      }
    }
  }

 private:
  int cell_, columns_, rows_;
  std::vector<std::vector<T>> cells_;
};

/// Of two hits of rays from one place.
bool isBefore(const Hit& a, const Hit& b) {
  return a.kind != HitKind::kNothing && (b.kind == HitKind::kNothing || a.distance < b.distance);
}

/// A place where the picture jumps.
struct Jump {
  Vector2d pixel;
  Vector3d ray;
};

struct Jumps {
  std::vector<Jump> unexplained;
  long count = 0;  ///< With those that are explained.
  long round = 0;  ///< Outlines of balls and tubes, which are not among the unexplained.
};

/// Places on the lines between neighbouring pixels' centres where what is seen changes by more
/// than `least_step` grey levels, to 1e-5 px. Where explained(a, b) holds, all places between a and
/// b are known and not looked for any closer.
///
/// Outlines of balls and tubes are no lines, however little they bend: where that of a ring turns
/// from convex to concave it has no curvature over tens of pixels.
Jumps findJumps(const Eye& eye, const Camera& camera, double least_step, const auto& explained) {
  /// Between lo and hi, shares of the way between two pixels' centres.
  struct Search {
    Vector2d from, to;
    double lo, hi;
    Eye::Look here, there;
    /// What is neither here nor there has been seen in between: only the end of here is sought.
    bool one_sided;
    [[nodiscard]] Vector2d at(double share) const { return from + share * (to - from); }
  };
  std::vector<Search> searches;
  std::vector<Vector2d> pixels(static_cast<size_t>(camera.width()));
  std::vector<std::optional<Eye::Look>> above(pixels.size()), row;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) pixels[static_cast<size_t>(x)] = {x, y};
    eye.at(pixels, &row);
    for (size_t x = 0; x < row.size(); ++x) {
      const auto add = [&](const std::optional<Eye::Look>& other, const Vector2d& step) {
        if (!row[x] || !other || row[x]->isSame(*other)) return;
        searches.push_back({pixels[x] - step, pixels[x], 0, 1, *other, *row[x], false});
      };
      if (x > 0) add(row[x - 1], {1, 0});
      add(above[x], {0, 1});
    }
    above.swap(row);
  }

  Jumps jumps;
  std::vector<Search> left;
  std::vector<std::optional<Eye::Look>> looks;
  const auto isStep = [&](const Search& s) {
    return std::abs(eye.grey(s.here) - eye.grey(s.there)) > least_step;
  };
  for (int k = 0; k < 17; ++k) {
    pixels.clear();
    for (const Search& s : searches) pixels.push_back(s.at((s.lo + s.hi) / 2));
    eye.at(pixels, &looks);
    left.clear();
    const auto keep = [&](const Search& s) {
      if (explained(s.at(s.lo), s.at(s.hi))) {
        jumps.count += isStep(s) ? 1 : 0;
      } else {
        left.push_back(s);
      }
    };
    for (size_t i = 0; i < searches.size(); ++i) {
      if (!looks[i]) continue;
      Search s = searches[i];
      const double middle = (s.lo + s.hi) / 2;
      if (looks[i]->isSame(s.here)) {
        s.lo = middle;
        s.here = *looks[i];
      } else {
        if (!s.one_sided && !looks[i]->isSame(s.there)) {
          // Something thin is in between: from now on from each side.
          keep({s.to, s.from, 1 - s.hi, 1 - middle, s.there, *looks[i], true});
          s.one_sided = true;
        }
        s.hi = middle;
        s.there = *looks[i];
      }
      keep(s);
    }
    searches.swap(left);
  }
  for (const Search& s : searches) {
    if (!isStep(s)) continue;
    const Vector2d pixel = s.at(s.lo);
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    ++jumps.count;
    const Hit& front = isBefore(s.here.hit, s.there.hit) ? s.here.hit : s.there.hit;
    if (front.kind == HitKind::kSphere || front.kind == HitKind::kTube) {
      ++jumps.round;
      continue;
    }
    jumps.unexplained.push_back({pixel, *ray});
  }
  return jumps;
}

/// Straight in space, that is: in one plane through the camera, to kStraightPx.
constexpr double kStraightPx = 1e-3;
constexpr double kLongPx = 20;

/// The longest straight run of jumps, its length and its ends.
struct StraightRun {
  double length_px = 0;
  Vector2d from{0, 0}, to{0, 0};
};
StraightRun longestStraightRun(const Camera& camera, const std::vector<Jump>& jumps) {
  ImageGrid<size_t> grid(camera, 16);
  for (size_t k = 0; k < jumps.size(); ++k) {
    grid.forEachCell(jumps[k].pixel, jumps[k].pixel, 0, [&](auto& list) { list.push_back(k); });
  }
  StraightRun longest;
  std::vector<std::pair<double, size_t>> along;
  for (const Jump& a : jumps) {
    const auto J = camera.jacobian(a.ray);
    if (!J) continue;
    const double straight_rad = kStraightPx / J->norm();
    std::vector<size_t> near;
    grid.forEachCell(a.pixel, a.pixel, 24, [&](auto& list) {
      near.insert(near.end(), list.begin(), list.end());
    });
    for (const size_t k : near) {
      const double apart = (jumps[k].pixel - a.pixel).norm();
      if (!(apart > 9 && apart < 10.5)) continue;
      const Vector3d normal = a.ray.cross(jumps[k].ray).normalized();
      const Vector3d across = normal.cross(a.ray);
      along.clear();
      for (const size_t i : near) {
        const Vector3d& ray = jumps[i].ray;
        if (std::abs(normal.dot(ray)) > straight_rad) continue;
        along.emplace_back(std::atan2(ray.dot(across), ray.dot(a.ray)), i);
      }
      std::sort(along.begin(), along.end());
      for (size_t first = 0; first < along.size();) {
        size_t last = first;
        while (last + 1 < along.size() &&
               (jumps[along[last + 1].second].pixel - jumps[along[last].second].pixel).norm() <
                   1.5) {
          ++last;
        }
        const Vector2d &from = jumps[along[first].second].pixel,
                       &to = jumps[along[last].second].pixel;
        if ((to - from).norm() > longest.length_px) longest = {(to - from).norm(), from, to};
        first = last + 1;
      }
    }
  }
  return longest;
}

/// Calls function(from, to) with pieces of the middles of thin bars and of bars' shadows, in the
/// image, that something stands before (of a bar: other than itself). There, one of their borders
/// may show, which has no label.
void forHiddenMiddles(const Viewed& seen, const Camera& camera, const auto& function) {
  constexpr int kPieces = 400;
  const Vector3d& eye = seen.pose.position_in_world;
  std::vector<char> is_thick(seen.scene.rods.size(), 0);  // Labelled by their sides.
  for (const LabelLine& line : seen.labels.lines) {
    const Edge& edge = seen.scene.edges[static_cast<size_t>(line.edge)];
    if (edge.rod < 0 || edge.source == EdgeSource::kShadow || isMiddle(seen.scene, line)) continue;
    is_thick[static_cast<size_t>(edge.rod)] = 1;
  }
  const auto isHidden = [&](const Edge& edge, const Vector3d& point) {
    const double distance = (point - eye).norm();
    const Eigen::Vector3f direction = ((point - eye) / distance).cast<float>();
    const auto end = static_cast<float>(distance * (1 - 1e-4));
    const auto isOwn = [&](const Hit& hit) {
      return edge.source == EdgeSource::kRodCentre && isOnRod(hit, seen.scene, edge.rod);
    };
    return seen.raycaster.cast(eye.cast<float>(), direction, 0, end, isOwn).kind !=
           HitKind::kNothing;
  };
  for (const Edge& edge : seen.scene.edges) {
    const bool is_bar =
        edge.source == EdgeSource::kRodCentre && is_thick[static_cast<size_t>(edge.rod)] == 0;
    const bool is_shadow =
        edge.source == EdgeSource::kShadow &&
        seen.scene.edges[static_cast<size_t>(edge.caster)].source == EdgeSource::kRodCentre;
    if (!is_bar && !is_shadow) continue;
    std::optional<Vector2d> before;
    for (int k = 0; k <= kPieces; ++k) {
      const Vector3d point = edge.from + (edge.to - edge.from) * k / kPieces;
      std::optional<Vector2d> pixel;
      if (isHidden(edge, point)) pixel = camera.project(seen.pose.toCam(point));
      if (pixel && before) function(*before, *pixel);
      before = pixel;
    }
  }
}

}  // namespace

LabelsOutcome checkComplete(const LabelCase& c, bool with_shown) {
  constexpr double kLeastStep = 5;  // Grey levels.
  const Camera& camera = c.camera;
  SceneView view = viewOf(c);
  const Viewed seen(std::move(view.scene), view.pose, camera);
  const Eye eye(seen, camera);
  // Labels' pieces, each with how far from it its borders may be: thin bars have theirs in their
  // middle.
  struct Piece {
    Vector2d from, to;
    double reach;
  };
  constexpr double kOnLabelPx = 0.02, kInBarPx = kThickRodPx / 2 + 0.1;
  ImageGrid<Piece> pieces(camera, 8);
  for (const LabelLine& line : seen.labels.lines) {
    const bool is_bar = isMiddle(seen.scene, line);
    for (size_t i = 1; i < line.points.size(); ++i) {
      const Vector2d &a = line.points[i - 1], &b = line.points[i];
      pieces.forEachCell(a.cwiseMin(b), a.cwiseMax(b), 2, [&](auto& list) {
        list.push_back({a, b, is_bar ? kInBarPx : kOnLabelPx});
      });
    }
  }
  const auto explained = [&](const Vector2d& a, const Vector2d& b) {
    bool is_explained = false;
    pieces.forEachCell(a, a, 0, [&](const auto& list) {
      for (const Piece& piece : list) {
        is_explained = is_explained || (distanceTo(piece.from, piece.to, a) <= piece.reach &&
                                        distanceTo(piece.from, piece.to, b) <= piece.reach);
      }
    });
    return is_explained;
  };
  Jumps jumps = findJumps(eye, camera, kLeastStep, explained);
  StraightRun run = longestStraightRun(camera, jumps.unexplained);
  if (!(run.length_px < kLongPx)) {
    forHiddenMiddles(seen, camera, [&](const Vector2d& a, const Vector2d& b) {
      if (!((a - b).norm() < 8)) return;
      pieces.forEachCell(a.cwiseMin(b), a.cwiseMax(b), 2, [&](auto& list) {
        list.push_back({a, b, kInBarPx});
      });
    });
    std::erase_if(jumps.unexplained,
                  [&](const Jump& jump) { return explained(jump.pixel, jump.pixel); });
    run = longestStraightRun(camera, jumps.unexplained);
  }
  LabelsOutcome outcome;
  outcome.counted = jumps.count;
  outcome.round = jumps.round;
  outcome.errors = {run.length_px};
  outcome.applies = outcome.counted > 0;
  if (outcome.applies && !(run.length_px < kLongPx)) {
    outcome.failure = fmt::format("a straight border of {:.1f} px without a label, from {} to {}",
                                  run.length_px,
                                  textOf(run.from),
                                  textOf(run.to));
  }
  if (with_shown) {
    outcome.shown = {seen.shown(camera)};
    if (!outcome.failure.empty()) outcome.shown[0].failed = {{run.from, run.to}};
  }
  return outcome;
}

}  // namespace dlsd
