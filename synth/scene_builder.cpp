#include "synth/scene_builder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace dlsd {
namespace {

/// Tolerances for "the same line": float-rounded vertices up to 16 m from the origin are 1e-6 m
/// off.
constexpr double kSameLine = 3e-6;

double distanceToLine(const Eigen::Vector3d& p, const Edge& line) {
  const Eigen::Vector3d u = (line.to - line.from).normalized();
  const Eigen::Vector3d d = p - line.from;
  return (d - u * u.dot(d)).norm();
}

/// Both edges lie on one infinite line: the ends of the shorter one are on the longer one's line.
bool sameLine(const Edge& a, const Edge& b) {
  const bool a_longer = (a.to - a.from).squaredNorm() >= (b.to - b.from).squaredNorm();
  const Edge& line = a_longer ? a : b;
  const Edge& other = a_longer ? b : a;
  return distanceToLine(other.from, line) < kSameLine && distanceToLine(other.to, line) < kSameLine;
}

std::vector<double> cuts(double lo, double hi, const std::vector<Pocket>& pockets, bool along_x) {
  std::vector<double> values{lo, hi};
  for (const Pocket& p : pockets) {
    values.push_back(along_x ? p.x0 : p.y0);
    values.push_back(along_x ? p.x1 : p.y1);
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

bool inPocket(double x, double y, const std::vector<Pocket>& pockets) {
  return std::any_of(pockets.begin(), pockets.end(), [&](const Pocket& p) {
    return x > p.x0 && x < p.x1 && y > p.y0 && y < p.y1;
  });
}

}  // namespace

SceneBuilder::SceneBuilder(Scene base) : scene(std::move(base)) {
  for (const SolidPiece& piece : scene.pieces) solid_ = std::max(solid_, piece.solid + 1);
}

int SceneBuilder::addVertex(const Eigen::Vector3d& p) {
  scene.vertices.emplace_back(p.cast<float>());
  return static_cast<int>(scene.vertices.size()) - 1;
}

int SceneBuilder::addSurface(const Surface& surface) {
  scene.surfaces.push_back(surface);
  return static_cast<int>(scene.surfaces.size()) - 1;
}

int SceneBuilder::startFace(const Surface& surface, const Corners& corners) {
  const auto vertex = [&](int i) {
    return Eigen::Vector3d(
        scene.vertices[static_cast<size_t>(corners[static_cast<size_t>(i)])].cast<double>());
  };
  Face face;
  face.origin = vertex(0);
  // The diagonals' normal: all four rounded corners count alike.
  face.normal = (vertex(2) - vertex(0)).cross(vertex(3) - vertex(1)).normalized();
  const Eigen::Vector3d d = vertex(1) - vertex(0);
  face.e1 = (d - face.normal * face.normal.dot(d)).normalized();
  face.e2 = face.normal.cross(face.e1);
  face.surface = addSurface(surface);
  scene.faces.push_back(std::move(face));
  return static_cast<int>(scene.faces.size()) - 1;
}

int SceneBuilder::addQuad(const Surface& surface, const Corners& corners) {
  const int face = startFace(surface, corners);
  scene.triangles.push_back({{corners[0], corners[1], corners[2]}, face});
  scene.triangles.push_back({{corners[0], corners[2], corners[3]}, face});
  return face;
}

void SceneBuilder::addEdge(int v0, int v1, int face0, int face1, int rod) {
  Edge edge;
  edge.from = scene.vertices[static_cast<size_t>(v0)].cast<double>();
  edge.to = scene.vertices[static_cast<size_t>(v1)].cast<double>();
  edge.face0 = face0;
  edge.face1 = face1;
  edge.rod = rod;
  scene.edges.push_back(edge);
}

PanelFaces SceneBuilder::addPanel(
    const Frame3& frame, double z, double width, double height, const Panel& panel) {
  struct Rect {
    double x0, x1, y0, y1;
  };
  // A pocket's bottom is a panel in the same frame, so the work is done on rectangles.
  const auto add =
      [&](const auto& self, const Rect& r, double depth_z, const Panel& p) -> PanelFaces {
    PanelFaces faces;
    const std::vector<double> xs = cuts(r.x0, r.x1, p.pockets, true);
    const std::vector<double> ys = cuts(r.y0, r.y1, p.pockets, false);
    const size_t columns = xs.size();
    std::vector<int> grid;
    for (const double y : ys) {
      for (const double x : xs) grid.push_back(addVertex(frame.at(x, y, depth_z)));
    }
    const auto node = [&](size_t i, size_t j) { return grid[j * columns + i]; };
    const size_t i_end = columns - 1, j_end = ys.size() - 1;
    faces.front =
        startFace(p.surface, {node(0, 0), node(i_end, 0), node(i_end, j_end), node(0, j_end)});
    for (size_t j = 0; j < j_end; ++j) {
      for (size_t i = 0; i < i_end; ++i) {
        if (inPocket((xs[i] + xs[i + 1]) / 2, (ys[j] + ys[j + 1]) / 2, p.pockets)) continue;
        scene.triangles.push_back({{node(i, j), node(i + 1, j), node(i + 1, j + 1)}, faces.front});
        scene.triangles.push_back({{node(i, j), node(i + 1, j + 1), node(i, j + 1)}, faces.front});
      }
    }
    for (const Pocket& pocket : p.pockets) {
      const double z_bottom = depth_z - pocket.depth;
      const auto corners = [&](double zz) -> Corners {
        return {addVertex(frame.at(pocket.x0, pocket.y0, zz)),
                addVertex(frame.at(pocket.x1, pocket.y0, zz)),
                addVertex(frame.at(pocket.x1, pocket.y1, zz)),
                addVertex(frame.at(pocket.x0, pocket.y1, zz))};
      };
      const Corners t = corners(depth_z), b = corners(z_bottom);
      // Bottom, right, top, left side; each looks into the pocket.
      const std::array<int, 4> side{addQuad(pocket.sides, {t[0], t[1], b[1], b[0]}),
                                    addQuad(pocket.sides, {t[1], t[2], b[2], b[1]}),
                                    addQuad(pocket.sides, {t[2], t[3], b[3], b[2]}),
                                    addQuad(pocket.sides, {t[3], t[0], b[0], b[3]})};
      const PanelFaces bottom =
          self(self, {pocket.x0, pocket.x1, pocket.y0, pocket.y1}, z_bottom, pocket.bottom);
      for (size_t k = 0; k < 4; ++k) {
        const size_t next = (k + 1) % 4;
        addEdge(t[k], t[next], faces.front, side[k]);
        addEdge(b[k], b[next], side[k], bottom.front);
        addEdge(t[next], b[next], side[k], side[next]);
      }
      faces.pockets.push_back(bottom);
    }
    return faces;
  };
  return add(add, {0, width, 0, height}, z, panel);
}

void SceneBuilder::addPieces(const Frame3& frame,
                             double x0,
                             double x1,
                             double y0,
                             double y1,
                             double z_front,
                             double z_back,
                             const Panel& panel) {
  const std::vector<double> xs = cuts(x0, x1, panel.pockets, true);
  const std::vector<double> ys = cuts(y0, y1, panel.pockets, false);
  for (size_t j = 0; j + 1 < ys.size(); ++j) {
    for (size_t i = 0; i + 1 < xs.size(); ++i) {
      const double x = (xs[i] + xs[i + 1]) / 2, y = (ys[j] + ys[j + 1]) / 2;
      if (inPocket(x, y, panel.pockets)) continue;
      scene.pieces.push_back(
          {frame.at(x, y, (z_front + z_back) / 2),
           frame.axes,
           {(xs[i + 1] - xs[i]) / 2, (ys[j + 1] - ys[j]) / 2, (z_front - z_back) / 2},
           solid_});
    }
  }
  for (const Pocket& p : panel.pockets) {
    addPieces(frame, p.x0, p.x1, p.y0, p.y1, z_front - p.depth, z_back, p.bottom);
  }
}

SlabFaces SceneBuilder::addSlab(const Frame3& frame,
                                double width,
                                double height,
                                double depth,
                                const Panel& front,
                                const Surface& sides,
                                bool in_floor_corner) {
  SlabFaces faces{};
  faces.front = addPanel(frame, 0, width, height, front);
  const auto corners = [&](double z) -> Corners {
    return {addVertex(frame.at(0, 0, z)),
            addVertex(frame.at(width, 0, z)),
            addVertex(frame.at(width, height, z)),
            addVertex(frame.at(0, height, z))};
  };
  const Corners f = corners(0), b = corners(-depth);
  faces.bottom = addQuad(sides, {f[0], b[0], b[1], f[1]});
  faces.right = addQuad(sides, {f[1], b[1], b[2], f[2]});
  faces.top = addQuad(sides, {f[3], f[2], b[2], b[3]});
  faces.left = addQuad(sides, {f[3], b[3], b[0], f[0]});
  faces.back = addQuad(sides, {b[1], b[0], b[3], b[2]});
  const std::array<int, 4> side{faces.bottom, faces.right, faces.top, faces.left};
  for (size_t k = 0; k < 4; ++k) {
    const size_t next = (k + 1) % 4;
    addEdge(f[k], f[next], faces.front.front, side[k]);
    if (!(in_floor_corner && k == 0)) addEdge(b[k], b[next], side[k], faces.back);
    addEdge(f[next], b[next], side[k], side[next]);
  }
  addPieces(frame, 0, width, 0, height, 0, -depth, front);
  ++solid_;
  return faces;
}

SlabFaces SceneBuilder::addBox(const Frame3& frame,
                               const Eigen::Vector3d& lo,
                               const Eigen::Vector3d& hi,
                               const Panel& front,
                               const Surface& sides) {
  Frame3 slab;
  slab.origin = frame.at(lo.x(), lo.y(), lo.z());
  slab.axes << frame.axes.col(0), frame.axes.col(2), -frame.axes.col(1);
  return addSlab(slab, hi.x() - lo.x(), hi.z() - lo.z(), hi.y() - lo.y(), front, sides);
}

SlabFaces SceneBuilder::addBox(const Frame3& frame,
                               const Eigen::Vector3d& lo,
                               const Eigen::Vector3d& hi,
                               const Surface& surface) {
  return addBox(frame, lo, hi, Panel{surface, {}}, surface);
}

void SceneBuilder::addSolid(const Frame3& frame,
                            const std::vector<Eigen::Vector3d>& vertices,
                            const std::vector<std::vector<int>>& loops,
                            const std::vector<Surface>& surfaces) {
  Eigen::Vector3d lo = vertices.front(), hi = lo;
  std::vector<int> index;
  for (const Eigen::Vector3d& v : vertices) {
    index.push_back(addVertex(frame.at(v.x(), v.y(), v.z())));
    lo = lo.cwiseMin(v);
    hi = hi.cwiseMax(v);
  }
  std::map<std::pair<int, int>, int> first_face;  // Of an edge, by its vertices in ascending order.
  for (size_t k = 0; k < loops.size(); ++k) {
    std::vector<int> loop;
    for (const int v : loops[k]) loop.push_back(index[static_cast<size_t>(v)]);
    const size_t n = loop.size();
    const int face = startFace(surfaces[k], {loop[0], loop[1], loop[n / 2], loop[n - 1]});
    for (size_t i = 1; i + 1 < n; ++i) {
      scene.triangles.push_back({{loop[0], loop[i], loop[i + 1]}, face});
    }
    for (size_t i = 0; i < n; ++i) {
      const int a = loop[i], b = loop[(i + 1) % n];
      const auto [it, is_first] = first_face.try_emplace(std::minmax(a, b), face);
      if (!is_first) addEdge(it->first.first, it->first.second, it->second, face);
    }
  }
  const Eigen::Vector3d middle = (lo + hi) / 2;
  scene.pieces.push_back(
      {frame.at(middle.x(), middle.y(), middle.z()), frame.axes, (hi - lo) / 2, solid_++});
}

void SceneBuilder::addRod(const Eigen::Vector3d& from,
                          const Eigen::Vector3d& to,
                          double radius,
                          int sides,
                          const Surface& surface) {
  const Eigen::Vector3d axis = (to - from).normalized();
  const Eigen::Vector3d x = axis.unitOrthogonal(), y = axis.cross(x);
  const auto n = static_cast<size_t>(sides);
  std::vector<int> a(n), b(n);
  for (size_t k = 0; k < n; ++k) {
    const double phi = 2 * M_PI * (static_cast<double>(k) + 0.5) / sides;
    const Eigen::Vector3d offset = radius * (std::cos(phi) * x + std::sin(phi) * y);
    a[k] = addVertex(from + offset);
    b[k] = addVertex(to + offset);
  }
  const int rod = static_cast<int>(scene.rods.size());
  const int first_face = static_cast<int>(scene.faces.size());
  for (size_t k = 0; k < n; ++k) {
    const size_t next = (k + 1) % n;
    addQuad(surface, {a[k], a[next], b[next], b[k]});
  }
  // Caps: the corners used for the plane are a quarter turn apart.
  const size_t q = n / 4;
  const int cap_a = startFace(surface, {a[0], a[3 * q], a[2 * q], a[q]});
  const int cap_b = startFace(surface, {b[0], b[q], b[2 * q], b[3 * q]});
  for (size_t k = 1; k + 1 < n; ++k) {
    scene.triangles.push_back({{a[0], a[k + 1], a[k]}, cap_a});
    scene.triangles.push_back({{b[0], b[k], b[k + 1]}, cap_b});
  }
  for (size_t k = 0; k < n; ++k) {
    const size_t next = (k + 1) % n;
    const int side = first_face + static_cast<int>(k);
    addEdge(a[next], b[next], side, first_face + static_cast<int>(next), rod);
    addEdge(a[k], a[next], cap_a, side, rod);
    addEdge(b[k], b[next], cap_b, side, rod);
  }
  Edge centre;
  centre.from = from;
  centre.to = to;
  centre.source = EdgeSource::kRodCentre;
  centre.rod = rod;
  scene.edges.push_back(centre);
  scene.rods.push_back({from, to, radius, first_face, sides + 2});
  const double half = radius * std::cos(M_PI / sides);
  Eigen::Matrix3d axes;
  axes << x, y, axis;
  scene.pieces.push_back({(from + to) / 2, axes, {half, half, (to - from).norm() / 2}, solid_++});
}

void SceneBuilder::addRoundRod(const Eigen::Vector3d& from,
                               const Eigen::Vector3d& to,
                               double radius,
                               const Surface& surface) {
  Rod rod;
  rod.from = roundToFloat(from);
  rod.to = roundToFloat(to);
  rod.radius = static_cast<double>(static_cast<float>(radius));
  rod.first_face = static_cast<int>(scene.faces.size());
  rod.face_count = 0;
  rod.surface = addSurface(surface);
  rod.first_disc = static_cast<int>(scene.discs.size());
  const Eigen::Vector3d axis = (rod.to - rod.from).normalized();
  addDisc(rod.from, -axis, rod.radius, surface);
  addDisc(rod.to, axis, rod.radius, surface);
  Edge centre;
  centre.from = rod.from;
  centre.to = rod.to;
  centre.source = EdgeSource::kRodCentre;
  centre.rod = static_cast<int>(scene.rods.size());
  scene.edges.push_back(centre);
  const double half = (rod.to - rod.from).norm() / 2;
  Eigen::Matrix3d axes;
  axes.col(0) = axis.unitOrthogonal();
  axes.col(1) = axis.cross(axes.col(0));
  axes.col(2) = axis;
  scene.pieces.push_back({(rod.from + rod.to) / 2, axes, {rod.radius, rod.radius, half}, solid_++});
  scene.rods.push_back(rod);
}

void SceneBuilder::addJointedRods(const std::vector<Eigen::Vector3d>& nodes,
                                  const std::vector<std::array<size_t, 2>>& links,
                                  double radius,
                                  const Surface& surface) {
  constexpr double kLeastAngle = 0.55;
  const auto direction = [&](const std::array<size_t, 2>& link, size_t from) -> Eigen::Vector3d {
    const size_t to = link[0] == from ? link[1] : link[0];
    return (nodes[to] - nodes[from]).normalized();
  };
  // Least angle at each node; a link that makes too sharp a corner is left out.
  std::vector<double> least(nodes.size(), M_PI);
  std::vector<std::array<size_t, 2>> kept;
  for (const auto& link : links) {
    std::array<double, 2> angle{M_PI, M_PI};
    for (const auto& other : kept) {
      for (size_t k = 0; k < 2; ++k) {
        if (other[0] != link[k] && other[1] != link[k]) continue;
        const double cosine = direction(link, link[k]).dot(direction(other, link[k]));
        angle[k] = std::min(angle[k], std::acos(std::clamp(cosine, -1.0, 1.0)));
      }
    }
    if (std::min(angle[0], angle[1]) < kLeastAngle) continue;
    kept.push_back(link);
    for (size_t k = 0; k < 2; ++k) least[link[k]] = std::min(least[link[k]], angle[k]);
  }
  const auto offset = [&](size_t node) {
    return radius * std::max(2.0, 1.05 / std::tan(least[node] / 2));
  };
  for (size_t n = 0; n < nodes.size(); ++n) {
    addSphere(nodes[n], std::hypot(offset(n), radius) + 0.2 * radius, surface);
  }
  for (const auto& [a, b] : kept) {
    const Eigen::Vector3d d = (nodes[b] - nodes[a]).normalized();
    addRod(nodes[a] + offset(a) * d, nodes[b] - offset(b) * d, radius, 4, surface);
  }
}

void SceneBuilder::addSphere(const Eigen::Vector3d& centre, double radius, const Surface& surface) {
  scene.spheres.push_back({centre.cast<float>(), static_cast<float>(radius), addSurface(surface)});
}

void SceneBuilder::addDisc(const Eigen::Vector3d& centre,
                           const Eigen::Vector3d& normal,
                           double radius,
                           const Surface& surface) {
  scene.discs.push_back({centre.cast<float>(),
                         normal.normalized().cast<float>(),
                         static_cast<float>(radius),
                         addSurface(surface)});
}

void SceneBuilder::addTube(Tube tube, const Surface& surface) {
  tube.surface = addSurface(surface);
  scene.tubes.push_back(tube);
}

void SceneBuilder::addDecal(int face, const Print& print) {
  Face& f = scene.faces[static_cast<size_t>(face)];
  const Eigen::Vector2d axis(std::cos(print.angle_rad), std::sin(print.angle_rad));
  f.decals.push_back({print.shape, print.centre, axis, print.half, addSurface(print.surface)});
  if (print.shape != DecalShape::kRectangle) return;
  const Eigen::Vector2d& c = print.centre;
  const Eigen::Vector2d x = axis * print.half.x();
  const Eigen::Vector2d y = Eigen::Vector2d(-axis.y(), axis.x()) * print.half.y();
  const std::array<Eigen::Vector2d, 4> corners{c - x - y, c + x - y, c + x + y, c - x + y};
  for (size_t k = 0; k < 4; ++k) {
    Edge edge;
    edge.from = f.at(corners[k]);
    edge.to = f.at(corners[(k + 1) % 4]);
    edge.source = EdgeSource::kDecal;
    edge.face0 = face;
    scene.edges.push_back(edge);
  }
}

Frame3 SceneBuilder::wallFrame(const Eigen::Vector3d& size, int wall) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const std::array<Eigen::Vector3d, 4> origins{Eigen::Vector3d(size.x(), 0, 0),
                                               Eigen::Vector3d(0, 0, 0),
                                               Eigen::Vector3d(0, size.y(), 0),
                                               Eigen::Vector3d(size.x(), size.y(), 0)};
  const std::array<Eigen::Vector3d, 4> right{Eigen::Vector3d(-1, 0, 0),
                                             Eigen::Vector3d(0, 1, 0),
                                             Eigen::Vector3d(1, 0, 0),
                                             Eigen::Vector3d(0, -1, 0)};
  const auto k = static_cast<size_t>(wall);
  Frame3 frame;
  frame.origin = origins[k];
  frame.axes << right[k], up, right[k].cross(up);
  return frame;
}

std::array<PanelFaces, 6> SceneBuilder::addRoom(const Eigen::Vector3d& size,
                                                const std::array<Panel, 4>& walls,
                                                const Surface& floor,
                                                const Surface& ceiling) {
  std::array<PanelFaces, 6> faces;
  const auto width = [&](int k) { return k % 2 == 0 ? size.x() : size.y(); };
  for (int k = 0; k < 4; ++k) {
    const auto i = static_cast<size_t>(k);
    faces[i] = addPanel(wallFrame(size, k), 0, width(k), size.z(), walls[i]);
    double deepest = 0.1;
    for (const Pocket& p : walls[i].pockets) deepest = std::max(deepest, 2 * p.depth + 0.1);
    addPieces(wallFrame(size, k), 0, width(k), 0, size.z(), 0, -deepest, walls[i]);
    ++solid_;
  }
  const auto corners = [&](double z) -> Corners {
    return {addVertex({0, 0, z}),
            addVertex({size.x(), 0, z}),
            addVertex({size.x(), size.y(), z}),
            addVertex({0, size.y(), z})};
  };
  const Corners lo = corners(0), hi = corners(size.z());
  faces[4].front = addQuad(floor, lo);
  faces[5].front = addQuad(ceiling, {hi[0], hi[3], hi[2], hi[1]});
  // Wall k meets floor and ceiling; wall k and the next one meet in a vertical edge.
  const std::array<std::array<size_t, 2>, 4> ends{{{1, 0}, {0, 3}, {3, 2}, {2, 1}}};
  for (size_t k = 0; k < 4; ++k) {
    const auto [v0, v1] = ends[k];
    addEdge(lo[v0], lo[v1], faces[k].front, faces[4].front);
    addEdge(hi[v0], hi[v1], faces[k].front, faces[5].front);
    addEdge(lo[v1], hi[v1], faces[k].front, faces[(k + 1) % 4].front);
  }
  for (const double z : {-0.05, size.z() + 0.05}) {
    scene.pieces.push_back({{size.x() / 2, size.y() / 2, z},
                            Eigen::Matrix3d::Identity(),
                            {size.x() / 2, size.y() / 2, 0.05},
                            solid_++});
  }
  return faces;
}

void numberCarriers(std::vector<Edge>* edges) {
  // Edges on one line have nearly the same value of a fixed generic function of the line; only
  // neighbours in that order are compared.
  constexpr double kWindow = 2e-3;
  struct Key {
    double value;
    size_t edge;
  };
  std::vector<Key> keys;
  for (size_t i = 0; i < edges->size(); ++i) {
    const Edge& e = (*edges)[i];
    const Eigen::Vector3d u = (e.to - e.from).normalized();
    const Eigen::Vector3d m = e.from - u * u.dot(e.from);
    // |u . c| has no sign, as a line has none.
    const double value = m.dot(Eigen::Vector3d(0.8147, 1.3472, 2.2361)) +
                         37 * std::abs(u.dot(Eigen::Vector3d(0.5774, 0.3333, 0.7071)));
    keys.push_back({value, i});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.value != b.value ? a.value < b.value : a.edge < b.edge;
  });
  std::vector<size_t> leader(edges->size());
  for (size_t i = 0; i < leader.size(); ++i) leader[i] = i;
  const auto find = [&](size_t i) {
    while (leader[i] != i) i = leader[i];
    return i;
  };
  for (size_t i = 0; i < keys.size(); ++i) {
    for (size_t j = i + 1; j < keys.size() && keys[j].value - keys[i].value < kWindow; ++j) {
      const size_t a = find(keys[i].edge), b = find(keys[j].edge);
      if (a == b || !sameLine((*edges)[keys[i].edge], (*edges)[keys[j].edge])) continue;
      leader[std::max(a, b)] = std::min(a, b);
    }
  }
  std::map<size_t, int> numbers;
  for (size_t i = 0; i < edges->size(); ++i) {
    const auto [it, added] = numbers.emplace(find(i), static_cast<int>(numbers.size()));
    (*edges)[i].carrier = it->second;
  }
}

void SceneBuilder::finish() {
  numberCarriers(&scene.edges);
}

}  // namespace dlsd
