#include "synth/scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "synth/dataset/random.h"
#include "synth/variety.h"

namespace dlsd {
namespace {

constexpr int kRooms = 40;

struct Named {
  std::string name;
  SceneView view;
};

std::vector<Named> scenes() {
  std::vector<Named> out;
  for (uint64_t i = 0; i < kRooms; ++i) {
    out.push_back({"room " + std::to_string(i), makeSceneView("room", 7, i)});
  }
  for (uint64_t seed = 0; seed < 5; ++seed) {
    out.push_back({"paper " + std::to_string(seed), makeSceneView("paper", seed, 3)});
    for (const std::string preset : {"polyhedra", "wires", "corridor", "facade", "checkerboard"}) {
      out.push_back({preset + " " + std::to_string(seed), makeSceneView(preset, seed, 3)});
    }
  }
  return out;
}

bool sameBits(const Scene& a, const Scene& b) {
  if (a.vertices != b.vertices || a.edges.size() != b.edges.size()) return false;
  for (size_t i = 0; i < a.edges.size(); ++i) {
    if (a.edges[i].from != b.edges[i].from || a.edges[i].to != b.edges[i].to ||
        a.edges[i].carrier != b.edges[i].carrier) {
      return false;
    }
  }
  return a.surfaces.size() == b.surfaces.size() &&
         std::equal(a.surfaces.begin(),
                    a.surfaces.end(),
                    b.surfaces.begin(),
                    [](const Surface& x, const Surface& y) {
                      return x.albedo == y.albedo && x.emission == y.emission;
                    });
}

TEST(Random, IsUniformAndNormal) {
  const Random random(1, 2);
  constexpr int kCount = 200000;
  std::array<int, 16> bins{};
  double mean = 0, variance = 0, fourth = 0;
  for (int i = 0; i < kCount; ++i) {
    const auto k = static_cast<uint64_t>(i);
    const double u = random.uniform(k, 0, 1);
    ASSERT_TRUE(u >= 0 && u < 1);
    ++bins[static_cast<size_t>(u * 16)];
    const double x = random.normal(k);
    mean += x / kCount;
    variance += x * x / kCount;
    fourth += x * x * x * x / kCount;
  }
  // Five standard deviations of each statistic.
  for (const int n : bins) EXPECT_NEAR(n, kCount / 16, 5 * std::sqrt(kCount / 16.0));
  EXPECT_NEAR(mean, 0, 5 / std::sqrt(kCount));
  EXPECT_NEAR(variance, 1, 5 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(fourth, 3, 5 * std::sqrt(96.0 / kCount));
}

TEST(Random, DiffersBySeedStreamAndIndex) {
  std::set<uint64_t> values;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    for (uint64_t stream = 0; stream < 20; ++stream) {
      for (uint64_t index = 0; index < 20; ++index) {
        values.insert(Random(seed, stream).bits(index));
      }
    }
  }
  EXPECT_EQ(values.size(), 8000U);
}

TEST(Random, KeepsIntegerRange) {
  Random random(3, 4);
  std::map<int, int> counts;
  for (int i = 0; i < 7000; ++i) ++counts[random.nextInt(-3, 3)];
  ASSERT_EQ(counts.size(), 7U);
  for (const auto& [value, count] : counts) EXPECT_NEAR(count, 1000, 160) << value;
}

TEST(Scene, IsAFunctionOfSeedAndIndex) {
  for (const std::string& preset : scenePresets()) {
    const SceneView a = makeSceneView(preset, 5, 3), b = makeSceneView(preset, 5, 3);
    EXPECT_TRUE(sameBits(a.scene, b.scene));
    EXPECT_EQ(a.pose.cam_from_world, b.pose.cam_from_world);
    EXPECT_EQ(a.pose.position_in_world, b.pose.position_in_world);
    EXPECT_FALSE(sameBits(a.scene, makeSceneView(preset, 6, 3).scene));
  }
  EXPECT_FALSE(sameBits(makeSceneView("room", 5, 3).scene, makeSceneView("room", 5, 4).scene));
  EXPECT_TRUE(sameBits(makeSceneView("paper", 5, 3).scene, makeSceneView("paper", 5, 4).scene));
  EXPECT_THROW((void)makeSceneView("rooms", 0, 0), std::invalid_argument);
}

TEST(Scene, EdgesHaveLengthAndLieInTheirFaces) {
  for (const Named& s : scenes()) {
    const Scene& scene = s.view.scene;
    ASSERT_GT(scene.edges.size(), 100U);
    for (size_t i = 0; i < scene.edges.size(); ++i) {
      const Edge& e = scene.edges[i];
      EXPECT_GT((e.to - e.from).norm(), 5e-4) << s.name << " edge " << i;
      for (const int f : {e.face0, e.face1}) {
        if (f < 0) continue;
        const Face& face = scene.faces[static_cast<size_t>(f)];
        EXPECT_LT(std::abs(face.normal.dot(e.from - face.origin)), 3e-6) << s.name << " edge " << i;
        EXPECT_LT(std::abs(face.normal.dot(e.to - face.origin)), 3e-6) << s.name << " edge " << i;
      }
    }
  }
}

// Two edges on each other would be two labels of one step of the picture.
TEST(Scene, EdgesDoNotOverlap) {
  size_t pairs = 0;
  for (const Named& s : scenes()) {
    const Scene& scene = s.view.scene;
    std::map<int, std::vector<size_t>> carriers;
    for (size_t i = 0; i < scene.edges.size(); ++i) carriers[scene.edges[i].carrier].push_back(i);
    for (const auto& [carrier, edges] : carriers) {
      const Edge& first = scene.edges[edges[0]];
      const Eigen::Vector3d u = (first.to - first.from).normalized();
      for (size_t a = 0; a < edges.size(); ++a) {
        for (size_t b = a + 1; b < edges.size(); ++b) {
          const Edge &ea = scene.edges[edges[a]], &eb = scene.edges[edges[b]];
          const auto [a0, a1] = std::minmax({u.dot(ea.from), u.dot(ea.to)});
          const auto [b0, b1] = std::minmax({u.dot(eb.from), u.dot(eb.to)});
          ++pairs;
          EXPECT_LT(std::min(a1, b1) - std::max(a0, b0), 1e-5)
              << s.name << " edges " << edges[a] << " and " << edges[b] << " at "
              << ea.from.transpose() << " to " << ea.to.transpose() << " and "
              << eb.from.transpose() << " to " << eb.to.transpose();
        }
      }
    }
  }
  EXPECT_GT(pairs, 1000U);
}

TEST(Scene, CarriersAreLines) {
  for (const Named& s : scenes()) {
    std::map<int, const Edge*> longest;
    for (const Edge& e : s.view.scene.edges) {
      const Edge*& l = longest[e.carrier];
      if (l == nullptr || (e.to - e.from).norm() > (l->to - l->from).norm()) l = &e;
    }
    for (const Edge& e : s.view.scene.edges) {
      const Edge& l = *longest[e.carrier];
      const Eigen::Vector3d u = (l.to - l.from).normalized();
      for (const Eigen::Vector3d& p : {e.from, e.to}) {
        // Chains of pairs that each agree to 3e-6 m.
        EXPECT_LT(u.cross(p - l.from).norm(), 2e-5) << s.name;
      }
    }
  }
}

/// Separating-axis test for boxes: depth by which they enter each other, <= 0 if they don't.
double penetration(const SolidPiece& a, const SolidPiece& b) {
  double least = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d d = b.centre - a.centre;
  const auto along = [&](const Eigen::Vector3d& axis) {
    const double norm = axis.norm();
    if (norm < 1e-6) return;
    const Eigen::Vector3d n = axis / norm;
    double reach = 0;
    for (int k = 0; k < 3; ++k) {
      reach +=
          std::abs(n.dot(a.axes.col(k))) * a.half[k] + std::abs(n.dot(b.axes.col(k))) * b.half[k];
    }
    least = std::min(least, reach - std::abs(n.dot(d)));
  };
  for (int i = 0; i < 3; ++i) {
    along(a.axes.col(i));
    along(b.axes.col(i));
    for (int j = 0; j < 3; ++j) along(a.axes.col(i).cross(b.axes.col(j)));
  }
  return least;
}

TEST(Scene, SolidsDoNotEnterEachOther) {
  SolidPiece a{{0, 0, 0}, Eigen::Matrix3d::Identity(), {1, 1, 1}, 0};
  SolidPiece b = a;
  b.centre.x() = 1.9;
  ASSERT_NEAR(penetration(a, b), 0.1, 1e-12);  // The test itself can see it.
  size_t near = 0;
  for (const Named& s : scenes()) {
    const auto& pieces = s.view.scene.pieces;
    ASSERT_GT(pieces.size(), 10U);
    for (size_t i = 0; i < pieces.size(); ++i) {
      EXPECT_GT(pieces[i].half.minCoeff(), 0) << s.name << " piece " << i << " is inside out";
      for (size_t j = i + 1; j < pieces.size(); ++j) {
        const double reach = pieces[i].half.norm() + pieces[j].half.norm();
        if ((pieces[i].centre - pieces[j].centre).norm() > reach) continue;
        ++near;
        if (pieces[i].solid == pieces[j].solid) continue;  // Cells of one slab.
        EXPECT_LT(penetration(pieces[i], pieces[j]), 2e-6)
            << s.name << " pieces " << i << " at " << pieces[i].centre.transpose() << " half "
            << pieces[i].half.transpose() << " and " << j << " at " << pieces[j].centre.transpose()
            << " half " << pieces[j].half.transpose();
      }
    }
  }
  EXPECT_GT(near, 10000U);
}

TEST(Scene, DecalsLieInTheirFaceAndAreDisjointOrNested) {
  size_t decals = 0;
  for (const Named& s : scenes()) {
    for (size_t f = 0; f < s.view.scene.faces.size(); ++f) {
      const Face& face = s.view.scene.faces[f];
      decals += face.decals.size();
      // The face's triangles in its 2D frame.
      std::vector<std::array<Eigen::Vector2d, 3>> triangles;
      if (!face.decals.empty()) {
        for (const Triangle& t : s.view.scene.triangles) {
          if (t.face != static_cast<int>(f)) continue;
          std::array<Eigen::Vector2d, 3> corners;
          for (size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3d p =
                s.view.scene.vertices[static_cast<size_t>(t.vertices[k])].cast<double>() -
                face.origin;
            corners[k] = {face.e1.dot(p), face.e2.dot(p)};
          }
          triangles.push_back(corners);
        }
      }
      const auto inFace = [&](const Eigen::Vector2d& p) {
        return std::any_of(triangles.begin(), triangles.end(), [&](const auto& t) {
          for (size_t k = 0; k < 3; ++k) {
            const Eigen::Vector2d e = t[(k + 1) % 3] - t[k], d = p - t[k];
            if (e.x() * d.y() - e.y() * d.x() < -1e-6) return false;
          }
          return true;
        });
      };
      for (size_t i = 0; i < face.decals.size(); ++i) {
        const Decal& d = face.decals[i];
        const auto border = [&](int k, double scale) -> Eigen::Vector2d {
          const double a = 2 * M_PI * (k + 0.5) / 64;
          Eigen::Vector2d p(std::cos(a), std::sin(a));
          if (d.shape == DecalShape::kRectangle) p /= p.cwiseAbs().maxCoeff();
          p = p.cwiseProduct(d.half) * scale;
          return d.centre + d.axis * p.x() + Eigen::Vector2d(-d.axis.y(), d.axis.x()) * p.y();
        };
        for (int k = 0; k < 64; ++k) {
          EXPECT_TRUE(inFace(border(k, 1))) << s.name << " face " << f << " decal " << i;
        }
        // An earlier decal contains all of a later one or nothing of it.
        for (size_t j = 0; j < i; ++j) {
          int inside = 0;
          for (int k = 0; k < 64; ++k)
            inside += face.decals[j].contains(border(k, 1 - 1e-9)) ? 1 : 0;
          EXPECT_TRUE(inside == 0 || inside == 64)
              << s.name << " face " << f << " decals " << j << ", " << i << ": " << inside;
          // And a later one contains nothing of the earlier one's border.
          for (int k = 0; k < 64; ++k) {
            const Decal& e = face.decals[j];
            const double a = 2 * M_PI * (k + 0.5) / 64;
            Eigen::Vector2d p(std::cos(a), std::sin(a));
            if (e.shape == DecalShape::kRectangle) p /= p.cwiseAbs().maxCoeff();
            p = p.cwiseProduct(e.half) * (1 - 1e-9);
            EXPECT_FALSE(d.contains(e.centre + e.axis * p.x() +
                                    Eigen::Vector2d(-e.axis.y(), e.axis.x()) * p.y()))
                << s.name << " face " << f << " decals " << j << ", " << i;
          }
        }
      }
    }
  }
  EXPECT_GT(decals, 500U);
}

TEST(Scene, CameraStandsInTheOpen) {
  for (const Named& s : scenes()) {
    const Pose& pose = s.view.pose;
    const Eigen::Vector3d p = pose.position_in_world;
    EXPECT_NEAR(pose.cam_from_world.determinant(), 1, 1e-12);
    EXPECT_LT((pose.cam_from_world * pose.cam_from_world.transpose() - Eigen::Matrix3d::Identity())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-14);
    for (const SolidPiece& piece : s.view.scene.pieces) {
      const Eigen::Vector3d d = piece.axes.transpose() * (p - piece.centre);
      const double distance = (d.cwiseAbs() - piece.half).cwiseMax(0).norm();
      EXPECT_GT(distance, 0.05) << s.name;
    }
    for (const Sphere& sphere : s.view.scene.spheres) {
      EXPECT_GT((sphere.centre.cast<double>() - p).norm() - static_cast<double>(sphere.radius),
                0.02)
          << s.name;
    }
  }
}

/// The 29 bits that a double has more than a float are zero. Not by a conversion to float and back,
/// which a compiler may leave out.
bool isFloat(double x) {
  return (std::bit_cast<uint64_t>(x) & ((uint64_t{1} << 29) - 1)) == 0;
}
bool isFloat(const Eigen::Vector3d& p) {
  return isFloat(p.x()) && isFloat(p.y()) && isFloat(p.z());
}

// Where the camera stands and cylinders end: labels and the ray caster mean the same points.
TEST(Scene, CamerasAndCylindersAreAtFloats) {
  SceneVariety variety;
  variety.distractors = {6, 6};
  variety.distractor_kinds = {"cylinder"};
  size_t cylinders = 0;
  for (const std::string& preset : scenePresets()) {
    for (uint64_t i = 0; i < 10; ++i) {
      SceneView view = makeSceneView(preset, i, 3 * i);
      EXPECT_TRUE(isFloat(view.pose.position_in_world)) << preset << ' ' << i;
      addVariety(variety, i, 3 * i, &view);
      EXPECT_TRUE(isFloat(view.pose.position_in_world)) << preset << ' ' << i;
      for (const Rod& rod : view.scene.rods) {
        if (!rod.isRound()) continue;
        ++cylinders;
        EXPECT_TRUE(isFloat(rod.from) && isFloat(rod.to) && isFloat(rod.radius))
            << preset << ' ' << i;
      }
    }
  }
  EXPECT_GT(cylinders, 100U);
}

TEST(Scene, RoundToFloatIsNearest) {
  const Random random(4, 1);
  for (uint64_t i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p(random.uniform(3 * i, -20, 20),
                            random.uniform(3 * i + 1, -20, 20),
                            random.uniform(3 * i + 2, -1e-3, 1e-3));
    const Eigen::Vector3d rounded = roundToFloat(p);
    EXPECT_TRUE(isFloat(rounded)) << p.transpose();
    for (int k = 0; k < 3; ++k) {
      // Half of what the last of 24 bits is worth.
      EXPECT_LE(std::abs(rounded[k] - p[k]), std::ldexp(0.5, std::ilogb(p[k]) - 23));
    }
  }
}

TEST(Scene, PaperCameraMovesSmoothly) {
  SceneView before = makeSceneView("paper", 2, 0);
  for (uint64_t i = 1; i < 100; ++i) {
    const SceneView now = makeSceneView("paper", 2, i);
    const double step = (now.pose.position_in_world - before.pose.position_in_world).norm();
    const double turn =
        Eigen::AngleAxisd(now.pose.cam_from_world * before.pose.cam_from_world.transpose()).angle();
    EXPECT_LT(step, 0.12) << i;
    EXPECT_LT(turn, 0.2) << i;
    EXPECT_GT(step + turn, 1e-5) << i;
    before = now;
  }
}

}  // namespace
}  // namespace dlsd
