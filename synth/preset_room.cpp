// Preset "room": a box room with windows in niches, doors, skirting, pictures, shelves with books,
// tables, chairs, cabinets, lamps, a wireframe of rods, balls and round things.
//
// Solids may touch but never enter each other, and no two edges lie on each other, so that every
// straight step of the picture belongs to exactly one label. Where a real room has things flush
// (skirting in corners, drawers), there are gaps of a few millimetres.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "synth/dataset/random.h"
#include "synth/presets.h"
#include "synth/scene_builder.h"
#include "synth/shading.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Axis-aligned box of space that something takes.
struct Box3 {
  Vector3d lo, hi;
  [[nodiscard]] bool overlaps(const Box3& other) const {
    return (lo.array() < other.hi.array()).all() && (other.lo.array() < hi.array()).all();
  }
  [[nodiscard]] double distanceTo(const Vector3d& p) const {
    return (lo - p).cwiseMax(p - hi).cwiseMax(0).norm();
  }
};

Panel plain(const Surface& surface) {
  return {surface, {}};
}

class RoomMaker {
 public:
  RoomMaker(uint64_t seed, uint64_t index) : random_(hashCounters({seed, index}), kStream) {}

  SceneView make() {
    size_ = {random_.next(3.6, 7.5), random_.next(3.2, 6.5), random_.next(2.4, 3.2)};
    makeShell();
    if (random_.nextBool(0.5)) addRug();
    furnish();
    addWallThings();
    addCeilingLamp();
    addLights();
    SceneView view;
    view.pose = makePose();
    builder_.finish();
    view.scene = std::move(builder_.scene);
    return view;
  }

 private:
  static constexpr uint64_t kStream = 0x700b;
  static constexpr double kMargin = 0.02;  ///< Between the boxes that things reserve.
  static constexpr double kWallGap = 0.04;
  static constexpr double kTopThings = 0.6;  ///< Height kept for things on a table or cabinet.

  [[nodiscard]] double wallWidth(int wall) const { return wall % 2 == 0 ? size_.x() : size_.y(); }

  Surface paint(double lo, double hi) { return {random_.next(lo, hi), 0}; }
  /// Any material: dark, middle or bright.
  Surface anyPaint() { return paint(0.06, 0.85); }
  Surface near(const Surface& s, double spread) {
    return {std::clamp(s.albedo * (1 + random_.next(-spread, spread)), 0.02, 0.95), s.emission};
  }

  /// Box in the world of a box given in a frame.
  static Box3 boxIn(const Frame3& frame, const Vector3d& lo, const Vector3d& hi) {
    Box3 box{frame.at(lo.x(), lo.y(), lo.z()), frame.at(lo.x(), lo.y(), lo.z())};
    for (int k = 1; k < 8; ++k) {
      const Vector3d p = frame.at((k & 1) != 0 ? hi.x() : lo.x(),
                                  (k & 2) != 0 ? hi.y() : lo.y(),
                                  (k & 4) != 0 ? hi.z() : lo.z());
      box.lo = box.lo.cwiseMin(p);
      box.hi = box.hi.cwiseMax(p);
    }
    return box;
  }

  [[nodiscard]] bool isFree(const Box3& box) const {
    const Box3 grown{box.lo.array() - kMargin, box.hi.array() + kMargin};
    return std::none_of(
        taken_.begin(), taken_.end(), [&](const Box3& t) { return t.overlaps(grown); });
  }

  // --- The shell -------------------------------------------------------------------------------

  void makeShell() {
    const Surface wall_paint = paint(0.45, 0.82);
    std::array<Panel, 4> walls;
    struct Pane {
      int wall;
      size_t pocket;
    };
    std::vector<Pane> windows;
    const int door_wall = random_.nextInt(0, 3);
    for (int k = 0; k < 4; ++k) {
      Panel& wall = walls[static_cast<size_t>(k)];
      wall.surface = near(wall_paint, 0.12);
      if (k == door_wall || !random_.nextBool(0.6)) continue;
      const int count = wallWidth(k) > 5 ? random_.nextInt(1, 2) : 1;
      for (int i = 0; i < count; ++i) {
        const double lo = 0.5 + (wallWidth(k) - 1.0) * i / count;
        const double hi = 0.5 + (wallWidth(k) - 1.0) * (i + 1) / count;
        wall.pockets.push_back(windowPocket(lo + 0.1, hi - 0.1, wall.surface));
        windows.push_back({k, wall.pockets.size() - 1});
      }
    }
    floor_paint_ = paint(0.12, 0.55);
    const auto faces = builder_.addRoom(size_, walls, floor_paint_, near({0.82, 0}, 0.08));
    floor_ = faces[4].front;
    ceiling_ = faces[5].front;
    for (size_t k = 0; k < 4; ++k) wall_faces_[k] = faces[k].front;
    for (const Pane& w : windows) {
      const Pocket& pocket = walls[static_cast<size_t>(w.wall)].pockets[w.pocket];
      const PanelFaces& frame = faces[static_cast<size_t>(w.wall)].pockets[w.pocket];
      if (frame.pockets.empty()) addFlatPanes(frame.front, pocket);
      for (size_t p = 0; p < frame.pockets.size(); ++p) {
        const Pocket& pane = pocket.bottom.pockets[p];
        addOutside(frame.pockets[p].front, {0, 0}, {pane.x1 - pane.x0, pane.y1 - pane.y0});
      }
      const Frame3 f = SceneBuilder::wallFrame(size_, w.wall);
      // Nothing tall in front of a window.
      taken_.push_back(boxIn(f, {pocket.x0, pocket.y0, 0}, {pocket.x1, pocket.y1, 0.45}));
      if (random_.nextBool(0.2)) addBlind(f, pocket);
      if (random_.nextBool(0.4)) addRadiator(f, pocket);
    }
    addDoor(door_wall);
    if (random_.nextBool(0.5)) addSkirting(door_wall);
    addFloorPattern();
  }

  struct PaneGrid {
    int columns, rows;
    double bar, w, h;
    Surface glass;
    [[nodiscard]] Vector2d corner(int i, int j) const {
      return {bar + i * (w + bar), bar + j * (h + bar)};
    }
  };

  PaneGrid paneGrid(double width, double height) {
    PaneGrid grid{};
    grid.columns = std::max(1, static_cast<int>(width / random_.next(0.5, 1.2)));
    grid.rows = random_.nextInt(1, 2);
    grid.bar = random_.next(0.05, 0.1);
    grid.w = (width - grid.bar * (grid.columns + 1)) / grid.columns;
    grid.h = (height - grid.bar * (grid.rows + 1)) / grid.rows;
    grid.glass = {0.1, random_.next(0.35, 0.75)};
    return grid;
  }

  /// A niche with a frame; the panes glow. In some windows they lie behind mullions, in others
  /// flush.
  Pocket windowPocket(double lo, double hi, const Surface& wall) {
    const double width = std::min(hi - lo, random_.next(0.9, 2.2));
    const double x0 = lo + (hi - lo - width) * random_.next(0, 1);
    const double y0 = random_.next(0.8, 1.0);
    const double y1 = std::min(size_.z() - 0.2, y0 + random_.next(1.0, 1.5));
    Pocket niche{x0, x0 + width, y0, y1, random_.next(0.1, 0.25), near(wall, 0.1), {}};
    niche.bottom.surface = paint(0.55, 0.85);
    if (random_.nextBool(0.6)) return niche;
    const PaneGrid grid = paneGrid(width, y1 - y0);
    const double depth = random_.next(0.015, 0.04);
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        const Vector2d at = Vector2d(x0, y0) + grid.corner(i, j);
        niche.bottom.pockets.push_back({at.x(),
                                        at.x() + grid.w,
                                        at.y(),
                                        at.y() + grid.h,
                                        depth,
                                        near(niche.bottom.surface, 0.1),
                                        plain(grid.glass)});
      }
    }
    return niche;
  }

  void addFlatPanes(int face, const Pocket& niche) {
    const PaneGrid grid = paneGrid(niche.x1 - niche.x0, niche.y1 - niche.y0);
    const Vector2d half(grid.w / 2, grid.h / 2);
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        const Vector2d at = grid.corner(i, j);
        builder_.addDecal(face, {DecalShape::kRectangle, at + half, half, 0, grid.glass});
        addOutside(face, at, at + 2 * half);
      }
    }
  }

  /// A hint of houses behind the pane [lo, hi] of a face.
  void addOutside(int face, const Vector2d& lo, const Vector2d& hi) {
    const double w = hi.x() - lo.x(), h = hi.y() - lo.y();
    if (!random_.nextBool(0.5) || w < 0.25 || h < 0.3) return;
    const Vector2d half{w * random_.next(0.15, 0.4), h * random_.next(0.15, 0.42)};
    const Vector2d centre =
        lo + Vector2d(random_.next(half.x() + 0.01, w - half.x() - 0.01), half.y() + 0.01);
    const double glow = random_.next(0.1, 0.3);
    builder_.addDecal(face, {DecalShape::kRectangle, centre, half, 0, {0.1, glow}});
    if (half.x() < 0.08) return;
    builder_.addDecal(face,
                      {DecalShape::kRectangle,
                       centre + Vector2d(0, half.y() * 0.2),
                       {half.x() * 0.35, half.y() * 0.3},
                       0,
                       {0.1, glow + 0.15}});
  }

  void addBlind(const Frame3& wall, const Pocket& niche) {
    const Surface slat = paint(0.4, 0.85);
    const double step = random_.next(0.035, 0.06), height = step * random_.next(0.4, 0.7);
    const double drop = (niche.y1 - niche.y0) * random_.next(0.2, 0.75);
    const int count = static_cast<int>(drop / step);
    for (int i = 0; i < count; ++i) {
      Frame3 f = wall;
      f.origin = wall.at(niche.x0 + 0.012, niche.y1 - 0.015 - height - i * step, -0.02);
      builder_.addSlab(
          f, niche.x1 - niche.x0 - 0.024, height, 0.004, plain(near(slat, 0.03)), slat);
    }
  }

  void addRadiator(const Frame3& wall, const Pocket& niche) {
    const double width = (niche.x1 - niche.x0) * random_.next(0.6, 1.0);
    const double height = std::min(niche.y0 - 0.25, random_.next(0.4, 0.6));
    const double depth = 0.07, y0 = 0.14;
    const double x0 = (niche.x0 + niche.x1 - width) / 2;
    Frame3 f = wall;
    f.origin = wall.at(x0, y0, kWallGap + depth);
    const Box3 box = boxIn(wall, {x0, y0, 0}, {x0 + width, y0 + height, kWallGap + depth});
    if (!isFree(box)) return;
    Panel front = plain(paint(0.6, 0.85));
    const int ribs = std::max(2, static_cast<int>(width / 0.16));
    for (int i = 0; i < ribs; ++i) {
      const double rib = width / ribs;
      front.pockets.push_back({rib * i + 0.025,
                               rib * (i + 1) - 0.025,
                               0.04,
                               height - 0.04,
                               0.015,
                               near(front.surface, 0.1),
                               plain(near(front.surface, 0.15))});
    }
    builder_.addSlab(f, width, height, depth, front, front.surface);
    taken_.push_back(box);
  }

  void addDoor(int wall) {
    const Frame3 frame = SceneBuilder::wallFrame(size_, wall);
    const double width = random_.next(0.85, 1.1), height = random_.next(2.0, 2.2);
    const double casing = random_.next(0.06, 0.1), proud = random_.next(0.03, 0.06);
    door_lo_ = random_.next(0.25, wallWidth(wall) - width - 0.25);
    door_hi_ = door_lo_ + width;
    Panel front = plain(paint(0.3, 0.85));
    Pocket leaf{casing,
                width - casing,
                0.02,
                height - casing,
                proud * 0.6,
                near(front.surface, 0.1),
                plain(anyPaint())};
    const int rows = random_.nextInt(1, 3), columns = random_.nextInt(1, 2);
    const double leaf_w = leaf.x1 - leaf.x0, leaf_h = leaf.y1 - leaf.y0, rail = 0.11;
    const double w = (leaf_w - rail * (columns + 1)) / columns;
    const double h = (leaf_h - rail * (rows + 1)) / rows;
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const double x = leaf.x0 + rail + i * (w + rail), y = leaf.y0 + rail + j * (h + rail);
        leaf.bottom.pockets.push_back({x,
                                       x + w,
                                       y,
                                       y + h,
                                       proud * 0.25,
                                       near(leaf.bottom.surface, 0.15),
                                       plain(near(leaf.bottom.surface, 0.25))});
      }
    }
    front.pockets.push_back(leaf);
    Frame3 f = frame;
    f.origin = frame.at(door_lo_, 0, proud);
    const SlabFaces slab = builder_.addSlab(f, width, height, proud, front, front.surface, true);
    if (random_.nextBool(0.6)) {
      const Surface line = near(leaf.bottom.surface, 0.5);
      for (const PanelFaces& panel : slab.front.pockets[0].pockets) {
        addMoulding(panel.front, {w, h}, line, near(leaf.bottom.surface, 0.25));
      }
    }
    // The handle, on the rail beside the panels.
    Frame3 handle = frame;
    handle.origin = frame.at(door_lo_ + leaf.x0 + 0.03, 1.02, proud - leaf.depth + 0.03);
    const Surface metal = paint(0.3, 0.8);
    builder_.addSlab(handle, 0.05, 0.02, 0.03, plain(metal), metal);
    taken_.push_back(boxIn(frame, {door_lo_, 0, 0}, {door_hi_, height, 0.8}));
  }

  /// A painted line along the border of a leaf or panel [0, size].
  void addMoulding(int face, const Vector2d& size, const Surface& line, const Surface& inside) {
    constexpr double kInset = 0.022, kLine = 0.012;
    const Vector2d half = size / 2;
    if (half.minCoeff() < 2 * (kInset + kLine)) return;
    builder_.addDecal(face, {DecalShape::kRectangle, half, half.array() - kInset, 0, line});
    builder_.addDecal(face,
                      {DecalShape::kRectangle, half, half.array() - kInset - kLine, 0, inside});
  }

  void addSkirting(int door_wall) {
    const double height = random_.next(0.06, 0.12), thick = 0.015, gap = 0.003;
    const Surface surface = paint(0.25, 0.85);
    const auto piece = [&](int wall, double x0, double x1) {
      if (x1 - x0 < 0.05) return;
      Frame3 f = SceneBuilder::wallFrame(size_, wall);
      f.origin = f.at(x0, 0, thick);
      builder_.addSlab(f, x1 - x0, height, thick, plain(surface), surface, true);
    };
    for (int k = 0; k < 4; ++k) {
      const double inset = k % 2 == 0 ? gap : thick + gap;
      const double lo = inset, hi = wallWidth(k) - inset;
      if (k == door_wall) {
        piece(k, lo, door_lo_ - gap);
        piece(k, door_hi_ + gap, hi);
      } else {
        piece(k, lo, hi);
      }
    }
  }

  /// Stripes, a chequered floor, planks or tiles with joints, as prints.
  void addFloorPattern() {
    const double kind = random_.next(0, 1);
    if (kind < 0.4) return;
    plain_floor_ = false;
    if (kind > 0.85) {
      addPlanks();
      return;
    }
    constexpr double kMarginToWall = 0.05;
    const Vector2d area(size_.x() - 2 * kMarginToWall, size_.y() - 2 * kMarginToWall);
    const bool tiles = kind > 0.72, stripes = kind < 0.55;
    const double wanted = random_.next(0.4, 0.85);
    const double joint = tiles ? random_.next(0.008, 0.02) : 0;
    const int rows = static_cast<int>(area.y() / (stripes ? 0.7 * wanted : wanted));
    const int columns = stripes ? 1 : static_cast<int>(area.x() / wanted);
    const Vector2d cell(area.x() / columns, area.y() / rows);
    const bool dark = floor_paint_.albedo < 0.3;
    const Surface tile = tiles  ? near(floor_paint_, 0.6)
                         : dark ? paint(0.4, 0.8)
                                : paint(0.04, 0.15);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        if (!tiles && (i + j) % 2 != 0) continue;
        builder_.addDecal(
            floor_,
            {DecalShape::kRectangle,
             {kMarginToWall + (i + 0.5) * cell.x(), kMarginToWall + (j + 0.5) * cell.y()},
             (cell.array() - joint) / 2,
             0,
             near(tile, 0.08)});
      }
    }
  }

  /// Boards along x with dark joints, their ends staggered from row to row.
  void addPlanks() {
    constexpr double kMarginToWall = 0.03;
    const Vector2d area(size_.x() - 2 * kMarginToWall, size_.y() - 2 * kMarginToWall);
    const int rows = static_cast<int>(area.y() / random_.next(0.14, 0.24));
    const double width = area.y() / rows, joint = random_.next(0.004, 0.008);
    const double longest = random_.next(1.8, 3.2);
    for (int j = 0; j < rows; ++j) {
      double x = 0;
      while (x < area.x()) {
        double end = x + (x > 0 ? longest : longest * random_.next(0.3, 1));
        if (end > area.x() - 0.3) end = area.x();
        const Vector2d centre((x + end) / 2, (j + 0.5) * width);
        const Vector2d half((end - x - joint) / 2, (width - joint) / 2);
        builder_.addDecal(floor_,
                          {DecalShape::kRectangle,
                           centre.array() + kMarginToWall,
                           half,
                           0,
                           {std::min(0.7, floor_paint_.albedo * random_.next(1.2, 1.6)), 0}});
        x = end;
      }
    }
  }

  void addRug() {
    if (!plain_floor_) return;
    const Vector2d half{random_.next(0.5, size_.x() * 0.3), random_.next(0.4, size_.y() * 0.3)};
    const Vector2d centre{size_.x() / 2 + random_.next(-0.3, 0.3),
                          size_.y() / 2 + random_.next(-0.3, 0.3)};
    const double angle = random_.nextBool(0.4) ? random_.next(-0.4, 0.4) : 0.0;
    builder_.addDecal(floor_, {DecalShape::kRectangle, centre, half, angle, anyPaint()});
    const double border = random_.next(0.03, 0.12);
    const Vector2d inner = half.array() - border;
    builder_.addDecal(floor_, {DecalShape::kRectangle, centre, inner, angle, anyPaint()});
    if (random_.nextBool(0.5)) {
      builder_.addDecal(floor_, {DecalShape::kEllipse, centre, inner * 0.5, angle, anyPaint()});
    }
  }

  // --- Furniture -------------------------------------------------------------------------------

  /// A place on the floor for a thing of this size (x right, y depth, z up, front at y = 0 looking
  /// to -y), with its back to a wall, in the open or turned freely. Reserves it.
  std::optional<Frame3> place(const Vector3d& size, double at_wall_probability) {
    for (int attempt = 0; attempt < 25; ++attempt) {
      Frame3 f;
      if (random_.nextBool(at_wall_probability)) {
        const int wall = random_.nextInt(0, 3);
        if (wallWidth(wall) < size.x() + 0.2) continue;
        const Frame3 w = SceneBuilder::wallFrame(size_, wall);
        const double x = random_.next(0.1, wallWidth(wall) - size.x() - 0.1);
        f.origin = w.at(x, 0, kWallGap + size.y());
        f.axes << w.axes.col(0), -w.axes.col(2), Vector3d::UnitZ();
      } else {
        const double yaw =
            random_.nextBool(0.5) ? random_.nextInt(0, 3) * M_PI / 2 : random_.next(0, 2 * M_PI);
        f.axes = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
        const Vector3d half = f.axes * Vector3d(size.x() / 2, size.y() / 2, 0);
        const Vector3d centre{
            random_.next(0.4, size_.x() - 0.4), random_.next(0.4, size_.y() - 0.4), 0};
        f.origin = centre - half;
      }
      const Box3 box = boxIn(f, {0, 0, 0}, size);
      const Vector3d room_lo(kWallGap - 0.001, kWallGap - 0.001, -1);
      const Vector3d room_hi(size_.x() - room_lo.x(), size_.y() - room_lo.y(), size_.z() + 1e-9);
      const bool inside =
          (box.lo.array() >= room_lo.array()).all() && (box.hi.array() <= room_hi.array()).all();
      if (!inside || !isFree(box)) continue;
      taken_.push_back(box);
      return f;
    }
    return std::nullopt;
  }

  void furnish() {
    if (random_.nextBool(0.3)) addColumn();
    if (random_.nextBool(0.55)) addBookshelf();
    if (random_.nextBool(0.8)) addTable();
    if (random_.nextBool(0.5)) addSofa();
    const int cabinets = random_.nextInt(1, 2);
    for (int i = 0; i < cabinets; ++i) addCabinet();
    const int wireframes = random_.nextInt(1, 3);
    for (int i = 0; i < wireframes; ++i) addWireframe();
    const int chairs = random_.nextInt(0, 2);
    for (int i = 0; i < chairs; ++i) addChair();
    const int boxes = random_.nextInt(2, 5);
    for (int i = 0; i < boxes; ++i) addCartons();
    if (random_.nextBool(0.4)) addStool();
    if (random_.nextBool(0.5)) addFloorLamp();
    const int balls = random_.nextInt(0, 3);
    for (int i = 0; i < balls; ++i) addBall();
  }

  /// From floor to ceiling.
  void addColumn() {
    const Vector3d size{random_.next(0.25, 0.5), random_.next(0.25, 0.5), size_.z()};
    const auto f = place(size, 0.7);
    if (f) builder_.addBox(*f, {0, 0, 0}, size, anyPaint());
  }

  /// A seat, a back and arms: large blocks.
  void addSofa() {
    const Vector3d size{random_.next(1.3, 2.1), random_.next(0.75, 0.95), random_.next(0.65, 0.9)};
    const auto f = place(size, 0.7);
    if (!f) return;
    const Surface cloth = anyPaint();
    const double arm = random_.next(0.14, 0.22), seat = random_.next(0.36, 0.44), gap = 0.004;
    const double back = size.y() - 0.22;
    builder_.addBox(*f, {0, 0, 0}, {arm, size.y(), seat + 0.15}, cloth);
    builder_.addBox(*f, {size.x() - arm, 0, 0}, {size.x(), size.y(), seat + 0.15}, cloth);
    builder_.addBox(
        *f, {arm + gap, 0.03, 0}, {size.x() - arm - gap, back - gap, seat}, near(cloth, 0.3));
    builder_.addBox(
        *f, {arm + gap, back, 0}, {size.x() - arm - gap, size.y(), size.z()}, near(cloth, 0.3));
  }

  /// Books (upright boxes) from x0 to x1 on a board; y is the front, +y the back.
  void addBooks(const Frame3& f,
                double x0,
                double x1,
                double y_front,
                double depth,
                double z,
                double height) {
    double x = x0 + random_.next(0.004, 0.03);
    const Surface series = anyPaint();
    const bool uniform = random_.nextBool(0.3);
    while (true) {
      const double w = random_.next(0.02, 0.075);
      if (x + w > x1 - 0.004) break;
      const double h = height * random_.next(0.6, 0.93);
      const double d = depth * random_.next(0.6, 0.92);
      const double y = y_front + depth * random_.next(0.01, 0.06);
      const Surface cover = uniform ? near(series, 0.15) : anyPaint();
      const SlabFaces book = builder_.addBox(f, {x, y, z}, {x + w, y + d, z + h}, cover);
      if (w > 0.03 && random_.nextBool(0.3)) {
        builder_.addDecal(book.front.front,
                          {DecalShape::kRectangle,
                           {w / 2, h * random_.next(0.6, 0.75)},
                           {w * 0.32, h * 0.12},
                           0,
                           anyPaint()});
      }
      x += w + random_.next(0.0015, 0.004);
      if (random_.nextBool(0.12)) x += random_.next(0.02, 0.12);
    }
  }

  void addBookshelf() {
    const int columns = random_.nextInt(1, 2), rows = random_.nextInt(2, 5);
    const double board = random_.next(0.018, 0.03), depth = random_.next(0.22, 0.36);
    const double w = random_.next(0.5, 0.95), h = random_.next(0.3, 0.48);
    const Vector3d size(columns * (w + board) + board,
                        depth,
                        std::min(size_.z() - 0.15, rows * (h + board) + board));
    const auto f = place(size, 1);
    if (!f) return;
    const double hh = (size.z() - board) / rows - board;
    const Surface wood = paint(0.15, 0.8);
    Panel front = plain(wood);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const double x = board + i * (w + board), z = board + j * (hh + board);
        front.pockets.push_back(
            {x, x + w, z, z + hh, depth - 0.012, near(wood, 0.12), plain(near(wood, 0.2))});
      }
    }
    builder_.addBox(*f, {0, 0, 0}, size, front, wood);
    for (const Pocket& p : front.pockets) {
      const double what = random_.next(0, 1);
      if (what < 0.45) {
        addBooks(
            *f, p.x0, p.x0 + (p.x1 - p.x0) * random_.next(0.25, 0.9), 0.01, depth - 0.03, p.y0, hh);
      } else if (what < 0.65) {
        const double a = random_.next(0.12, 0.3), b = hh * random_.next(0.4, 0.8);
        const double x = p.x0 + random_.next(0.02, p.x1 - p.x0 - a - 0.02);
        builder_.addBox(
            *f, {x, 0.03, p.y0}, {x + a, 0.03 + std::min(a, depth - 0.06), p.y0 + b}, anyPaint());
      } else if (what < 0.8) {
        const double r = std::min(0.09, hh * 0.4);
        builder_.addSphere(f->at((p.x0 + p.x1) / 2, depth / 2, p.y0 + r), r, anyPaint());
      }
    }
  }

  void addCabinet() {
    const Vector3d size{random_.next(0.5, 1.4), random_.next(0.38, 0.55), random_.next(0.6, 1.9)};
    const bool room_on_top = size.z() + kTopThings < size_.z();
    const auto f = place(size + Vector3d(0, 0, room_on_top ? kTopThings : 0), 1);
    if (!f) return;
    const Surface body = paint(0.15, 0.85);
    const bool drawers = random_.nextBool(0.5);
    const int columns = std::max(1, static_cast<int>(size.x() / 0.6));
    const int rows = drawers ? std::max(1, static_cast<int>(size.z() / 0.3)) : 1;
    Panel front = plain(body);
    const double rim = 0.03, foot = 0.06;
    const double w = (size.x() - rim * (columns + 1)) / columns;
    const double h = (size.z() - foot - rim * (rows + 1)) / rows;
    const double depth = random_.next(0.006, 0.015);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const double x = rim + i * (w + rim), z = foot + rim + j * (h + rim);
        front.pockets.push_back(
            {x, x + w, z, z + h, depth, near(body, 0.1), plain(near(body, 0.3))});
      }
    }
    const SlabFaces box = builder_.addBox(*f, {0, 0, 0}, size, front, body);
    if (random_.nextBool(0.5)) {
      const Surface line = near(body, 0.5), inside = near(body, 0.3);
      for (const PanelFaces& leaf : box.front.pockets)
        addMoulding(leaf.front, {w, h}, line, inside);
    }
    const Surface metal = paint(0.1, 0.8);
    for (const Pocket& p : front.pockets) {
      // A bar handle on the leaf, in touch with it.
      const double hw = drawers ? std::min(0.14, w * 0.4) : 0.015, hh = drawers ? 0.012 : 0.1;
      const double x = drawers ? (p.x0 + p.x1 - hw) / 2 : p.x1 - 0.05;
      const double z = drawers ? p.y0 + (p.y1 - p.y0) * 0.6 : (p.y0 + p.y1 - hh) / 2;
      builder_.addBox(*f, {x, -0.022, z}, {x + hw, depth, z + hh}, metal);
    }
    if (room_on_top) addTopThings(*f, size);
  }

  /// Things that stand on a flat top: [0, size.x] x [0, size.y] at z = size.z.
  void addTopThings(const Frame3& f, const Vector3d& size) {
    double x = random_.next(0.03, 0.2);
    const double y_max = size.y() - 0.02;
    while (true) {
      const int what = random_.nextInt(0, 4);
      const double w = random_.next(0.15, 0.45);
      if (x + w > size.x() - 0.03) break;
      const double z = size.z();
      const double d = std::min(w * random_.next(0.5, 1.2), y_max - 0.06);
      const double y = random_.next(0.03, y_max - d);
      if (what == 0) {
        // A stack, each one inside the one below.
        double inset = 0, level = z;
        const int count = random_.nextInt(2, 4);
        for (int i = 0; i < count && d - 2 * inset > 0.03; ++i) {
          const double thick = random_.next(0.015, 0.05);
          const Surface cover = anyPaint();
          builder_.addBox(f,
                          {x + inset, y + inset, level},
                          {x + w - inset, y + d - inset, level + thick},
                          cover);
          inset += random_.next(0.004, 0.02);
          level += thick;
        }
      } else if (what == 1) {
        const double r = std::min({w / 2, d / 2, 0.12});
        builder_.addSphere(f.at(x + w / 2, y + d / 2, z + r), r, anyPaint());
      } else if (what == 2) {
        const double h = random_.next(0.08, 0.35);
        const Surface cover = anyPaint();
        const SlabFaces box = builder_.addBox(f, {x, y, z}, {x + w, y + d, z + h}, cover);
        builder_.addDecal(
            box.front.front,
            {DecalShape::kRectangle, {w * 0.5, h * 0.5}, {w * 0.3, h * 0.25}, 0, near(cover, 0.6)});
      } else if (what == 3) {
        addScreen(f, x, x + w, (y + y + d) / 2, z);
      } else {
        addDeskLamp(f, x + w / 2, y + d / 2, z, std::min(w, d) / 2);
      }
      x += w + random_.next(0.1, 0.5);
    }
  }

  void addScreen(const Frame3& f, double x0, double x1, double y, double z) {
    const double w = x1 - x0, h = w * 0.62;
    const Surface body = paint(0.05, 0.3);
    builder_.addBox(f, {x0 + w * 0.3, y - 0.035, z}, {x1 - w * 0.3, y + 0.035, z + 0.012}, body);
    Panel front = plain(body);
    front.pockets.push_back(
        {0.012, w - 0.012, 0.02, h - 0.012, 0.004, body, plain({0.05, random_.next(0, 0.4)})});
    builder_.addBox(f, {x0, y - 0.012, z + 0.012}, {x1, y + 0.012, z + 0.012 + h}, front, body);
  }

  void addDeskLamp(const Frame3& f, double x, double y, double z, double room) {
    const Surface metal = anyPaint();
    const double base = std::min(0.08, room * 0.9), height = random_.next(0.2, 0.45);
    builder_.addBox(f, {x - base, y - base, z}, {x + base, y + base, z + 0.02}, metal);
    const double r = 0.05;
    builder_.addRod(f.at(x, y, z + 0.02), f.at(x, y, z + height + r * 0.5), 0.006, 4, metal);
    builder_.addSphere(f.at(x, y, z + height + r), r, {0.5, random_.next(0.2, 0.5)});
  }

  void addLegs(const Frame3& f,
               const Vector3d& size,
               double top,
               double thick,
               double inset,
               const Surface& s) {
    for (const double x : {inset, size.x() - inset - thick}) {
      for (const double y : {inset, size.y() - inset - thick}) {
        builder_.addBox(f, {x, y, 0}, {x + thick, y + thick, size.z() - top}, s);
      }
    }
  }

  void addTable() {
    const Vector3d size{random_.next(0.9, 1.8), random_.next(0.6, 0.95), random_.next(0.7, 0.76)};
    const auto f = place({size.x(), size.y(), size.z() + kTopThings}, 0.5);
    if (!f) return;
    const Surface wood = paint(0.12, 0.75);
    const double top = random_.next(0.02, 0.045);
    const SlabFaces board = builder_.addBox(*f, {0, 0, size.z() - top}, size, wood);
    const Surface leg_paint = near(wood, 0.3);
    const double leg_inset = random_.next(0.012, 0.06);
    addLegs(*f, size, top, random_.next(0.035, 0.07), leg_inset, leg_paint);
    if (random_.nextBool(0.5)) {
      addTopThings(*f, size);
      return;
    }
    // Sheets of paper with printed blocks; the top's 2D frame starts at its front left corner.
    const int sheets = std::min(4, static_cast<int>(size.x() / 0.4));
    for (int i = 0; i < sheets; ++i) {
      const Vector2d centre{0.2 + 0.4 * i + random_.next(-0.02, 0.02),
                            size.y() * random_.next(0.4, 0.6)};
      const double angle = random_.next(-0.5, 0.5);
      const Surface paper = paint(0.65, 0.9);
      const double scale = random_.next(0.75, 1.0);
      builder_.addDecal(
          board.top,
          {DecalShape::kRectangle, centre, Vector2d(0.105, 0.1485) * scale, angle, paper});
      const Vector2d ax(std::cos(angle), std::sin(angle)), ay(-ax.y(), ax.x());
      for (int line = -1; line <= 1; ++line) {
        builder_.addDecal(board.top,
                          {DecalShape::kRectangle,
                           centre + ay * (0.08 * line * scale) + ax * random_.next(-0.01, 0.01),
                           Vector2d{random_.next(0.04, 0.08), 0.022} * scale,
                           angle,
                           paint(0.1, 0.5)});
      }
    }
  }

  void addChair() {
    const Vector3d size{random_.next(0.4, 0.5), random_.next(0.4, 0.5), random_.next(0.42, 0.48)};
    const double back = random_.next(0.35, 0.55);
    const auto f = place({size.x(), size.y(), size.z() + back}, 0.15);
    if (!f) return;
    const Surface wood = anyPaint();
    const double top = 0.03, leg = random_.next(0.025, 0.04), inset = 0.012;
    builder_.addBox(*f, {0, 0, size.z() - top}, size, wood);
    addLegs(*f, size, top, leg, inset, near(wood, 0.15));
    const double y = size.y() - inset - leg, z = size.z();
    for (const double x : {inset, size.x() - inset - leg}) {
      builder_.addBox(*f, {x, y, z}, {x + leg, y + leg, z + back}, wood);
    }
    const int slats = random_.nextInt(1, 4);
    for (int i = 0; i < slats; ++i) {
      const double step = (back - 0.08) / slats;
      const double lo = z + 0.06 + step * i;
      builder_.addBox(*f,
                      {inset + leg, y + leg * 0.3, lo},
                      {size.x() - inset - leg, y + leg * 0.7, lo + step * 0.6},
                      near(wood, 0.2));
    }
  }

  void addCartons() {
    const Vector3d size{random_.next(0.3, 0.8), random_.next(0.3, 0.6), random_.next(0.25, 0.7)};
    const bool stacked = random_.nextBool(0.4);
    const auto f = place({size.x(), size.y(), size.z() * (stacked ? 1.8 : 1.0)}, 0.4);
    if (!f) return;
    const Surface card = paint(0.2, 0.7);
    const SlabFaces box = builder_.addBox(*f, {0, 0, 0}, size, card);
    const double tape = random_.next(0.02, 0.04);
    builder_.addDecal(box.top,
                      {DecalShape::kRectangle,
                       {size.x() / 2, size.y() / 2},
                       {size.x() * 0.49, tape},
                       0,
                       near(card, 0.5)});
    if (random_.nextBool(0.6)) {
      builder_.addDecal(box.front.front,
                        {DecalShape::kRectangle,
                         {size.x() * 0.6, size.z() * 0.55},
                         {size.x() * 0.2, size.z() * 0.2},
                         0,
                         paint(0.6, 0.9)});
    }
    if (!stacked) return;
    const double inset = random_.next(0.015, 0.06);
    builder_.addBox(*f,
                    {inset, inset, size.z()},
                    {size.x() - inset, size.y() - inset, size.z() * 1.75},
                    near(card, 0.5));
  }

  void addStool() {
    const double r = random_.next(0.16, 0.35), height = random_.next(0.42, 0.75);
    const auto f = place({2 * r, 2 * r, height}, 0.2);
    if (!f) return;
    builder_.addDisc(f->at(r, r, height - 0.002), Vector3d::UnitZ(), r, anyPaint());
    const Surface metal = paint(0.1, 0.7);
    for (int k = 0; k < 4; ++k) {
      const double a = M_PI / 4 + k * M_PI / 2;
      const Vector3d dir(std::cos(a), std::sin(a), 0);
      builder_.addRod(f->at(r + 0.9 * r * dir.x(), r + 0.9 * r * dir.y(), 0.006),
                      f->at(r + 0.6 * r * dir.x(), r + 0.6 * r * dir.y(), height - 0.012),
                      0.011,
                      8,
                      metal);
    }
  }

  void addFloorLamp() {
    const double height = random_.next(1.3, 1.8), half = 0.15;
    const auto f = place({2 * half, 2 * half, height}, 0.5);
    if (!f) return;
    const Surface metal = paint(0.05, 0.6);
    builder_.addBox(*f, {half - 0.13, half - 0.13, 0}, {half + 0.13, half + 0.13, 0.025}, metal);
    const double r = random_.next(0.1, 0.14);
    builder_.addRod(f->at(half, half, 0.025), f->at(half, half, height - 1.5 * r), 0.012, 8, metal);
    builder_.addSphere(f->at(half, half, height - r), r, {0.6, random_.next(0.25, 0.5)});
  }

  void addBall() {
    const double r = random_.next(0.06, 0.25);
    const auto f = place({2 * r, 2 * r, 2 * r}, 0.3);
    if (!f) return;
    builder_.addSphere(f->at(r, r, r), r, anyPaint());
  }

  /// Free-standing rods between nodes; small spheres cover the joints.
  void addWireframe() {
    const Vector3d size{random_.next(0.5, 1.1), random_.next(0.4, 0.9), random_.next(0.6, 1.7)};
    const auto f = place(size, 0.1);
    if (!f) return;
    const double radius = random_.next(0.0015, 0.005);
    const Surface metal = random_.nextBool(0.5) ? paint(0.03, 0.15) : paint(0.5, 0.9);
    const double ball = 4.2 * radius;  // No ball is larger.
    std::vector<Vector3d> nodes;
    const auto node = [&](double x, double y, double z) {
      // Nodes stay inside the reserved box and on the floor.
      nodes.push_back(f->at(ball + x * (size.x() - 2 * ball),
                            ball + y * (size.y() - 2 * ball),
                            ball + z * (size.z() - 2 * ball)));
    };
    std::vector<std::array<size_t, 2>> links;
    if (random_.nextBool(0.65)) {
      // A frame of storeys, with a few diagonals: no two of them in one plane cross.
      const int storeys = random_.nextInt(1, 3);
      for (int s = 0; s <= storeys; ++s) {
        const double z = static_cast<double>(s) / storeys;
        const double shrink = 0.12 * s * random_.next(0, 1);
        node(shrink, shrink, z);
        node(1 - shrink, shrink, z);
        node(1 - shrink, 1 - shrink, z);
        node(shrink, 1 - shrink, z);
        const auto base = static_cast<size_t>(4 * s);
        for (size_t k = 0; k < 4; ++k) {
          links.push_back({base + k, base + (k + 1) % 4});
          if (s == 0) continue;
          links.push_back({base + k - 4, base + k});
          if (random_.nextBool(0.4)) links.push_back({base + k - 4, base + (k + 1) % 4});
        }
      }
    } else {
      // A double pyramid over a polygon.
      const int corners = random_.nextInt(3, 6);
      node(0.5, 0.5, 0);
      node(0.5, 0.5, 1);
      const double turn = random_.next(0, 1), level = random_.next(0.3, 0.7);
      for (int k = 0; k < corners; ++k) {
        const double a = 2 * M_PI * (k + turn) / corners;
        node(0.5 + 0.5 * std::cos(a), 0.5 + 0.5 * std::sin(a), level);
        const auto at = static_cast<size_t>(k + 2);
        links.push_back({0, at});
        links.push_back({1, at});
        links.push_back({at, static_cast<size_t>((k + 1) % corners + 2)});
      }
    }
    builder_.addJointedRods(nodes, links, radius, metal);
  }

  // --- On walls and ceiling --------------------------------------------------------------------

  void addWallThings() {
    for (int wall = 0; wall < 4; ++wall) {
      const int count = random_.nextInt(2, 4);
      for (int i = 0; i < count; ++i) {
        const int what = random_.nextInt(0, 6);
        if (what <= 1) {
          addPicture(wall);
        } else if (what == 2) {
          addWallBoard(wall);
        } else if (what <= 5) {
          addPoster(wall);
        } else {
          addSwitch(wall);
        }
      }
    }
  }

  /// A free rectangle on a wall, [x, x + w] x [y, y + h], out to `depth`. Reserves it.
  std::optional<Vector2d> placeOnWall(
      int wall, double w, double h, double depth, double y_lo, double y_hi) {
    if (w > wallWidth(wall) - 0.3 || y_hi < y_lo) return std::nullopt;
    const Frame3 frame = SceneBuilder::wallFrame(size_, wall);
    for (int attempt = 0; attempt < 12; ++attempt) {
      const double x = random_.next(0.15, wallWidth(wall) - w - 0.15), y = random_.next(y_lo, y_hi);
      const Box3 box = boxIn(frame, {x, y, 0}, {x + w, y + h, depth});
      if (!isFree(box)) continue;
      taken_.push_back(box);
      return Vector2d(x, y);
    }
    return std::nullopt;
  }

  /// A framed picture, its canvas recessed or flush.
  void addPicture(int wall) {
    const double w = random_.next(0.35, 1.2), h = w * random_.next(0.6, 1.4);
    const double thick = random_.next(0.01, 0.03);
    const double rim = std::min(random_.next(0.03, 0.1), 0.2 * h);
    if (h > 1.1) return;
    const auto at = placeOnWall(wall, w, h, thick, 0.9, size_.z() - h - 0.2);
    if (!at) return;
    Frame3 f = SceneBuilder::wallFrame(size_, wall);
    f.origin = f.at(at->x(), at->y(), thick);
    Panel front = plain(anyPaint());
    const Vector2d inner(w / 2 - rim, h / 2 - rim);
    if (random_.nextBool(0.35)) {
      front.pockets.push_back(
          {rim, w - rim, rim, h - rim, thick * 0.4, near(front.surface, 0.1), plain(anyPaint())});
      const SlabFaces faces = builder_.addSlab(f, w, h, thick, front, front.surface);
      addPrint(faces.front.pockets[0].front, inner, inner * 0.85);
      return;
    }
    const SlabFaces faces = builder_.addSlab(f, w, h, thick, front, front.surface);
    const Vector2d centre(w / 2, h / 2);
    builder_.addDecal(faces.front.front, {DecalShape::kRectangle, centre, inner, 0, anyPaint()});
    if (random_.nextBool(0.7)) {
      addBorderLine(faces.front.front, centre, inner.array() - 0.05 * inner.minCoeff());
    }
    addPrint(faces.front.front, centre, inner * 0.85);
  }

  /// A rectangle with a line of a few millimetres around it, nested in whatever is there.
  void addBorderLine(int face, const Vector2d& centre, const Vector2d& half) {
    const double line = half.minCoeff() * random_.next(0.02, 0.05);
    const Surface paint_inside = anyPaint();
    builder_.addDecal(face, {DecalShape::kRectangle, centre, half, 0, anyPaint()});
    builder_.addDecal(face, {DecalShape::kRectangle, centre, half.array() - line, 0, paint_inside});
  }

  /// Abstract art: cells of a coarse grid, each with a shape.
  void addPrint(int face, const Vector2d& centre, const Vector2d& half) {
    const int columns = random_.nextInt(1, 2), rows = random_.nextInt(1, 2);
    const Vector2d cell(2 * half.x() / columns, 2 * half.y() / rows);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        if (random_.nextBool(0.25)) continue;
        const Vector2d c = centre - half + Vector2d((i + 0.5) * cell.x(), (j + 0.5) * cell.y());
        if (random_.nextBool(0.3)) {
          builder_.addDecal(
              face, {DecalShape::kEllipse, c, cell * random_.next(0.25, 0.45), 0, anyPaint()});
        } else if (random_.nextBool(0.4)) {
          // Turned, within the circle that the cell holds.
          const double r = 0.45 * cell.minCoeff(), a = random_.next(0.3, 1.2);
          builder_.addDecal(face,
                            {DecalShape::kRectangle,
                             c,
                             {r * std::cos(a), r * std::sin(a)},
                             random_.next(0, M_PI),
                             anyPaint()});
        } else {
          builder_.addDecal(
              face,
              {DecalShape::kRectangle,
               c,
               Vector2d{cell.x() * random_.next(0.2, 0.45), cell.y() * random_.next(0.2, 0.45)},
               0,
               anyPaint()});
        }
      }
    }
  }

  /// Printed on the wall itself.
  void addPoster(int wall) {
    const double w = random_.next(0.4, 1.3), h = w * random_.next(0.6, 1.3);
    const auto at = placeOnWall(wall, w, h, 0.005, 0.7, size_.z() - h - 0.15);
    if (!at) return;
    const Vector2d centre = *at + Vector2d(w / 2, h / 2);
    const int face = wall_faces_[static_cast<size_t>(wall)];
    builder_.addDecal(face, {DecalShape::kRectangle, centre, {w / 2, h / 2}, 0, anyPaint()});
    if (random_.nextBool(0.6)) {
      const double margin = 0.02 * std::min(w, h);
      addBorderLine(face, centre, {w / 2 - margin, h / 2 - margin});
    }
    addPrint(face, centre, Vector2d(w, h) * 0.44);
  }

  /// A board with things on it.
  void addWallBoard(int wall) {
    const double w = random_.next(0.5, 1.4), depth = random_.next(0.16, 0.28),
                 thick = random_.next(0.018, 0.035);
    const double above = 0.36;
    const auto at =
        placeOnWall(wall, w, thick + above, depth + 0.02, 0.9, size_.z() - above - 0.25);
    if (!at) return;
    const Frame3 f = SceneBuilder::wallFrame(size_, wall);
    Frame3 shelf;
    shelf.origin = f.at(at->x(), at->y(), depth);
    shelf.axes << f.axes.col(0), -f.axes.col(2), f.axes.col(1);
    const Surface wood = anyPaint();
    builder_.addBox(shelf, {0, 0, 0}, {w, depth, thick}, wood);
    addBooks(shelf, 0.02, w * random_.next(0.4, 0.97), 0.015, depth - 0.04, thick, above - 0.04);
  }

  void addSwitch(int wall) {
    const double s = 0.085, thick = 0.012;
    const auto at = placeOnWall(wall, s, s, thick, random_.nextBool(0.5) ? 0.25 : 1.05, 1.15);
    if (!at) return;
    Frame3 f = SceneBuilder::wallFrame(size_, wall);
    f.origin = f.at(at->x(), at->y(), thick);
    Panel front = plain(paint(0.7, 0.9));
    front.pockets.push_back(
        {0.02, s - 0.02, 0.02, s - 0.02, 0.004, front.surface, plain(near(front.surface, 0.1))});
    builder_.addSlab(f, s, s, thick, front, front.surface);
  }

  void addCeilingLamp() {
    const Vector2d centre{size_.x() * random_.next(0.35, 0.65),
                          size_.y() * random_.next(0.35, 0.65)};
    if (random_.nextBool(0.5)) {
      // A ball on a thin rod.
      const double r = random_.next(0.1, 0.2), drop = random_.next(0.2, 0.5);
      const Vector3d ball(centre.x(), centre.y(), size_.z() - drop - r);
      const Box3 box{ball.array() - r, Vector3d(ball.x() + r, ball.y() + r, size_.z())};
      if (!isFree(box)) return;
      taken_.push_back(box);
      builder_.addRod({centre.x(), centre.y(), ball.z() + r * 0.9},
                      {centre.x(), centre.y(), size_.z()},
                      0.005,
                      8,
                      paint(0.05, 0.5));
      builder_.addSphere(ball, r, {0.7, random_.next(0.2, 0.4)});
      return;
    }
    // Flat panels, printed: the ceiling's 2D frame is that of its first corner, e1 along y.
    const int count = random_.nextInt(1, 3);
    for (int i = 0; i < count; ++i) {
      const Vector2d c(size_.y() * (i + 0.5) / count, centre.x());
      builder_.addDecal(ceiling_,
                        {DecalShape::kRectangle,
                         c,
                         {random_.next(0.1, 0.3), random_.next(0.3, 0.6)},
                         0,
                         {0.1, random_.next(0.6, 0.9)}});
    }
  }

  void addLights() {
    Scene& scene = builder_.scene;
    scene.ambient_up = random_.next(0.34, 0.5);
    scene.ambient_down = random_.next(0.2, 0.36);
    Light sun;
    const double a = random_.next(0, 2 * M_PI);
    sun.place = Vector3d{std::cos(a), std::sin(a), random_.next(0.3, 1.0)}.normalized();
    sun.strength = random_.next(0.3, 0.55);
    scene.lights.push_back(sun);
    const int lamps = random_.nextInt(1, 2);
    for (int i = 0; i < lamps; ++i) {
      Light lamp;
      lamp.kind = Light::Kind::kPoint;
      lamp.place = {size_.x() * random_.next(0.2, 0.8),
                    size_.y() * random_.next(0.2, 0.8),
                    size_.z() - random_.next(0.4, 0.9)};
      lamp.strength = random_.next(0.3, 0.6);
      lamp.half_distance = random_.next(1.5, 4);
      scene.lights.push_back(lamp);
    }
    // A photographer's exposure: the six faces of the room get this much light on average.
    double mean = 0;
    for (int k = 0; k < 3; ++k) {
      for (const double side : {0.0, 1.0}) {
        Vector3d point = size_ / 2, normal = Vector3d::Zero();
        point[k] = side * size_[k];
        normal[k] = 1 - 2 * side;
        mean += irradiance(scene, point, normal) / 6;
      }
    }
    const double scale = random_.next(0.75, 1.05) / mean;
    scene.ambient_up *= scale;
    scene.ambient_down *= scale;
    for (Light& light : scene.lights) light.strength *= scale;
  }

  Pose makePose() {
    Vector3d position = size_ / 2;
    // The best of several places: clear of everything, with room ahead.
    double best = -1;
    double yaw = 0;
    for (int attempt = 0; attempt < 60; ++attempt) {
      const Vector3d p{random_.next(0.4, size_.x() - 0.4),
                       random_.next(0.4, size_.y() - 0.4),
                       random_.next(0.8, std::min(2.1, size_.z() - 0.4))};
      const double y = random_.next(0, 2 * M_PI);
      double clear = 1;
      for (const Box3& box : taken_) clear = std::min(clear, box.distanceTo(p));
      const Vector3d dir(std::cos(y), std::sin(y), 0);
      double ahead = 10;
      for (int k = 0; k < 2; ++k) {
        const double wall = dir[k] > 0 ? size_[k] : 0;
        if (std::abs(dir[k]) > 1e-6) ahead = std::min(ahead, (wall - p[k]) / dir[k]);
      }
      const double score = std::min(clear, 0.4) + 0.1 * std::min(ahead, 2.5);
      if (score > best) {
        best = score;
        position = p;
        yaw = y;
        if (clear >= 0.4 && ahead >= 2.5) break;
      }
    }
    const double pitch = random_.next(-0.45, 0.3);
    const Vector3d dir(
        std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
    return lookAt(position, position + dir, random_.next(-0.3, 0.3));
  }

  Random random_;
  SceneBuilder builder_;
  Vector3d size_{0, 0, 0};
  Surface floor_paint_;
  int floor_ = -1, ceiling_ = -1;
  std::array<int, 4> wall_faces_{};
  bool plain_floor_ = true;
  double door_lo_ = 0, door_hi_ = 0;
  std::vector<Box3> taken_;
};

}  // namespace

SceneView makeRoom(uint64_t seed, uint64_t index) {
  return RoomMaker(seed, index).make();
}

}  // namespace dlsd
