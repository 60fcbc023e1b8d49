#pragma once
// Building blocks of scenes: panels with pockets, slabs, rods. They emit each edge exactly once.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "synth/scene.h"

namespace dlsd {

/// Orthonormal frame; columns of `axes` are x, y, z.
struct Frame3 {
  Eigen::Vector3d origin{0, 0, 0};
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  [[nodiscard]] Eigen::Vector3d at(double x, double y, double z) const {
    return origin + axes * Eigen::Vector3d(x, y, z);
  }
};

struct Pocket;

/// A rectangular front with rectangular recesses: the one form behind walls with windows, doors
/// with panels, shelves, drawers and picture frames.
struct Panel {
  Surface surface;
  std::vector<Pocket> pockets;  ///< Apart from each other and from the border.
};

struct Pocket {
  double x0, x1, y0, y1;  ///< In the panel's frame.
  double depth;
  Surface sides;
  Panel bottom;
};

/// Faces of a panel and, in the same order as given, of its pockets.
struct PanelFaces {
  int front = -1;
  std::vector<PanelFaces> pockets;
};

struct SlabFaces {
  PanelFaces front;
  int left, right, top, bottom, back;
};

/// A decal to be: in the face's 2D frame. (A braced list, so that draws inside it have an order.)
struct Print {
  DecalShape shape;
  Eigen::Vector2d centre, half;
  double angle_rad;
  Surface surface;
};

/// Gives edges on one infinite line one carrier, in the order of the edges.
void numberCarriers(std::vector<Edge>* edges);

class SceneBuilder {
 public:
  SceneBuilder() = default;
  /// Adds to a scene that is there already.
  explicit SceneBuilder(Scene base);

  /// Front of a panel at z = `z` of the frame (x right, y up, z to the viewer), [0, width] x
  /// [0, height], with everything in its pockets. The border's edges are the caller's.
  PanelFaces addPanel(
      const Frame3& frame, double z, double width, double height, const Panel& panel);

  /// A box with the panel as its front at z = 0 and its back at z = -depth. Without the edge
  /// between back and bottom if that lies in the corner of wall and floor, which has it already.
  SlabFaces addSlab(const Frame3& frame,
                    double width,
                    double height,
                    double depth,
                    const Panel& front,
                    const Surface& sides,
                    bool in_floor_corner = false);

  /// Axis-aligned box in a frame whose z is up and whose front looks to -y.
  SlabFaces addBox(const Frame3& frame,
                   const Eigen::Vector3d& lo,
                   const Eigen::Vector3d& hi,
                   const Surface& surface);
  SlabFaces addBox(const Frame3& frame,
                   const Eigen::Vector3d& lo,
                   const Eigen::Vector3d& hi,
                   const Panel& front,
                   const Surface& sides);

  /// A solid bounded by planar polygons, vertices in the frame. Each loop lists vertices
  /// counter-clockwise as seen from outside, starting with one from which the whole polygon is
  /// seen; each edge is in two loops.
  void addSolid(const Frame3& frame,
                const std::vector<Eigen::Vector3d>& vertices,
                const std::vector<std::vector<int>>& loops,
                const std::vector<Surface>& surfaces);

  /// A prism with 4 or 8 sides.
  void addRod(const Eigen::Vector3d& from,
              const Eigen::Vector3d& to,
              double radius,
              int sides,
              const Surface& surface);
  /// Rods with 4 sides along the links (pairs of nodes); each node's rods end where they would
  /// enter each other, under a ball of at most 4.2 radius. Links that make too sharp a corner with
  /// an earlier one (0.55 rad) are left out.
  void addJointedRods(const std::vector<Eigen::Vector3d>& nodes,
                      const std::vector<std::array<size_t, 2>>& links,
                      double radius,
                      const Surface& surface);
  /// A cylinder: a rod with a round section, closed by discs. Its sides become edges by
  /// addRodSides.
  void addRoundRod(const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to,
                   double radius,
                   const Surface& surface);
  void addSphere(const Eigen::Vector3d& centre, double radius, const Surface& surface);
  void addDisc(const Eigen::Vector3d& centre,
               const Eigen::Vector3d& normal,
               double radius,
               const Surface& surface);

  /// Of the tube everything but the surface.
  void addTube(Tube tube, const Surface& surface);

  /// Rectangles bring four edges, ellipses none.
  void addDecal(int face, const Print& print);

  /// Six inward faces of a box room [0, x] x [0, y] x [0, z]; walls in the order y = 0, x = 0,
  /// y = max, x = max, each as a panel seen from inside. Returns walls, floor, ceiling.
  std::array<PanelFaces, 6> addRoom(const Eigen::Vector3d& size,
                                    const std::array<Panel, 4>& walls,
                                    const Surface& floor,
                                    const Surface& ceiling);
  /// The frame of such a wall: origin bottom left as seen from inside, z into the room.
  [[nodiscard]] static Frame3 wallFrame(const Eigen::Vector3d& size, int wall);

  Scene scene;

  /// Numbers the carriers. Call last.
  void finish();

 private:
  using Corners = std::array<int, 4>;
  int addVertex(const Eigen::Vector3d& p);
  int addSurface(const Surface& surface);
  int startFace(const Surface& surface, const Corners& corners);
  int addQuad(const Surface& surface, const Corners& corners);
  void addEdge(int v0, int v1, int face0, int face1, int rod = -1);
  void addPieces(const Frame3& frame,
                 double x0,
                 double x1,
                 double y0,
                 double y1,
                 double z_front,
                 double z_back,
                 const Panel& panel);

  int solid_ = 0;
};

}  // namespace dlsd
