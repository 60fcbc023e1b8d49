#include "cli/camera_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "cli/camera_commands.h"

namespace dlsd::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Colours as R, G, B.
const cv::Scalar kInk(40, 44, 52), kFaint(222, 226, 230), kMuted(120, 126, 134);
const cv::Scalar kAngle(20, 90, 190), kRadial(200, 90, 20), kTangential(30, 140, 80);
const cv::Scalar kOutside(70, 74, 82), kInside(244, 246, 248), kContour(20, 90, 190);

constexpr int kWidth = 1640, kHeight = 820;

void write(cv::Mat& canvas,
           const std::string& text,
           cv::Point at,
           const cv::Scalar& colour,
           double size = 0.5) {
  cv::putText(canvas, text, at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

/// Written with its middle at a point.
void writeCentred(
    cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& colour, double size) {
  const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, 1, nullptr);
  write(canvas, text, {at.x - extent.width / 2, at.y + extent.height / 2}, colour, size);
}

/// A round number near a sixth of the range.
double tick(double range) {
  const double raw = range / 6, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw) {
      return factor * power;
    }
  }
  return 10 * power;
}

struct Curve {
  std::vector<double> radius_px, angle_deg, radial, tangential;  ///< The last two in px/deg.
};

/// From the principal point in a direction as far as image and domain go.
Curve curveTowards(const Camera& camera, const Vector2d& centre, const Vector2d& corner) {
  constexpr int kSteps = 150;
  Curve curve;
  for (int i = 1; i <= kSteps; ++i) {
    const Vector2d pixel = centre + (corner - centre) * i / kSteps;
    const std::optional<Vector3d> ray = camera.unproject(pixel);
    const std::optional<Scale> scale = ray ? scaleAt(camera, *ray) : std::nullopt;
    if (!scale) {
      break;
    }
    curve.radius_px.push_back((pixel - centre).norm());
    curve.angle_deg.push_back(scale->angle_rad * kDegreesPerRad);
    curve.radial.push_back(scale->radial);
    curve.tangential.push_back(scale->tangential);
  }
  return curve;
}

void drawCurves(cv::Mat& canvas, const cv::Rect& box, const Camera& camera) {
  const double w = camera.width(), h = camera.height();
  const Vector2d centre =
      camera.project(Vector3d::UnitZ()).value_or(Vector2d((w - 1) / 2, (h - 1) / 2));
  std::vector<Curve> curves;
  double max_radius = 1, max_angle = 1, max_scale = 0;
  for (const Vector2d& corner : {Vector2d(-0.5, -0.5),
                                 Vector2d(w - 0.5, -0.5),
                                 Vector2d(-0.5, h - 0.5),
                                 Vector2d(w - 0.5, h - 0.5)}) {
    const Curve curve = curveTowards(camera, centre, corner);
    for (size_t i = 0; i < curve.radius_px.size(); ++i) {
      max_radius = std::max(max_radius, curve.radius_px[i]);
      max_angle = std::max(max_angle, curve.angle_deg[i]);
      max_scale = std::max({max_scale, curve.radial[i], curve.tangential[i]});
    }
    curves.push_back(curve);
  }
  // At the poles of a panorama the scale has no bound: what is far beyond most of the curves is
  // cut.
  std::vector<double> scales;
  for (const Curve& curve : curves) {
    scales.insert(scales.end(), curve.radial.begin(), curve.radial.end());
    scales.insert(scales.end(), curve.tangential.begin(), curve.tangential.end());
  }
  if (!scales.empty()) {
    const auto most = scales.begin() + long(scales.size() * 9 / 10);
    std::nth_element(scales.begin(), most, scales.end());
    max_scale = std::min(max_scale, 3 * *most);
  }
  max_scale = std::max(max_scale, 1e-9) * 1.08;
  max_angle *= 1.04;
  const auto at = [&](double radius, double value, double max_value) {
    constexpr int kShift = 16;  // fixed point
    return cv::Point(
        int(std::lround(kShift * (box.x + radius / max_radius * box.width))),
        int(std::lround(kShift * (box.y + box.height - value / max_value * box.height))));
  };
  const double radius_tick = tick(max_radius), scale_tick = tick(max_scale);
  for (double r = 0; r <= max_radius; r += radius_tick) {
    const int x = box.x + int(std::lround(r / max_radius * box.width));
    cv::line(canvas, {x, box.y}, {x, box.y + box.height}, kFaint);
    writeCentred(canvas, fmt::format("{:g}", r), {x, box.y + box.height + 16}, kInk, 0.45);
  }
  const double angle_tick = max_angle > 45 ? 10 : tick(max_angle);
  for (double a = 0; a <= max_angle; a += angle_tick) {
    const int y = box.y + box.height - int(std::lround(a / max_angle * box.height));
    cv::line(canvas, {box.x, y}, {box.x + box.width, y}, kFaint);
    writeCentred(canvas, fmt::format("{:g}", a), {box.x - 20, y}, kAngle, 0.45);
  }
  for (double s = 0; s <= max_scale; s += scale_tick) {
    const int y = box.y + box.height - int(std::lround(s / max_scale * box.height));
    writeCentred(canvas, fmt::format("{:g}", s), {box.x + box.width + 24, y}, kRadial, 0.45);
  }
  cv::rectangle(canvas, box, kMuted);
  const auto draw = [&](const Curve& curve,
                        const std::vector<double>& values,
                        double max_value,
                        const cv::Scalar& colour,
                        int thickness) {
    std::vector<cv::Point> points;
    for (size_t i = 0; i < values.size() && values[i] <= max_value; ++i) {
      points.push_back(at(curve.radius_px[i], values[i], max_value));
    }
    cv::polylines(canvas, points, false, colour, thickness, cv::LINE_AA, 4);
  };
  for (const Curve& curve : curves) {
    draw(curve, curve.tangential, max_scale, kTangential, 1);
    draw(curve, curve.radial, max_scale, kRadial, 1);
  }
  for (const Curve& curve : curves) {
    draw(curve, curve.angle_deg, max_angle, kAngle, 2);
  }
  write(canvas, "field angle, degrees", {box.x - 30, box.y - 14}, kAngle, 0.45);
  write(canvas, "scale along", {box.x + box.width - 330, box.y - 14}, kRadial, 0.45);
  write(canvas, "and across", {box.x + box.width - 236, box.y - 14}, kTangential, 0.45);
  write(canvas, "the meridian, px/deg", {box.x + box.width - 150, box.y - 14}, kInk, 0.45);
  writeCentred(canvas,
               "distance from the principal point towards the four corners, px",
               {box.x + box.width / 2, box.y + box.height + 42},
               kInk,
               0.45);
}

void drawRegion(cv::Mat& canvas, const cv::Rect& box, const Camera& camera) {
  const double scale =
      std::min(double(box.width) / camera.width(), double(box.height) / camera.height());
  const int w = std::max(1, int(std::lround(camera.width() * scale)));
  const int h = std::max(1, int(std::lround(camera.height() * scale)));
  const int left = box.x + (box.width - w) / 2, top = box.y + (box.height - h) / 2;
  const auto pixelOf = [&](double x, double y) {
    return Vector2d((x + 0.5) / scale - 0.5, (y + 0.5) / scale - 0.5);
  };
  const auto canvasOf = [&](const Vector2d& pixel) {
    return cv::Point(left + int(std::lround((pixel.x() + 0.5) * scale - 0.5)),
                     top + int(std::lround((pixel.y() + 0.5) * scale - 0.5)));
  };
  // Field angle at every point of the panel, in degrees; no value where there is no ray.
  std::vector<std::optional<double>> angle(size_t(w) * size_t(h));
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const std::optional<Vector3d> ray = camera.unproject(pixelOf(x, y));
      if (ray) {
        angle[size_t(y) * size_t(w) + size_t(x)] = fieldAngle(*ray) * kDegreesPerRad;
      }
    }
  }
  const auto angleAt = [&](int x, int y) -> std::optional<double> {
    return x >= 0 && y >= 0 && x < w && y < h ? angle[size_t(y) * size_t(w) + size_t(x)]
                                              : std::nullopt;
  };
  double widest = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const std::optional<double> here = angleAt(x, y);
      cv::Scalar colour = here ? kInside : kOutside;
      if (here) {
        widest = std::max(widest, *here);
        const std::optional<double> right = angleAt(x + 1, y), below = angleAt(x, y + 1);
        const double gx = right ? *right - *here : 0, gy = below ? *below - *here : 0;
        const double slope = std::hypot(gx, gy);
        const double nearest = std::max(10.0, 10 * std::round(*here / 10));
        // A line about 1.4 px wide, twice as strong at 90 degrees.
        const double half = nearest == 90 ? 1.5 : 0.9;
        const double far = slope > 0 ? std::abs(*here - nearest) / slope : 1e9;
        const double ink = std::clamp(half + 0.5 - far, 0.0, 1.0);
        colour = (1 - ink) * kInside + ink * kContour;
      }
      canvas.at<cv::Vec3b>(top + y, left + x) = {
          uint8_t(colour[0]), uint8_t(colour[1]), uint8_t(colour[2])};
    }
  }
  cv::rectangle(canvas, {left - 1, top - 1, w + 2, h + 2}, kMuted);
  const std::optional<Vector2d> centre = camera.project(Vector3d::UnitZ());
  if (!centre || !camera.inImage(*centre)) {
    return;
  }
  cv::drawMarker(canvas, canvasOf(*centre), kRadial, cv::MARKER_CROSS, 14, 1, cv::LINE_AA);
  // Labels where each contour leaves the centre towards the right or, if it is not there, another
  // way.
  std::vector<cv::Rect> labels;
  for (int degrees = 10; degrees <= int(widest); degrees += 10) {
    for (const double azimuth : {0.0, M_PI, M_PI / 4, -M_PI / 4, 3 * M_PI / 4, -3 * M_PI / 4}) {
      const std::optional<Vector2d> pixel =
          camera.project(rayAt(degrees / kDegreesPerRad, azimuth));
      if (!pixel || !camera.inImage(*pixel) || !camera.unproject(*pixel)) {
        continue;
      }
      const std::string label = std::to_string(degrees);
      const cv::Size extent = cv::getTextSize(label, cv::FONT_HERSHEY_SIMPLEX, 0.4, 1, nullptr);
      const cv::Point at = canvasOf(*pixel);
      const cv::Rect background(at.x - extent.width / 2 - 2,
                                at.y - extent.height / 2 - 2,
                                extent.width + 4,
                                extent.height + 4);
      const cv::Rect panel(left, top, w, h);
      const bool covers_another =
          std::any_of(labels.begin(), labels.end(), [&](const cv::Rect& other) {
            return (other & background).area() > 0;
          });
      if ((background & panel) != background || covers_another) {
        continue;
      }
      labels.push_back(background);
      cv::rectangle(canvas, background, kInside, cv::FILLED);
      writeCentred(canvas, label, at, kContour, 0.4);
      break;
    }
  }
}

}  // namespace

Image drawCamera(const Camera& camera, const std::string& title) {
  Image image;
  image.width = kWidth;
  image.height = kHeight;
  image.channels = 3;
  image.bytes.assign(size_t(3) * kWidth * kHeight, 255);
  cv::Mat canvas(kHeight, kWidth, CV_8UC3, image.bytes.data());
  write(canvas,
        fmt::format(
            "{}   {}   {} x {} px", title, camera.modelName(), camera.width(), camera.height()),
        {30, 34},
        kInk,
        0.6);
  drawCurves(canvas, {70, 90, 690, 650}, camera);
  const cv::Rect region(840, 90, 770, 650);
  drawRegion(canvas, region, camera);
  writeCentred(canvas,
               "field angle every 10 degrees; dark: pixels without a ray; cross: principal point",
               {region.x + region.width / 2, region.y + region.height + 42},
               kInk,
               0.45);
  return image;
}

}  // namespace dlsd::cli
