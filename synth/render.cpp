#include "synth/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "cameras/batch.h"
#include "cameras/mutant.h"
#include "synth/dataset/random.h"
#include "synth/parallel.h"
#include "synth/tubes.h"

namespace dlsd {
namespace {

/// Sights of pixels that nothing is known of yet, and of places without a ray.
constexpr Sight kUnknown = -3, kNoRay = -2;
/// Two grey levels at exposure 1: less is no step.
constexpr float kStep = 2.0F / 255;

/// Counts the curves that pass each pixel.
class PixelMask {
 public:
  static constexpr int kNoOwner = -1;

  PixelMask(int width, int height)
      : width_(width),
        height_(height),
        curves_(static_cast<size_t>(width) * static_cast<size_t>(height), 0),
        owners_(curves_.size(), {kNoOwner, kNoOwner}) {}

  /// A curve's points, joined by straight pieces, and its number if it is a span's. Pixels of which
  /// it only cuts a corner, less than kMinLengthPx long, are left out: that corner is at most 0.4 %
  /// of the pixel.
  void addCurve(const std::vector<Eigen::Vector2d>& points, int owner = kNoOwner) {
    current_ = owner;
    for (size_t i = 1; i < points.size(); ++i) addPiece(points[i - 1], points[i]);
    count();
  }

  /// Curves through a pixel: 0, 1, 2, or 3 for more.
  [[nodiscard]] int curves(size_t pixel) const { return curves_[pixel]; }
  /// Numbers of the curves through a pixel, kNoOwner where there is none: of two at most.
  [[nodiscard]] const std::array<int, 2>& owners(size_t pixel) const { return owners_[pixel]; }
  /// Whether no curve passes the pixels [x0, x1) x [y0, y1).
  [[nodiscard]] bool isFree(int x0, int x1, int y0, int y1) const {
    bool is_free = true;
    for (int y = y0; y < y1; ++y) {
      const uint8_t* row = curves_.data() + static_cast<size_t>(y) * static_cast<size_t>(width_);
      for (int x = x0; x < x1; ++x) is_free = is_free && row[x] == 0;
    }
    return is_free;
  }

 private:
  static constexpr double kMinLengthPx = 0.12;

  /// Walks from pixel to pixel.
  void addPiece(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d d = b - a;
    const double length = d.norm();
    if (!(length > 0) || !(a.cwiseAbs().maxCoeff() < 1e6) || !(length < 1e6)) return;
    const Eigen::Vector2i last{pixelOf(b.x()), pixelOf(b.y())};
    Eigen::Vector2i at{pixelOf(a.x()), pixelOf(a.y())};
    // Fractions of the piece at which it goes on to the next column and row.
    std::array<double, 2> next, stride;
    std::array<int, 2> step;
    for (int axis = 0; axis < 2; ++axis) {
      const auto k = static_cast<size_t>(axis);
      step[k] = d[axis] > 0 ? 1 : -1;
      const bool moves = d[axis] != 0;
      next[k] = moves ? (at[axis] + 0.5 * step[k] - a[axis]) / d[axis] : 2;
      stride[k] = moves ? 1 / std::abs(d[axis]) : 2;
    }
    double t = 0;
    for (int left = std::abs(last.x() - at.x()) + std::abs(last.y() - at.y()); left > 0; --left) {
      const size_t axis = next[0] < next[1] ? 0 : 1;
      const double end = std::clamp(next[axis], t, 1.0);
      add(at, (end - t) * length);
      t = end;
      at[static_cast<int>(axis)] += step[axis];
      next[axis] += stride[axis];
    }
    add(at, (1 - t) * length);
  }

  void add(const Eigen::Vector2i& pixel, double length) {
    if (pixel != pixel_) count();
    pixel_ = pixel;
    length_ += length;
  }

  /// Counts the curve in its last pixel.
  void count() {
    const bool inside =
        pixel_.x() >= 0 && pixel_.y() >= 0 && pixel_.x() < width_ && pixel_.y() < height_;
    if (inside && length_ >= kMinLengthPx) {
      const size_t pixel = static_cast<size_t>(pixel_.y()) * static_cast<size_t>(width_) +
                           static_cast<size_t>(pixel_.x());
      if (curves_[pixel] < 2) owners_[pixel][curves_[pixel]] = current_;
      curves_[pixel] = static_cast<uint8_t>(std::min(3, curves_[pixel] + 1));
    }
    length_ = 0;
  }

  static int pixelOf(double x) { return static_cast<int>(std::floor(x + 0.5)); }

  int width_, height_;
  std::vector<uint8_t> curves_;
  std::vector<std::array<int, 2>> owners_;
  int current_ = kNoOwner;
  Eigen::Vector2i pixel_{-1, -1};  ///< Where the curve is, and its length there so far.
  double length_ = 0;
};

/// The middle of a rod or of its shadow, where nothing is to be seen.
bool isBarMiddle(const Scene& scene, const Edge& edge) {
  const bool is_shadow = edge.source == EdgeSource::kShadow;
  const Edge& line = is_shadow ? scene.edges[static_cast<size_t>(edge.caster)] : edge;
  return line.source == EdgeSource::kRodCentre;
}

/// Adds the images of all circles and ellipses at which something may end, hidden or not.
void addRoundOutlines(const Scene& scene, const Camera& camera, const Pose& pose, PixelMask* mask) {
  std::vector<Eigen::Vector2d> curve;
  const auto goOn = [&](const Eigen::Vector3d& point_in_cam) {
    const auto pixel = camera.project(point_in_cam);
    // At the seam of a panorama it jumps to the other side.
    const bool goes_on =
        pixel && (curve.empty() || (*pixel - curve.back()).norm() < camera.width() / 4.0);
    if (!goes_on) {
      mask->addCurve(curve);
      curve.clear();
    }
    if (pixel) curve.push_back(*pixel);
  };
  const auto end = [&] {
    mask->addCurve(curve);
    curve.clear();
  };
  // Pieces whose chords are within a hundredth of a pixel, for a curve of this size (m).
  const auto piecesFor = [&](double size, double nearest_centre) {
    // The angle it covers, in px at the image's centre.
    const double distance = std::max(nearest_centre - size, 0.05 * size);
    const auto J = camera.jacobian(Eigen::Vector3d::UnitZ());
    const double size_px = (J ? J->norm() : camera.width()) * std::min(3.0, size / distance);
    return std::clamp(static_cast<int>(25 * std::sqrt(size_px)), 16, 2000);
  };
  // An ellipse with these half axes, in the camera frame.
  const auto add =
      [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        const int pieces = piecesFor(std::max(a.norm(), b.norm()), centre.norm());
        for (int k = 0; k <= pieces; ++k) {
          const double phi = 2 * M_PI * k / pieces;
          goOn(centre + std::cos(phi) * a + std::sin(phi) * b);
        }
        end();
      };
  for (const Sphere& sphere : scene.spheres) {
    // The circle in which the cone from the camera touches the sphere.
    const Eigen::Vector3d centre = pose.toCam(sphere.centre.cast<double>());
    const double distance = centre.norm();
    const double sine = static_cast<double>(sphere.radius) / distance;
    if (!(sine < 1)) continue;
    const double radius = static_cast<double>(sphere.radius) * std::sqrt(1 - sine * sine);
    const Eigen::Vector3d a = centre.unitOrthogonal() * radius;
    add(centre * (1 - sine * sine), a, centre.cross(a) / distance);
  }
  for (const Disc& disc : scene.discs) {
    const Eigen::Vector3d normal = pose.cam_from_world * disc.normal.cast<double>();
    const Eigen::Vector3d a = normal.unitOrthogonal() * static_cast<double>(disc.radius);
    add(pose.toCam(disc.centre.cast<double>()), a, normal.cross(a));
  }
  for (const Tube& tube : scene.tubes) {
    const double size = tube.x.norm() + tube.y.norm() + tube.radius;
    const int pieces = piecesFor(size, pose.toCam(tube.centre).norm());
    for (const auto& outline : outlineOf(tube, pose.position_in_world, pieces)) {
      for (const Eigen::Vector3d& point : outline) goOn(pose.toCam(point));
      end();
    }
  }
  for (const Face& face : scene.faces) {
    if (face.normal.dot(pose.position_in_world - face.origin) <= 0) continue;
    for (const Decal& d : face.decals) {
      if (d.shape != DecalShape::kEllipse) continue;
      const Eigen::Vector3d x = face.e1 * d.axis.x() + face.e2 * d.axis.y();
      const Eigen::Vector3d y = face.normal.cross(x);
      add(pose.toCam(face.at(d.centre)),
          pose.cam_from_world * x * d.half.x(),
          pose.cam_from_world * y * d.half.y());
    }
  }
}

/// Up to kFineSamples rays from the camera, cast in packets and shaded one by one.
class RayBatch {
 public:
  RayBatch(const Raycaster& raycaster, const Shader& shader, const Pose& pose)
      : raycaster_(raycaster),
        shader_(shader),
        origin_(pose.position_in_world),
        world_from_cam_(pose.cam_from_world.transpose().cast<float>()) {}

  [[nodiscard]] Eigen::Vector3f toWorld(const Eigen::Vector3f& ray_in_cam) const {
    return world_from_cam_ * ray_in_cam;
  }

  void clear() { count_ = 0; }
  void add(const Eigen::Vector3f& ray_in_world) {
    x_[count_] = ray_in_world.x();
    y_[count_] = ray_in_world.y();
    z_[count_] = ray_in_world.z();
    ++count_;
  }
  /// A full batch: rays interpolated between those of a pixel's corners (row by row) at the
  /// fractions u, v.
  void setBilinear(const std::array<Eigen::Vector3f, 4>& corners, const float* u, const float* v) {
    const Eigen::Vector3f du = corners[1] - corners[0], dv = corners[2] - corners[0];
    const Eigen::Vector3f duv = corners[3] - corners[2] - du;
    for (size_t k = 0; k < kFineSamples; ++k) {
      const float uv = u[k] * v[k];
      x_[k] = corners[0].x() + u[k] * du.x() + v[k] * dv.x() + uv * duv.x();
      y_[k] = corners[0].y() + u[k] * du.y() + v[k] * dv.y() + uv * duv.y();
      z_[k] = corners[0].z() + u[k] * du.z() + v[k] * dv.z() + uv * duv.z();
    }
    count_ = kFineSamples;
  }

  void swap(size_t i, size_t k) {
    std::swap(x_[i], x_[k]);
    std::swap(y_[i], y_[k]);
    std::swap(z_[i], z_[k]);
  }

  /// Casts the rays [from, to) and looks what they see.
  void cast(size_t from, size_t to) {
    for (size_t k = from; k < to; k += Raycaster::kPacket) {
      const size_t count = std::min(Raycaster::kPacket, to - k);
      const float *x = x_.data() + k, *y = y_.data() + k, *z = z_.data() + k;
      raycaster_.castPacket(origin_.cast<float>(), x, y, z, count, hits_.data() + k);
      for (size_t i = k; i < k + count; ++i) {
        sights_[i] = shader_.surfaceAt(hits_[i], origin_, ray(i).cast<double>());
      }
      if (shader_.hasShadows()) {
        shader_.addShadows(hits_.data() + k, origin_, x, y, z, count, sights_.data() + k);
      }
    }
  }
  void cast() { cast(0, count_); }

  [[nodiscard]] size_t count() const { return count_; }
  [[nodiscard]] Sight sight(size_t i) const { return sights_[i]; }
  [[nodiscard]] float radiance(size_t i) const { return radiance(i, ray(i)); }
  /// In another direction than that of ray i, on the surface that it has hit.
  [[nodiscard]] float radiance(size_t i, const Eigen::Vector3f& direction) const {
    return shader_.radiance(hits_[i], origin_, direction.cast<double>(), sights_[i]);
  }
  /// Whether the mean of the radiance over rays that see what ray i sees is that of their mean.
  [[nodiscard]] bool isFlat(size_t i) const {
    return (hits_[i].kind == HitKind::kFace || hits_[i].kind == HitKind::kDisc) &&
           !shader_.isTextured(sights_[i]);
  }
  [[nodiscard]] bool isTextured(size_t i) const { return shader_.isTextured(sights_[i]); }
  [[nodiscard]] Eigen::Vector3f ray(size_t i) const { return {x_[i], y_[i], z_[i]}; }

 private:
  const Raycaster& raycaster_;
  const Shader& shader_;
  Eigen::Vector3d origin_;
  Eigen::Matrix3f world_from_cam_;
  size_t count_ = 0;
  alignas(64) std::array<float, kFineSamples> x_, y_, z_;
  std::array<Hit, kFineSamples> hits_;
  std::array<Sight, kFineSamples> sights_;
};

/// What pixels show in their centres, row-major; kUnknown where a curve or the domain's rim passes.
struct Pixels {
  std::vector<Sight> sight;
  std::vector<float> radiance;
};

/// A first look at a band of rows. Blocks of pixels without a curve whose corners agree are filled
/// from these corners; other pixels without a curve get a ray through their centre.
class FirstLook {
 public:
  /// @param fill_blocks  Whether all that may end within a block is in the mask.
  FirstLook(const CameraRays& rays, const PixelMask& mask, const RayBatch& batch, bool fill_blocks)
      : rays_(rays), mask_(mask), batch_(batch), fill_blocks_(fill_blocks) {}

  void look(int first, int end, Pixels* pixels) {
    castCorners(first, end);
    for (int y0 = first; y0 < end; y0 += kBlock) {
      for (int x0 = 0; x0 < rays_.width(); x0 += kBlock) {
        const int x1 = std::min(rays_.width(), x0 + kBlock), y1 = std::min(end, y0 + kBlock);
        if (!fillBlock(x0, x1, y0, y1, (y0 - first) / kBlock, pixels)) {
          castCentres(x0, x1, y0, y1, pixels);
        }
      }
    }
  }

 private:
  static constexpr int kBlock = CameraRays::kBlock;
  static_assert(kBlock * kBlock == Raycaster::kPacket && kBandRows % kBlock == 0);

  struct Corner {
    Sight sight = kNoRay;
    float radiance = 0;
    bool is_textured = false;
  };

  /// Corners of the blocks of the band, in packets of neighbours.
  void castCorners(int first, int end) {
    columns_ = (rays_.width() + kBlock - 1) / kBlock + 1;
    const int rows = (end - first + kBlock - 1) / kBlock + 1;
    corners_.assign(static_cast<size_t>(columns_ * rows), Corner());
    std::array<size_t, Raycaster::kPacket> slots{};
    constexpr int kSide = 4;
    for (int r0 = 0; r0 < rows; r0 += kSide) {
      for (int c0 = 0; c0 < columns_; c0 += kSide) {
        batch_.clear();
        for (int r = r0; r < std::min(rows, r0 + kSide); ++r) {
          for (int c = c0; c < std::min(columns_, c0 + kSide); ++c) {
            const int i = std::min(rays_.width(), c * kBlock);
            const int j = std::min(end, first + r * kBlock);
            if (!rays_.cornerValid(i, j)) continue;
            slots[batch_.count()] = static_cast<size_t>(r * columns_ + c);
            batch_.add(batch_.toWorld(rays_.cornerRay(i, j)));
          }
        }
        batch_.cast();
        for (size_t k = 0; k < batch_.count(); ++k) {
          corners_[slots[k]] = {batch_.sight(k), batch_.radiance(k), batch_.isTextured(k)};
        }
      }
    }
  }

  bool fillBlock(int x0, int x1, int y0, int y1, int row, Pixels* pixels) const {
    const auto width = static_cast<size_t>(rays_.width());
    const CameraRays::Block block = rays_.block(x0, y0);
    if (block == CameraRays::Block::kPartlyValid || !fill_blocks_) return false;
    const Corner* above = corners_.data() + static_cast<size_t>(row * columns_ + x0 / kBlock);
    const Corner* below = above + columns_;
    const auto [darkest, brightest] =
        std::minmax({above[0].radiance, above[1].radiance, below[0].radiance, below[1].radiance});
    const Sight sight = above[0].sight;
    if (above[1].sight != sight || below[0].sight != sight || below[1].sight != sight ||
        above[0].is_textured || brightest - darkest > kStep || !mask_.isFree(x0, x1, y0, y1)) {
      return false;
    }
    for (int y = y0; y < y1; ++y) {
      const float b = (static_cast<float>(y - y0) + 0.5F) / static_cast<float>(y1 - y0);
      const float left = (1 - b) * above[0].radiance + b * below[0].radiance;
      const float right = (1 - b) * above[1].radiance + b * below[1].radiance;
      for (int x = x0; x < x1; ++x) {
        const float a = (static_cast<float>(x - x0) + 0.5F) / static_cast<float>(x1 - x0);
        const size_t pixel = static_cast<size_t>(y) * width + static_cast<size_t>(x);
        pixels->sight[pixel] = sight;
        pixels->radiance[pixel] = (1 - a) * left + a * right;
      }
    }
    return true;
  }

  void castCentres(int x0, int x1, int y0, int y1, Pixels* pixels) {
    std::array<size_t, Raycaster::kPacket> slots{};
    batch_.clear();
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const size_t pixel =
            static_cast<size_t>(y) * static_cast<size_t>(rays_.width()) + static_cast<size_t>(x);
        if (mask_.curves(pixel) > 0) continue;
        const int valid_corners = rays_.validCorners(x, y);
        if (valid_corners == 4) {
          slots[batch_.count()] = pixel;
          batch_.add(batch_.toWorld(rays_.centreRay(x, y)));
        } else if (valid_corners == 0) {
          pixels->sight[pixel] = kNoRay;
        }
      }
    }
    batch_.cast();
    for (size_t k = 0; k < batch_.count(); ++k) {
      pixels->sight[slots[k]] = batch_.sight(k);
      pixels->radiance[slots[k]] = batch_.radiance(k);
    }
  }

  const CameraRays& rays_;
  const PixelMask& mask_;
  RayBatch batch_;
  bool fill_blocks_;
  int columns_ = 0;  ///< Of corners_.
  std::vector<Corner> corners_;
};

/// Positions of the samples in a pixel, in 1 / PixelResponse::kPositions px: a rank-1 lattice. Both
/// projections hit each of the 64 strata once, so edges along the axes are as fine as 1/64 px, and
/// 19 keeps the points apart in between (the best generator for 64). In bit-reversed order, so that
/// any first few are spread over the pixel.
constexpr int kStratum = PixelResponse::kPositions / kFineSamples;
struct SamplePositions {
  std::array<int, kFineSamples> u, v;
};
/// The lattice in its eight mirrorings. Edges along one of its directions (113 degrees for one of
/// them) are seen coarsely, 0.031 px rms; as each pixel draws one of the eight, such an edge is not
/// unlucky in all of its pixels.
constexpr std::array<SamplePositions, 8> samplePositions() {
  constexpr int kGenerator = 19;
  std::array<SamplePositions, 8> all{};
  for (int m = 0; m < kFineSamples; ++m) {
    int k = 0;
    for (int bit = 1, rest = m; bit < kFineSamples; bit *= 2, rest /= 2) k = 2 * k + rest % 2;
    const int u = k * kStratum, v = k * kGenerator % kFineSamples * kStratum;
    for (size_t way = 0; way < all.size(); ++way) {
      const int a = (way & 1) != 0 ? PixelResponse::kPositions - kStratum - u : u;
      const int b = (way & 2) != 0 ? PixelResponse::kPositions - kStratum - v : v;
      all[way].u[static_cast<size_t>(m)] = (way & 4) != 0 ? b : a;
      all[way].v[static_cast<size_t>(m)] = (way & 4) != 0 ? a : b;
    }
  }
  return all;
}

/// A pixel seen through its samples: a constant, and samples that differ from it.
struct FinePixel {
  struct Sample {
    int u, v;     ///< Position, 0 .. PixelResponse::kPositions - 1.
    float value;  ///< What it adds to the constant, over the number of samples.
  };
  float constant = 0;
  size_t count = 0;
  std::array<Sample, kFineSamples> samples;
};

/// Looks at single pixels with many samples.
class FineSampler {
 public:
  /// @param shade_all  Shade every sample, not one for all of a flat surface.
  FineSampler(const CameraRays& rays, const RayBatch& batch, bool shade_all)
      : rays_(rays), batch_(batch), shade_all_(shade_all) {}

  /// @param may_stop  One packet is enough if it shows surfaces without a step between them.
  /// @param borders   If nothing but one or two straight edges passes the pixel, the normals (world
  ///                  frame) of the planes through them and the camera; else nullptr.
  void look(int i,
            int j,
            uint64_t shift_bits,
            bool may_stop,
            const std::array<const Eigen::Vector3f*, 2>& borders,
            FinePixel* pixel) {
    prepare(i, j, shift_bits);
    size_t samples = kFineSamples;
    if ((may_stop || borders[0] != nullptr) && batch_.count() == kFineSamples) {
      gather(0, Raycaster::kPacket);
      shade();
      if (may_stop && share_count_ > 1 && allFlat() && spread() <= kStep) {
        samples = Raycaster::kPacket;
      } else {
        if (borders[0] == nullptr || !gatherBySide(borders)) {
          gather(Raycaster::kPacket, kFineSamples);
        }
        shade();
      }
    } else {
      gather(0, batch_.count());
      shade();
    }
    // The surface with the most samples is the constant; the first one wins a tie.
    size_t most = 0;
    for (size_t k = 1; k < share_count_; ++k) {
      if (shares_[k].samples > shares_[most].samples) most = k;
    }
    pixel->constant = shares_[most].radiance;
    pixel->count = 0;
    const float weight = 1 / static_cast<float>(samples);
    for (size_t k = 0; k < samples; ++k) {
      const Share& share = shares_[share_of_[k]];
      const float value = share.one_for_all ? share.radiance : values_[k];
      if (value == pixel->constant) continue;
      pixel->samples[pixel->count++] = {u_[k], v_[k], (value - pixel->constant) * weight};
    }
  }

 private:
  /// A sight within the pixel.
  struct Share {
    Sight sight = 0;
    bool one_for_all = true;  ///< Its radiance stands for all samples.
    int samples = 0;
    size_t first = 0;  ///< Its first ray.
    Eigen::Vector3f ray_sum{0, 0, 0};
    float radiance_sum = 0;
    float radiance = 0;
  };

  /// Rays of all samples; slots_ says which sample each ray belongs to.
  void prepare(int i, int j, uint64_t shift_bits) {
    static constexpr auto kLattices = samplePositions();
    const SamplePositions& lattice = kLattices[shift_bits >> 61];
    constexpr int kMask = PixelResponse::kPositions - 1;
    const int shift_u = static_cast<int>(shift_bits >> 16) & kMask;
    const int shift_v = static_cast<int>(shift_bits >> 32) & kMask;
    for (size_t k = 0; k < kFineSamples; ++k) {
      u_[k] = (lattice.u[k] + shift_u) & kMask;
      v_[k] = (lattice.v[k] + shift_v) & kMask;
      a_[k] = (static_cast<float>(u_[k]) + 0.5F) / PixelResponse::kPositions;
      b_[k] = (static_cast<float>(v_[k]) + (DLSD_MUTANT("render-row-shift") ? 8.5F : 0.5F)) /
              PixelResponse::kPositions;
      slots_[k] = k;
    }
    share_count_ = 0;
    if (rays_.isExact(i, j)) {
      unproject(i, j);
    } else {
      batch_.setBilinear({batch_.toWorld(rays_.cornerRay(i, j)),
                          batch_.toWorld(rays_.cornerRay(i + 1, j)),
                          batch_.toWorld(rays_.cornerRay(i, j + 1)),
                          batch_.toWorld(rays_.cornerRay(i + 1, j + 1))},
                         a_.data(),
                         b_.data());
    }
  }

  void unproject(int i, int j) {
    std::array<double, kFineSamples> u, v, x, y, z;
    std::array<uint8_t, kFineSamples> valid;
    for (size_t k = 0; k < kFineSamples; ++k) {
      u[k] = i - 0.5 + static_cast<double>(a_[k]);
      v[k] = j - 0.5 + static_cast<double>(b_[k]);
    }
    unprojectAll(rays_.camera(), u, v, x, y, z, valid);
    batch_.clear();
    for (size_t k = 0; k < kFineSamples; ++k) {
      if (valid[k] == 0) continue;
      slots_[batch_.count()] = k;
      batch_.add(batch_.toWorld(Eigen::Vector3d(x[k], y[k], z[k]).cast<float>()));
    }
    if (batch_.count() == kFineSamples) return;
    // Samples without a ray are black.
    shares_[0] = Share();
    shares_[0].sight = kNoRay;
    shares_[0].samples = static_cast<int>(kFineSamples - batch_.count());
    share_count_ = 1;
    share_of_.fill(0);
  }

  /// Casts rays and sorts them by surface.
  void gather(size_t from, size_t to) {
    batch_.cast(from, to);
    for (size_t k = from; k < to; ++k) {
      const Sight sight = batch_.sight(k);
      size_t at = 0;
      while (at < share_count_ && shares_[at].sight != sight) ++at;
      Share& share = shares_[at];
      if (at == share_count_) {
        share = Share();
        share.sight = sight;
        share.one_for_all = batch_.isFlat(k) && !shade_all_;
        share.first = k;
        ++share_count_;
      }
      share_of_[slots_[k]] = static_cast<uint8_t>(at);
      ++share.samples;
      if (share.one_for_all) {
        share.ray_sum += batch_.ray(k);
      } else {
        values_[slots_[k]] = batch_.radiance(k);
        share.radiance_sum += values_[slots_[k]];
      }
    }
  }

  /// After the first packet: if each side of the borders shows one flat surface alone, the other
  /// samples see what their side shows; those of a side without a sample so far are cast. False,
  /// with nothing done, where sides show more.
  bool gatherBySide(const std::array<const Eigen::Vector3f*, 2>& borders) {
    constexpr size_t kNoShare = kFineSamples;
    std::array<size_t, 4> shown{kNoShare, kNoShare, kNoShare, kNoShare};
    std::array<uint8_t, kFineSamples> side;
    const Eigen::Vector3f first = *borders[0];
    const Eigen::Vector3f second = borders[1] != nullptr ? *borders[1] : first;
    for (size_t k = 0; k < kFineSamples; ++k) {
      const Eigen::Vector3f ray = batch_.ray(k);
      side[k] = static_cast<uint8_t>((first.dot(ray) > 0 ? 1 : 0) + (second.dot(ray) > 0 ? 2 : 0));
    }
    for (size_t k = 0; k < Raycaster::kPacket; ++k) {
      const size_t share = share_of_[slots_[k]];
      size_t& known = shown[side[k]];
      if (!shares_[share].one_for_all || (known != kNoShare && known != share)) return false;
      known = share;
    }
    size_t next = Raycaster::kPacket;
    for (size_t k = next; k < kFineSamples; ++k) {
      if (shown[side[k]] != kNoShare) continue;
      batch_.swap(k, next);
      std::swap(side[k], side[next]);
      std::swap(slots_[k], slots_[next]);
      ++next;
    }
    gather(Raycaster::kPacket, next);
    for (size_t k = next; k < kFineSamples; ++k) {
      const size_t share = shown[side[k]];
      share_of_[slots_[k]] = static_cast<uint8_t>(share);
      ++shares_[share].samples;
      shares_[share].ray_sum += batch_.ray(k);
    }
    return true;
  }

  /// Radiance of the surfaces. Over a pixel it changes linearly on a flat one, so that in the
  /// middle of its samples it is the mean.
  void shade() {
    for (size_t k = 0; k < share_count_; ++k) {
      Share& share = shares_[k];
      if (share.sight == kNoRay) continue;
      share.radiance = share.one_for_all ? batch_.radiance(share.first, share.ray_sum)
                                         : share.radiance_sum / static_cast<float>(share.samples);
    }
  }

  /// Whether one radiance stands for all samples of each surface.
  [[nodiscard]] bool allFlat() const {
    return std::all_of(shares_.begin(),
                       shares_.begin() + static_cast<std::ptrdiff_t>(share_count_),
                       [](const Share& share) { return share.one_for_all; });
  }
  /// Difference between the brightest and the darkest surface.
  [[nodiscard]] float spread() const {
    float lo = shares_[0].radiance, hi = lo;
    for (size_t k = 1; k < share_count_; ++k) {
      lo = std::min(lo, shares_[k].radiance);
      hi = std::max(hi, shares_[k].radiance);
    }
    return hi - lo;
  }

  const CameraRays& rays_;
  RayBatch batch_;
  bool shade_all_;
  std::array<int, kFineSamples> u_, v_;    ///< Positions of the samples.
  std::array<float, kFineSamples> a_, b_;  ///< The same as fractions of the pixel.
  std::array<size_t, kFineSamples> slots_;
  std::array<uint8_t, kFineSamples> share_of_;
  std::array<float, kFineSamples> values_;
  size_t share_count_ = 0;
  std::array<Share, kFineSamples + 1> shares_;
};

/// Light of fine pixels of one band of rows, spread over the pixels around them by the response.
class SplatBand {
 public:
  /// Rows first - radius .. end + radius - 1 of the image.
  SplatBand(const PixelResponse& response, int width, int height, int first, int end)
      : response_(response),
        width_(width),
        height_(height),
        first_(first),
        stride_(static_cast<size_t>(width + 2 * response.radius()) + response.stride()),
        light_(stride_ * static_cast<size_t>(end - first + 2 * response.radius()), 0.0F),
        spread_(response.stride() * static_cast<size_t>(2 * response.radius() + 1)) {}

  void add(int i, int j, const FinePixel& pixel) {
    if (pixel.count == 0) return;
    std::fill(spread_.begin(), spread_.end(), 0.0F);
    const size_t taps = static_cast<size_t>(2 * response_.radius() + 1);
    const size_t stride = response_.stride();
    for (size_t term = 0; term < response_.terms(); ++term) {
      for (size_t k = 0; k < pixel.count; ++k) {
        const FinePixel::Sample& s = pixel.samples[k];
        const float* across = response_.taps(term, s.u);
        const float* down = response_.taps(term, s.v);
        const float value = s.value * response_.sign(term);
        float* out = spread_.data();
        for (size_t y = 0; y < taps; ++y) {
          const float weight = value * down[y];
          for (size_t x = 0; x < stride; x += 8, out += 8) {
            for (size_t lane = 0; lane < 8; ++lane) out[lane] += weight * across[x + lane];
          }
        }
      }
    }
    // Border pixels continue the image as far as their light reaches it.
    const int radius = response_.radius();
    const int left = i == 0 ? radius : 0, right = i == width_ - 1 ? radius : 0;
    const int up = j == 0 ? radius : 0, down = j == height_ - 1 ? radius : 0;
    for (int y = j - up; y <= j + down; ++y) {
      for (int x = i - left; x <= i + right; ++x) addSpread(x, y);
    }
  }

  /// Light of a row of the image, or nullptr if it is out of reach.
  [[nodiscard]] const float* row(int y) const {
    const int k = y - first_ + response_.radius();
    if (k < 0 || static_cast<size_t>(k) * stride_ >= light_.size()) return nullptr;
    return light_.data() + static_cast<size_t>(k) * stride_ + response_.radius();
  }

 private:
  void addSpread(int i, int j) {
    const int radius = response_.radius(), stride = static_cast<int>(response_.stride());
    for (int y = -radius; y <= radius; ++y) {
      const int row_index = j + y - first_ + radius;
      if (row_index < 0 || static_cast<size_t>(row_index) * stride_ >= light_.size()) continue;
      float* out = light_.data() + static_cast<size_t>(row_index) * stride_;
      const float* in = spread_.data() + static_cast<size_t>((y + radius) * stride);
      const int from = std::max(0, -i), to = std::min(stride, static_cast<int>(stride_) - i);
      for (int k = from; k < to; ++k) out[i + k] += in[k];
    }
  }

  const PixelResponse& response_;
  int width_, height_, first_;
  size_t stride_;
  std::vector<float> light_;
  std::vector<float> spread_;
};

/// Pixels in which more than one surface may show: not seen yet, or unlike one of their neighbours.
bool needsFineLook(const Pixels& pixels, int width, int height, int i, int j) {
  const auto at = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  };
  const size_t here = at(i, j);
  if (pixels.sight[here] == kUnknown) return true;
  const auto differs = [&](size_t there) {
    return pixels.sight[there] != kUnknown &&
           (pixels.sight[there] != pixels.sight[here] ||
            std::abs(pixels.radiance[there] - pixels.radiance[here]) > kStep);
  };
  return (i > 0 && differs(at(i - 1, j))) || (i + 1 < width && differs(at(i + 1, j))) ||
         (j > 0 && differs(at(i, j - 1))) || (j + 1 < height && differs(at(i, j + 1)));
}

}  // namespace

CameraRays::CameraRays(const Camera& camera) : camera_(camera) {
  const auto columns = static_cast<size_t>(width() + 1), rows = static_cast<size_t>(height() + 1);
  for (auto* plane : {&x_, &y_, &z_}) plane->resize(columns * rows);
  valid_.resize(columns * rows);
  exact_.resize((columns - 1) * (rows - 1));
  std::vector<double> u(columns), v(columns), x(columns), y(columns), z(columns);
  for (size_t j = 0; j < rows; ++j) {
    for (size_t i = 0; i < columns; ++i) {
      u[i] = static_cast<double>(i) - 0.5;
      v[i] = static_cast<double>(j) - 0.5;
    }
    const std::span<uint8_t> valid(valid_.data() + j * columns, columns);
    unprojectAll(camera_, u, v, x, y, z, valid);
    for (size_t i = 0; i < columns; ++i) {
      const bool ok = valid[i] != 0;
      x_[j * columns + i] = ok ? static_cast<float>(x[i]) : 0;
      y_[j * columns + i] = ok ? static_cast<float>(y[i]) : 0;
      z_[j * columns + i] = ok ? static_cast<float>(z[i]) : 1;
    }
  }
  block_columns_ = (width() + kBlock - 1) / kBlock;
  for (int y0 = 0; y0 < height(); y0 += kBlock) {
    for (int x0 = 0; x0 < width(); x0 += kBlock) {
      const int x1 = std::min(width(), x0 + kBlock), y1 = std::min(height(), y0 + kBlock);
      int valid_count = 0;
      for (int j = y0; j <= y1; ++j) {
        for (int i = x0; i <= x1; ++i) valid_count += cornerValid(i, j) ? 1 : 0;
      }
      const int all = (x1 - x0 + 1) * (y1 - y0 + 1);
      blocks_.push_back(valid_count == all ? Block::kValid
                        : valid_count == 0 ? Block::kInvalid
                                           : Block::kPartlyValid);
    }
  }
  // The interpolated ray of each pixel's centre must project back onto it.
  std::vector<uint8_t> valid(columns);
  for (size_t j = 0; j + 1 < rows; ++j) {
    const int jj = static_cast<int>(j);
    for (size_t i = 0; i + 1 < columns; ++i) {
      const int ii = static_cast<int>(i);
      const Eigen::Vector3d centre = (cornerRay(ii, jj) + cornerRay(ii + 1, jj) +
                                      cornerRay(ii, jj + 1) + cornerRay(ii + 1, jj + 1))
                                         .cast<double>();
      x[i] = centre.x();
      y[i] = centre.y();
      z[i] = centre.z();
    }
    projectAll(camera_, x, y, z, u, v, valid);
    for (size_t i = 0; i + 1 < columns; ++i) {
      const int ii = static_cast<int>(i);
      const bool corners_valid = cornerValid(ii, jj) && cornerValid(ii + 1, jj) &&
                                 cornerValid(ii, jj + 1) && cornerValid(ii + 1, jj + 1);
      const double err = std::hypot(u[i] - static_cast<double>(i), v[i] - static_cast<double>(j));
      const bool interpolates = corners_valid && valid[i] != 0 && err <= kMaxErrPx;
      exact_[j * (columns - 1) + i] = interpolates ? 0 : 1;
    }
  }
}

Eigen::Vector3f CameraRays::centreRay(int i, int j) const {
  if (isExact(i, j)) {
    const auto ray = camera_.unproject({i, j});
    if (ray) return ray->cast<float>();
  }
  return (cornerRay(i, j) + cornerRay(i + 1, j) + cornerRay(i, j + 1) + cornerRay(i + 1, j + 1)) /
         4;
}

size_t CameraRays::exactCount() const {
  return static_cast<size_t>(std::count(exact_.begin(), exact_.end(), uint8_t{1}));
}

Rendering renderRadiance(const Scene& scene,
                         const Raycaster& raycaster,
                         const Shader& shader,
                         const CameraRays& rays,
                         const Pose& pose,
                         const std::vector<EdgeSpan>& spans,
                         uint64_t key,
                         const PixelResponse& response,
                         Sampling sampling) {
  const int width = rays.width(), height = rays.height();
  const auto w = static_cast<size_t>(width);
  const bool adaptive = sampling == Sampling::kAdaptive;
  const RayBatch prototype(raycaster, shader, pose);
  PixelMask mask(width, height);
  Pixels pixels{std::vector<Sight>(w * static_cast<size_t>(height), kUnknown),
                std::vector<float>(w * static_cast<size_t>(height), 0.0F)};
  std::vector<Eigen::Vector3f> borders;  // Of the spans.
  if (adaptive) {
    for (size_t k = 0; k < spans.size(); ++k) {
      // Middles of rods and of their shadows are no borders.
      const Edge& edge = scene.edges[static_cast<size_t>(spans[k].edge)];
      if (!isBarMiddle(scene, edge)) mask.addCurve(spans[k].curve, static_cast<int>(k));
      borders.push_back((pose.cam_from_world.transpose() * spans[k].arc.normal).cast<float>());
    }
    addRoundOutlines(scene, rays.camera(), pose, &mask);
    forEachBand(height, [&](int /*band*/, int first, int end) {
      FirstLook(rays, mask, prototype, !shader.hasShadows()).look(first, end, &pixels);
    });
  }

  Rendering rendering;
  std::vector<float> constants(pixels.radiance.size());
  std::vector<std::optional<SplatBand>> bands(static_cast<size_t>(bandCount(height)));
  std::vector<size_t> fine_pixels(bands.size(), 0);
  forEachBand(height, [&](int band, int first, int end) {
    const auto b = static_cast<size_t>(band);
    SplatBand& splats = bands[b].emplace(response, width, height, first, end);
    FineSampler sampler(rays, prototype, !adaptive);
    FinePixel fine;
    for (int j = first; j < end; ++j) {
      for (int i = 0; i < width; ++i) {
        const size_t pixel = static_cast<size_t>(j) * w + static_cast<size_t>(i);
        if (!needsFineLook(pixels, width, height, i, j) &&
            !shader.isTextured(pixels.sight[pixel])) {
          constants[pixel] = pixels.radiance[pixel];
          continue;
        }
        // Anything thin has two borders.
        const bool may_stop = adaptive && mask.curves(pixel) < 2;
        std::array<const Eigen::Vector3f*, 2> own{nullptr, nullptr};
        if (adaptive && mask.curves(pixel) <= 2) {
          const auto& [one, other] = mask.owners(pixel);
          const bool known = one != PixelMask::kNoOwner &&
                             (mask.curves(pixel) == 1 || other != PixelMask::kNoOwner);
          if (known) own[0] = &borders[static_cast<size_t>(one)];
          if (known && mask.curves(pixel) == 2) own[1] = &borders[static_cast<size_t>(other)];
        }
        sampler.look(i, j, hashCounters({key, pixel}), may_stop, own, &fine);
        constants[pixel] = fine.constant;
        splats.add(i, j, fine);
        ++fine_pixels[b];
      }
    }
  });
  for (const size_t count : fine_pixels) rendering.fine_pixels += count;

  rendering.radiance = std::move(pixels.radiance);
  response.convolve(width, height, constants, &rendering.radiance);
  forEachBand(height, [&](int band, int first, int end) {
    for (int j = first; j < end; ++j) {
      float* out = rendering.radiance.data() + static_cast<size_t>(j) * w;
      // Always in this order, as floats want.
      for (const int from : {band, band - 1, band + 1}) {
        if (from < 0 || from >= static_cast<int>(bands.size())) continue;
        const float* light = bands[static_cast<size_t>(from)]->row(j);
        if (light == nullptr) continue;
        for (size_t i = 0; i < w; ++i) out[i] += light[i];
      }
    }
  });
  response.blurRest(width, height, &rendering.radiance);
  return rendering;
}

}  // namespace dlsd
