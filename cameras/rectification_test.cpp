#include "cameras/rectification.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "cameras/arc.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180;

Camera tumVi() {
  return makeCamera(
      "kannala_brandt",
      std::vector{190.978, 190.973, 254.932, 256.897, 0.003482, 0.000715, -0.002053, 0.000203},
      512,
      512);
}
Camera tumWide() {
  return makeCamera(
      "fov", std::vector{446.915863, 447.071228, 631.219238, 510.997498, 0.933271}, 1280, 1024);
}
/// Image circle of 180 degrees inside the image.
Camera circle() {
  return makeCamera(
      "kannala_brandt",
      std::vector{166.25, 166.125, 320.375, 254.375, -0.0125, 0.0041, -0.0032, 4.1e-4},
      640,
      512,
      M_PI / 2);
}
Camera pinhole() {
  return makeCamera("pinhole", std::vector{320.0, 321.0, 318.0, 255.0}, 640, 512);
}

Eigen::Matrix3d someRotation() {
  return Eigen::AngleAxisd(0.3, Vector3d(0.2, 1, -0.4).normalized()).toRotationMatrix();
}

ViewRequest request(ViewKind kind, int width, int height, std::optional<double> fov_deg) {
  ViewRequest r;
  r.kind = kind;
  r.width = width;
  r.height = height;
  if (fov_deg) r.fov_rad = *fov_deg * kDegree;
  return r;
}

constexpr ViewKind kKinds[] = {
    ViewKind::kPinhole, ViewKind::kCylindrical, ViewKind::kEquirectangular};

TEST(VirtualView, PixelsAndRaysAreInverse) {
  for (const ViewKind kind : kKinds) {
    ViewRequest r = request(kind, 400, 300, 120);
    r.cam_from_view = someRotation();
    const VirtualView view = centredView(r);
    double worst = 0;
    int count = 0;
    for (double v = -0.5; v < 300; v += 7.25) {
      for (double u = -0.5; u < 400; u += 9.5) {
        const auto ray = view.rayInCam({u, v});
        if (!ray) continue;
        ++count;
        EXPECT_NEAR(ray->norm(), 1, 1e-15);
        const auto pixel = view.pixelOf(3 * *ray);
        ASSERT_TRUE(pixel);
        worst = std::max(worst, (*pixel - Vector2d(u, v)).norm());
      }
    }
    EXPECT_GT(count, 1000);
    EXPECT_LE(worst, 1e-11);
  }
}

// The three definitions, on rays in the frame of the view.
TEST(VirtualView, FollowsItsEquations) {
  const auto pixel = [](ViewKind kind, const Vector3d& ray) {
    VirtualView view;
    view.kind = kind;
    view.fx = 100;
    view.fy = 200;
    view.cx = 7;
    view.cy = 9;
    return view.pixelOf(ray);
  };
  const Vector3d ray(1, -0.5, 2);
  const double longitude = std::atan(0.5), flat = std::sqrt(5.0);
  EXPECT_LE((*pixel(ViewKind::kPinhole, ray) - Vector2d(57, -41)).norm(), 1e-12);
  EXPECT_LE(
      (*pixel(ViewKind::kCylindrical, ray) - Vector2d(7 + 100 * longitude, 9 - 200 * 0.5 / flat))
          .norm(),
      1e-12);
  EXPECT_LE((*pixel(ViewKind::kEquirectangular, ray) -
             Vector2d(7 + 100 * longitude, 9 - 200 * std::atan(0.5 / flat)))
                .norm(),
            1e-12);
  EXPECT_FALSE(pixel(ViewKind::kPinhole, {1, 0, 0}));
  EXPECT_FALSE(pixel(ViewKind::kPinhole, {1, 0, -1}));
  EXPECT_FALSE(pixel(ViewKind::kCylindrical, {0, 1, 0}));
  EXPECT_TRUE(pixel(ViewKind::kCylindrical, {0.1, 1, -1}));
  EXPECT_TRUE(pixel(ViewKind::kEquirectangular, {0, 1, 0}));
  EXPECT_FALSE(pixel(ViewKind::kEquirectangular, {0, 0, 0}));
}

TEST(VirtualView, CentredViewsSpanTheFieldFromEdgeToEdge) {
  for (const ViewKind kind : kKinds) {
    const VirtualView view = centredView(request(kind, 641, 480, 100));
    const auto left = view.rayInCam({-0.5, view.cy}), right = view.rayInCam({640.5, view.cy});
    ASSERT_TRUE(left && right);
    EXPECT_NEAR(std::acos(left->dot(*right)), 100 * kDegree, 1e-12);
    EXPECT_NEAR(left->z(), right->z(), 1e-15);
    const auto axis = view.rayInCam({320, 239.5});
    ASSERT_TRUE(axis);
    EXPECT_LE((*axis - Vector3d::UnitZ()).norm(), 1e-15);
    EXPECT_EQ(view.fx, view.fy);
  }
}

TEST(VirtualView, IsACameraWhereThereIsSuchAModel) {
  const VirtualView view = centredView(request(ViewKind::kPinhole, 400, 300, 100));
  const auto camera = view.camera();
  ASSERT_TRUE(camera);
  const Vector3d ray(0.3, -0.4, 0.9);
  EXPECT_LE((*camera->project(ray) - *view.pixelOf(ray)).norm(), 1e-10);
  EXPECT_EQ(camera->width(), 400);
  EXPECT_FALSE(centredView(request(ViewKind::kCylindrical, 400, 300, 100)).camera());
}

TEST(ViewMaps, AreUnprojectionThenProjection) {
  const Camera source = tumVi();
  for (const ViewKind kind : kKinds) {
    ViewRequest r = request(kind, 160, 120, kind == ViewKind::kPinhole ? 140 : 340);
    r.cam_from_view = someRotation();
    const VirtualView view = centredView(r);
    const ViewMaps maps = viewMaps(source, view);
    size_t valid = 0, invalid = 0;
    for (int v = 0; v < 120; ++v) {
      for (int u = 0; u < 160; ++u) {
        const auto ray = view.rayInCam({double(u), double(v)});
        const auto pixel = ray ? source.project(*ray) : std::nullopt;
        const bool inside =
            pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= 511 && pixel->y() <= 511;
        const size_t at = size_t(v * 160 + u);
        ASSERT_EQ(maps.valid[at], inside ? 1 : 0) << u << " " << v;
        (inside ? valid : invalid) += 1;
        if (inside) {
          EXPECT_LE((Vector2d(maps.u[at], maps.v[at]) - *pixel).cwiseAbs().maxCoeff(), 1.0 / 65536);
        }
      }
    }
    EXPECT_GT(valid, 1000U);
    EXPECT_GT(invalid, 1000U);
  }
}

TEST(ViewMaps, NeverInterpolateFromPixelsWithoutARay) {
  const Camera source = circle();
  const ViewMaps maps =
      viewMaps(source, centredView(request(ViewKind::kEquirectangular, 360, 180, 360)));
  size_t valid = 0;
  for (size_t i = 0; i < maps.valid.size(); ++i) {
    if (maps.valid[i] == 0) continue;
    ++valid;
    const double u = double(maps.u[i]), v = double(maps.v[i]);
    for (const double x : {std::floor(u), std::ceil(u)}) {
      for (const double y : {std::floor(v), std::ceil(v)}) {
        ASSERT_TRUE(source.unproject({x, y}) && source.inImage({x, y}));
      }
    }
  }
  // Half the sphere, less the rim.
  EXPECT_GT(valid, size_t(0.97 * 180 * 180));
  EXPECT_LT(valid, size_t(180 * 181));
}

TEST(ViewMaps, OfAViewLikeTheSourceAreTheIdentity) {
  VirtualView view;
  view.width = 640;
  view.height = 512;
  view.fx = 320;
  view.fy = 321;
  view.cx = 318;
  view.cy = 255;
  const ViewMaps maps = viewMaps(pinhole(), view);
  // At the outermost pixels rounding may fall outside by a bit.
  for (size_t y = 1; y < 511; ++y) {
    for (size_t x = 1; x < 639; ++x) {
      const size_t i = y * 640 + x;
      ASSERT_EQ(maps.valid[i], 1);
      ASSERT_LE(std::abs(double(maps.u[i]) - double(x)), 1e-4);
      ASSERT_LE(std::abs(double(maps.v[i]) - double(y)), 1e-4);
    }
  }
}

// A 3D line is straight in a pinhole view, whatever the rotation: its image is the straight piece
// between its ends.
TEST(ViewMaps, StraightLinesBecomeStraight) {
  const Camera source = tumWide();
  ViewRequest r = request(ViewKind::kPinhole, 800, 600, 110);
  r.cam_from_view = someRotation();
  const VirtualView view = centredView(r);
  const Vector3d from = *view.rayInCam({40.0, 500.0}), to = *view.rayInCam({770.0, 90.0});
  double most_bent = 0;
  const Vector2d a = *source.project(from), b = *source.project(to);
  for (int i = 0; i <= 20; ++i) {
    const Vector3d on_line = from + i / 20.0 * (to - from);
    const Vector2d seen = *source.project(on_line);
    const Vector2d side(a.y() - b.y(), b.x() - a.x());
    most_bent = std::max(most_bent, std::abs(side.normalized().dot(seen - a)));
    // From the source's pixel back to the view.
    const auto pixel = view.pixelOf(*source.unproject(seen));
    ASSERT_TRUE(pixel);
    const Vector2d expected = Vector2d(40, 500) + (pixel->x() - 40) / 730 * Vector2d(730, -410);
    EXPECT_LE((*pixel - expected).norm(), 1e-9);
  }
  EXPECT_GT(most_bent, 10);
}

Camera sphere(int width) {
  const double w = width, h = width / 2;
  return makeCamera("equirectangular",
                    std::vector{w / (2 * M_PI), h / M_PI, (w - 1) / 2, (h - 1) / 2},
                    width,
                    width / 2);
}

TEST(ViewMaps, GoAroundAPanorama) {
  const Camera source = sphere(400);
  EXPECT_TRUE(goesAround(source));
  int all_across = 0;
  for (const ViewKind kind : kKinds) {
    for (const Vector3d& axis : {Vector3d(0, 1, 0), Vector3d(1, 0, 0), Vector3d(0, 0, 1)}) {
      ViewRequest r = request(kind, 300, 200, kind == ViewKind::kPinhole ? 100 : 360);
      r.cam_from_view = Eigen::AngleAxisd(axis.z() > 0 ? 0.4 : M_PI - 1e-3, axis).matrix();
      const VirtualView view = centredView(r);
      const ViewMaps maps = viewMaps(source, view);
      int shown = 0, across = 0;
      for (int y = 0; y < 200; ++y) {
        for (int x = 0; x < 300; ++x) {
          const size_t i = size_t(y) * 300 + size_t(x);
          const auto ray = view.rayInCam({double(x), double(y)});
          ASSERT_EQ(maps.valid[i] != 0, ray.has_value()) << x << " " << y;
          if (!ray) continue;
          ++shown;
          across += maps.u[i] < 0 || maps.u[i] > 399 ? 1 : 0;
          const Vector2d expected = *source.project(*ray);
          EXPECT_NEAR(maps.u[i], expected.x(), 1e-4);
          EXPECT_NEAR(maps.v[i], std::clamp(expected.y(), 0.0, 199.0), 1e-4);
        }
      }
      EXPECT_GT(shown, 10000);
      all_across += across;
    }
  }
  EXPECT_GT(all_across, 100);
}

TEST(ViewMaps, GoAroundNothingElse) {
  EXPECT_FALSE(goesAround(tumVi()));
  const double fx = 400 / (2 * M_PI);
  for (const auto& [params, width] : std::vector<std::pair<std::vector<double>, int>>{
           {{fx * 1.01, fx, 199.5, 99.5}, 400},  // less than the circle
           {{fx * 0.99, fx, 199.5, 99.5}, 400},  // more than the image has
           {{fx, fx, 150.0, 99.5}, 400},         // the seam is inside
           {{fx, fx, 199.5, 99.5}, 300}}) {      // a part of the circle
    const Camera source = makeCamera("equirectangular", params, width, 200);
    EXPECT_FALSE(goesAround(source));
    // Backwards, the seam shows.
    ViewRequest r = request(ViewKind::kPinhole, 300, 200, 90);
    r.cam_from_view = Eigen::AngleAxisd(M_PI, Vector3d::UnitY()).matrix();
    const ViewMaps maps = viewMaps(source, centredView(r));
    EXPECT_GT(std::count(maps.valid.begin(), maps.valid.end(), 0), 0);
  }
}

TEST(Crop, TakesAllOfAPanoramaWhateverTheAxis) {
  const Camera source = sphere(400);
  for (const Eigen::Matrix3d& turn :
       {Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
        Eigen::AngleAxisd(M_PI, Vector3d::UnitY()).toRotationMatrix(),
        Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX()).toRotationMatrix(),
        someRotation()}) {
    ViewRequest r = request(ViewKind::kEquirectangular, 360, 180, std::nullopt);
    r.cam_from_view = turn;
    const Crop crop = cropView(source, r);
    ASSERT_TRUE(crop.view);
    EXPECT_TRUE(crop.cut_by_fov);
    // 360 x 180 degrees between the outermost pixels.
    EXPECT_NEAR(359 / crop.view->fx, 2 * M_PI, 2e-3);
    EXPECT_NEAR(179 / crop.view->fy, M_PI, 1e-3);
    ViewRequest flat = request(ViewKind::kPinhole, 360, 180, 100);
    flat.cam_from_view = turn;
    const Crop pinhole_crop = cropView(source, flat);
    ASSERT_TRUE(pinhole_crop.view);
    EXPECT_NEAR(359 / pinhole_crop.view->fx, 2 * std::tan(50 * kDegree), 1e-6);
  }
}

// The view is what its camera says.
TEST(VirtualView, IsACamera) {
  for (const ViewKind kind : kKinds) {
    const VirtualView view = centredView(request(kind, 300, 200, 120));
    const std::optional<Camera> camera = view.camera();
    ASSERT_EQ(camera.has_value(), kind != ViewKind::kCylindrical);
    if (!camera) continue;
    EXPECT_EQ(camera->width(), 300);
    EXPECT_EQ(camera->height(), 200);
    for (const Vector3d& ray :
         {Vector3d(0.3, 0.2, 1), Vector3d(-0.7, -0.4, 0.6), Vector3d(0.1, -0.9, 0.4)}) {
      EXPECT_LE((*camera->project(ray) - *view.pixelOf(ray)).norm(), 1e-10);
    }
  }
}

size_t pixelsInside(const Camera& source, const VirtualView& view) {
  size_t count = 0;
  for (int y = 0; y < source.height(); ++y) {
    for (int x = 0; x < source.width(); ++x) {
      const auto ray = source.unproject({double(x), double(y)});
      const auto pixel = ray ? view.pixelOf(*ray) : std::nullopt;
      count += pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= view.width - 1 &&
                       pixel->y() <= view.height - 1
                   ? 1
                   : 0;
    }
  }
  return count;
}

TEST(Crop, ShowsNothingButTheSourceAndCannotBeMadeLarger) {
  const struct {
    Camera source;
    ViewKind kind;
    std::optional<double> fov_deg;
  } cases[] = {{tumWide(), ViewKind::kPinhole, 160},
               {tumWide(), ViewKind::kCylindrical, std::nullopt},
               {tumWide(), ViewKind::kEquirectangular, std::nullopt},
               {circle(), ViewKind::kPinhole, 120},
               {circle(), ViewKind::kEquirectangular, std::nullopt},
               {pinhole(), ViewKind::kPinhole, std::nullopt},
               {pinhole(), ViewKind::kCylindrical, std::nullopt}};
  for (const auto& c : cases) {
    for (const bool turned : {false, true}) {
      ViewRequest r = request(c.kind, 320, 256, c.fov_deg);
      if (turned) r.cam_from_view = someRotation();
      SCOPED_TRACE(std::string(c.source.modelName()) + " " + std::to_string(int(c.kind)) + " " +
                   std::to_string(turned));
      const Crop crop = cropView(c.source, r);
      ASSERT_TRUE(crop.view);
      const VirtualView& view = *crop.view;
      EXPECT_EQ(view.width, 320);
      EXPECT_EQ(view.height, 256);
      const ViewMaps maps = viewMaps(c.source, view);
      EXPECT_EQ(std::count(maps.valid.begin(), maps.valid.end(), 1), 320 * 256);
      // The view's axis is in it.
      EXPECT_TRUE(view.cx > 0 && view.cx < 319 && view.cy > 0 && view.cy < 255);
      if (crop.cut_by_fov) continue;
      // Each side moved out by 3 px of the view shows something that is not the source.
      for (int side = 0; side < 4; ++side) {
        VirtualView larger = view;
        larger.width += side < 2 ? 3 : 0;
        larger.height += side >= 2 ? 3 : 0;
        larger.cx += side == 0 ? 3 : 0;
        larger.cy += side == 2 ? 3 : 0;
        const ViewMaps more = viewMaps(c.source, larger);
        EXPECT_GT(std::count(more.valid.begin(), more.valid.end(), 0), 0) << side;
      }
    }
  }
}

// The source's own rectangle is the best crop of a pinhole.
TEST(Crop, OfAPinholeIsTheWholeImage) {
  const Crop crop = cropView(pinhole(), request(ViewKind::kPinhole, 640, 512, std::nullopt));
  ASSERT_TRUE(crop.view);
  EXPECT_FALSE(crop.cut_by_fov);
  EXPECT_NEAR(crop.view->fx, 320, 0.02);
  EXPECT_NEAR(crop.view->fy, 321, 0.02);
  EXPECT_NEAR(crop.view->cx, 318, 0.02);
  EXPECT_NEAR(crop.view->cy, 255, 0.02);
}

// 148 x 122 degrees: the rectangle of the paper's data set keeps almost all of it.
TEST(Crop, KeepsMostOfAWideImage) {
  const Camera source = tumWide();
  const Crop crop = cropView(source, request(ViewKind::kPinhole, 1280, 1024, 170));
  ASSERT_TRUE(crop.view);
  EXPECT_GT(double(pixelsInside(source, *crop.view)), 0.8 * 1280 * 1024);
}

TEST(Crop, SaysWhatBoundsIt) {
  // This one sees all of the front: no rectangle of a pinhole view holds it.
  const Crop unbound = cropView(circle(), request(ViewKind::kPinhole, 320, 256, std::nullopt));
  EXPECT_TRUE(unbound.cut_by_fov);
  const Crop bound = cropView(circle(), request(ViewKind::kPinhole, 320, 256, 100));
  ASSERT_TRUE(bound.view);
  EXPECT_TRUE(bound.cut_by_fov);
  EXPECT_NEAR(319 / bound.view->fx, 2 * std::tan(50 * kDegree), 1e-6);
  // The axis of the view looks backwards, where there is no image.
  ViewRequest behind = request(ViewKind::kPinhole, 320, 256, 60);
  behind.cam_from_view = Eigen::AngleAxisd(M_PI, Vector3d::UnitY()).toRotationMatrix();
  EXPECT_FALSE(cropView(circle(), behind).view);
}

TEST(VirtualView, RefusesWhatMakesNoSense) {
  for (const double bad : {180.0, 200.0, 0.0, -10.0, std::nan("")}) {
    EXPECT_THROW((void)centredView(request(ViewKind::kPinhole, 10, 10, bad)),
                 std::invalid_argument);
    EXPECT_THROW((void)cropView(pinhole(), request(ViewKind::kPinhole, 10, 10, bad)),
                 std::invalid_argument);
  }
  EXPECT_THROW((void)centredView(request(ViewKind::kCylindrical, 10, 10, 361)),
               std::invalid_argument);
  EXPECT_THROW((void)centredView(request(ViewKind::kPinhole, 0, 10, 90)), std::invalid_argument);
  EXPECT_THROW((void)centredView(request(ViewKind::kPinhole, 10, 65536, 90)),
               std::invalid_argument);
  EXPECT_THROW((void)centredView(request(ViewKind::kPinhole, 10, 10, std::nullopt)),
               std::invalid_argument);
  EXPECT_THROW((void)cropView(pinhole(), request(ViewKind::kPinhole, 1, 10, 90)),
               std::invalid_argument);
  ViewRequest skewed = request(ViewKind::kPinhole, 10, 10, 90);
  skewed.cam_from_view(0, 0) = 2;
  EXPECT_THROW((void)centredView(skewed), std::invalid_argument);
}

}  // namespace
}  // namespace dlsd
