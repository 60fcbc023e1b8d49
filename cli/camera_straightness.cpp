#include "cli/camera_straightness.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "cameras/arc.h"
#include "detector/detector.h"
#include "evaluation/detections.h"

namespace dlsd::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBandRad = M_PI / 18;
/// An image is cut into so many tiles each way, as independent witnesses.
constexpr int kTilesPerSide = 4;

double fieldAngle(const Vector3d& ray) {
  return std::atan2(std::hypot(ray.x(), ray.y()), ray.z());
}

/// Only read; OpenCV has no const view.
cv::Mat matOf(const Image& image) {
  const int type = CV_MAKETYPE(image.bits == 16 ? CV_16U : CV_8U, image.channels);
  return {image.height, image.width, type, const_cast<uint8_t*>(image.bytes.data())};  // NOLINT
}

double quantile(std::vector<double> values, double share) {
  const auto at = std::min(values.size() - 1, size_t(share * double(values.size())));
  std::nth_element(values.begin(), values.begin() + long(at), values.end());
  return values[at];
}

/// The pixel of the image that is nearest.
cv::Point nearestPixel(const Camera& camera, const Vector2d& pixel) {
  return {std::clamp(int(std::lround(pixel.x())), 0, camera.width() - 1),
          std::clamp(int(std::lround(pixel.y())), 0, camera.height() - 1)};
}

size_t tileOf(const Camera& camera, const Vector2d& pixel) {
  const cv::Point p = nearestPixel(camera, pixel);
  return size_t(kTilesPerSide * p.y / camera.height() * kTilesPerSide +
                kTilesPerSide * p.x / camera.width());
}

/// 0 (black) to 1, over the channels but alpha.
double brightness(const Image& image, const cv::Point& pixel) {
  const auto channels = size_t(image.channels);
  const size_t colours = std::min<size_t>(channels, 3);
  const size_t at = (size_t(pixel.y) * size_t(image.width) + size_t(pixel.x)) * channels;
  double sum = 0;
  for (size_t c = 0; c < colours; ++c) {
    if (image.bits == 16) {
      uint16_t value = 0;
      std::memcpy(&value, &image.bytes[2 * (at + c)], sizeof value);
      sum += value / 65535.0;
    } else {
      sum += image.bytes[at + c] / 255.0;
    }
  }
  return sum / double(colours);
}

/// The rim of the image circle is no straight thing: it keeps its field angle (within a degree, as
/// calibrations have it), and what is outside is black. A straight edge may do the one or the
/// other.
bool isImageCircle(const Camera& camera, const Image& image, const DetectedLine& line) {
  constexpr int kPoints = 9;
  constexpr double kSpreadRad = 1 * M_PI / 180, kBlack = 0.1;
  const std::optional<Vector2d> axis = camera.project(Vector3d::UnitZ());
  if (!axis) {
    return false;
  }
  double smallest = M_PI, largest = 0, outside = 0;
  int looked_at = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d ray = line.arc.at((i + 0.5) / kPoints);
    const double angle = fieldAngle(ray);
    smallest = std::min(smallest, angle);
    largest = std::max(largest, angle);
    const std::optional<Vector2d> at = camera.project(ray);
    if (!at) {
      continue;
    }
    const Vector2d outwards = (*at - *axis).stableNormalized();
    for (const double px : {4.0, 6.0}) {
      const Vector2d there = *at + px * outwards;
      if (camera.inImage(there)) {
        outside += brightness(image, nearestPixel(camera, there));
        ++looked_at;
      }
    }
  }
  return looked_at > 0 && outside / looked_at < kBlack && largest - smallest < 2 * kSpreadRad;
}

/// What one line's edge says.
struct LineMeasure {
  size_t tile = 0;
  double middle_angle_rad = 0, length_px = 0;
  std::vector<double> residual_px, angle_rad;  ///< By point.
  double bulge_px = 0, bulge_sigma_px = 0;     ///< Along the edge's normal, outwards where > 0.
  double across = 0;                           ///< Cosine between that normal and outwards.
};

/// Finds the edges of detected lines again, in a band of 3 px about them.
class EdgeMeter {
 public:
  explicit EdgeMeter(const Camera& camera)
      : camera_(camera), axis_px_(camera.project(Vector3d::UnitZ())) {}

  void setImage(const Image& image) {
    const cv::Mat pixels = matOf(image);
    cv::Mat grey = pixels;
    if (image.channels > 1) {
      cv::cvtColor(pixels, grey, image.channels == 4 ? cv::COLOR_RGBA2GRAY : cv::COLOR_RGB2GRAY);
    }
    grey.convertTo(grey, CV_32F, image.bits == 16 ? 255.0 / 65535 : 1);
    constexpr double kBlurPx = 1;
    cv::GaussianBlur(grey, grey, {5, 5}, kBlurPx);
    constexpr double kSobel = 1.0 / 8;  // grey levels per px
    cv::Sobel(grey, gx_, CV_32F, 1, 0, 3, kSobel);
    cv::Sobel(grey, gy_, CV_32F, 0, 1, 3, kSobel);
  }

  [[nodiscard]] std::optional<LineMeasure> measure(const DetectedLine& detected) const {
    const std::vector<Point> points = edgePoints(detected);
    if (points.size() < kMinPoints) {
      return std::nullopt;
    }
    LineMeasure line;
    line.length_px = detected.length_px;
    const Vector3d middle = detected.arc.at(0.5);
    line.middle_angle_rad = fieldAngle(middle);
    line.tile = tileOf(camera_, camera_.project(middle).value_or(*axis_px_));
    for (const Point& p : points) {
      line.angle_rad.push_back(fieldAngle(p.ray));
    }
    const std::vector<double> weights = fitPlane(detected, points, &line.residual_px);
    fitBend(points, weights, &line);
    return line;
  }

 private:
  static constexpr size_t kMinPoints = 20;

  struct Point {
    double s_px;        ///< Along the line.
    Vector2d outwards;  ///< Unit, image of the meridian.
    Vector2d normal;    ///< Unit, towards the brighter side.
    Vector3d ray;
    double rad_per_px;  ///< Of the angle to the plane, along the normal.
  };

  /// The points of the edge about one px apart, 2 px at each end left out; none if fewer than half
  /// of them show it.
  [[nodiscard]] std::vector<Point> edgePoints(const DetectedLine& detected) const {
    std::vector<Point> points;
    if (!axis_px_) {
      return points;
    }
    const std::vector<Vector2d> curve = imageCurve(camera_, detected.arc, 0, 1);
    size_t asked = 0;
    double before = 0, next = 2;
    for (size_t i = 1; i < curve.size(); ++i) {
      const Vector2d step = curve[i] - curve[i - 1];
      const double length = step.norm();
      for (; next <= before + length && next <= detected.length_px - 2; next += 1) {
        ++asked;
        const Vector2d tangent = step / length;
        const Vector2d at = curve[i - 1] + (next - before) * tangent;
        if (std::optional<Point> point = edgePoint(detected, at, tangent)) {
          point->s_px = next;
          points.push_back(*point);
        }
      }
      before += length;
    }
    if (2 * points.size() < asked) {
      points.clear();
    }
    return points;
  }

  [[nodiscard]] std::optional<Point> edgePoint(const DetectedLine& detected,
                                               const Vector2d& at,
                                               const Vector2d& tangent) const {
    Point point{};
    point.normal = {-tangent.y(), tangent.x()};
    const auto plus = camera_.unproject(at + 0.5 * point.normal);
    const auto minus = camera_.unproject(at - 0.5 * point.normal);
    if (!plus || !minus) {
      return std::nullopt;
    }
    point.rad_per_px = (*plus - *minus).dot(detected.arc.normal) * detected.polarity;
    if (point.rad_per_px < 0) {
      point.normal = -point.normal;
      point.rad_per_px = -point.rad_per_px;
    }
    const std::optional<double> offset = crest(at, point.normal);
    if (!offset || !(point.rad_per_px > 0)) {
      return std::nullopt;
    }
    const auto ray = camera_.unproject(at + *offset * point.normal);
    const auto jacobian = ray ? camera_.jacobian(*ray) : std::nullopt;
    const double r = ray ? std::hypot(ray->x(), ray->y()) : 0;
    if (!jacobian || !(r > 1e-6)) {
      return std::nullopt;
    }
    point.ray = *ray;
    const Vector3d meridian(ray->z() * ray->x() / r, ray->z() * ray->y() / r, -r);
    point.outwards = (*jacobian * meridian).normalized();
    return point;
  }

  /// Offset along the normal to the crest of the gradient along it that is nearest and at least
  /// half as high as the highest.
  [[nodiscard]] std::optional<double> crest(const Vector2d& at, const Vector2d& normal) const {
    constexpr int kReach = 8;  // half pixels
    double g[2 * kReach + 1];
    for (int i = -kReach; i <= kReach; ++i) {
      const Vector2d p = at + 0.5 * i * normal;
      if (!(p.x() >= 3 && p.y() >= 3 && p.x() < gx_.cols - 4 && p.y() < gx_.rows - 4)) {
        return std::nullopt;
      }
      const int x = int(p.x()), y = int(p.y());
      const double a = p.x() - x, b = p.y() - y;
      const auto along = [&](int px, int py) {
        return double(gx_.at<float>(py, px)) * normal.x() +
               double(gy_.at<float>(py, px)) * normal.y();
      };
      g[i + kReach] = (1 - b) * ((1 - a) * along(x, y) + a * along(x + 1, y)) +
                      b * ((1 - a) * along(x, y + 1) + a * along(x + 1, y + 1));
    }
    const double highest = *std::max_element(g + 2, g + 2 * kReach - 1);
    constexpr double kLowest = 2;  // grey levels per px
    if (!(highest >= kLowest)) {
      return std::nullopt;
    }
    std::optional<double> best;
    for (int i = 2; i <= 2 * kReach - 2; ++i) {
      if (!(g[i] >= 0.5 * highest && g[i] >= g[i - 1] && g[i] > g[i + 1])) {
        continue;
      }
      // Parabola through values 1 px apart: neighbours half a pixel apart share their pixels.
      const double bend = 2 * g[i] - g[i - 2] - g[i + 2];
      const double step = bend > 0 ? 0.5 * (g[i + 2] - g[i - 2]) / bend : 0;
      const double offset = 0.5 * (i - kReach) + step;
      if (!best || std::abs(offset) < std::abs(*best)) {
        best = offset;
      }
    }
    return best;
  }

  /// Plane through the points, those that jumped to another edge fading. Returns the weights.
  [[nodiscard]] static std::vector<double> fitPlane(const DetectedLine& detected,
                                                    const std::vector<Point>& points,
                                                    std::vector<double>* residual_px) {
    std::vector<double> weights(points.size(), 1), sizes(points.size());
    residual_px->resize(points.size());
    Vector3d n = detected.arc.normal;
    for (int round = 0; round < 6; ++round) {
      Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
      for (size_t i = 0; i < points.size(); ++i) {
        const double w = weights[i] / (points[i].rad_per_px * points[i].rad_per_px);
        moments += w * points[i].ray * points[i].ray.transpose();
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
      const Vector3d fitted = solver.eigenvectors().col(0);
      n = fitted.dot(n) < 0 ? Vector3d(-fitted) : fitted;
      for (size_t i = 0; i < points.size(); ++i) {
        // Positive on the brighter side, as the point's normal.
        (*residual_px)[i] = points[i].ray.dot(n) * detected.polarity / points[i].rad_per_px;
        sizes[i] = std::abs((*residual_px)[i]);
      }
      const double scale = std::max(0.1, 1.5 * quantile(sizes, 0.5));
      for (size_t i = 0; i < points.size(); ++i) {
        const double x = (*residual_px)[i] / (3 * scale);
        weights[i] = 1 / ((1 + x * x) * (1 + x * x));
      }
    }
    return weights;
  }

  /// Parabola through the residuals.
  static void fitBend(const std::vector<Point>& points,
                      const std::vector<double>& weights,
                      LineMeasure* line) {
    const double middle = 0.5 * (points.front().s_px + points.back().s_px);
    const auto powers = [&](const Point& p) {
      const double x = (p.s_px - middle) / 100;
      return Vector3d(1, x, x * x);
    };
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    double sum = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      const Vector3d x = powers(points[i]);
      a += weights[i] * x * x.transpose();
      b += weights[i] * line->residual_px[i] * x;
      line->across += weights[i] * points[i].outwards.dot(points[i].normal);
      sum += weights[i];
    }
    line->across /= sum;
    const Eigen::Matrix3d inverse = a.inverse();
    const Vector3d fit = inverse * b;
    double squares = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      squares += weights[i] * std::pow(line->residual_px[i] - fit.dot(powers(points[i])), 2);
    }
    constexpr double kAlike = 3;  // px along the edge over which errors are alike: smoothing
    // The middle of a chord of 1 (100 px) is off by a quarter of the quadratic coefficient.
    line->bulge_px = -fit[2] / 4;
    line->bulge_sigma_px = std::sqrt(kAlike * inverse(2, 2) * squares / sum) / 4;
  }

  const Camera& camera_;
  std::optional<Vector2d> axis_px_;
  cv::Mat gx_, gy_;
};

/// Weighted mean with Huber's weights (iterated), and its standard error from the scatter of lines,
/// or of tiles if that is larger: lines of one tile, in all the images, may be the same thing.
Bulge meanBulge(const std::vector<const LineMeasure*>& lines) {
  constexpr double kFloorPx = 0.03;  // real edges are no straighter
  constexpr int kRounds = 20;
  const auto sigma = [](const LineMeasure& line) {
    return std::hypot(line.bulge_sigma_px, kFloorPx);
  };
  Bulge bulge;
  std::vector<double> fading(lines.size(), 1), rest(lines.size()), sizes(lines.size());
  for (int round = 0; round < kRounds && !lines.empty(); ++round) {
    double numerator = 0, denominator = 0, spread = 0;
    std::array<double, kTilesPerSide * kTilesPerSide> of_tile{};
    for (size_t i = 0; i < lines.size(); ++i) {
      const double w = fading[i] / std::pow(sigma(*lines[i]), 2);
      numerator += w * lines[i]->across * lines[i]->bulge_px;
      denominator += w * lines[i]->across * lines[i]->across;
    }
    if (!(denominator > 0)) {
      break;
    }
    bulge.mean_px = numerator / denominator;
    for (size_t i = 0; i < lines.size(); ++i) {
      const double s = sigma(*lines[i]);
      rest[i] = (lines[i]->bulge_px - lines[i]->across * bulge.mean_px) / s;
      sizes[i] = std::abs(rest[i]);
      const double pull = fading[i] * rest[i] * lines[i]->across / s;
      spread += pull * pull;
      of_tile.at(lines[i]->tile) += pull;
    }
    double spread_of_tiles = 0;
    for (const double pull : of_tile) {
      spread_of_tiles += pull * pull;
    }
    bulge.sigma_px = std::sqrt(std::max(spread, spread_of_tiles)) / denominator;
    const double bound = 1.345 * std::max(1.0, 1.4826 * quantile(sizes, 0.5));
    for (size_t i = 0; i < lines.size(); ++i) {
      fading[i] = sizes[i] > bound ? bound / sizes[i] : 1;
    }
  }
  return bulge;
}

StraightnessBand summarise(int index, const std::vector<LineMeasure>& lines) {
  StraightnessBand band;
  band.from_rad = index * kBandRad;
  band.to_rad = (index + 1) * kBandRad;
  std::vector<double> sizes;
  std::vector<const LineMeasure*> members;
  double squares = 0;
  for (const LineMeasure& line : lines) {
    if (!(line.middle_angle_rad >= band.from_rad && line.middle_angle_rad < band.to_rad)) {
      continue;
    }
    members.push_back(&line);
    band.length_px += line.length_px;
    for (const double r : line.residual_px) {
      sizes.push_back(std::abs(r));
      squares += r * r;
    }
  }
  band.lines = members.size();
  if (!members.empty()) {
    band.rms_px = std::sqrt(squares / double(sizes.size()));
    band.median_px = quantile(sizes, 0.5);
    band.bulge = meanBulge(members);
  }
  return band;
}

/// Sums over the points on lines in one tile, of all images.
struct TileSums {
  double length_px = 0;
  double log_length = 0;  ///< Integral over the points of the log of the length of their line.

  TileSums& operator+=(const TileSums& other) {
    length_px += other.length_px;
    log_length += other.log_length;
    return *this;
  }
  [[nodiscard]] TileSums without(const TileSums& part) const {
    return {length_px - part.length_px, log_length - part.log_length};
  }
  [[nodiscard]] double mean() const { return length_px > 0 ? log_length / length_px : 0; }
};

TileSums total(const std::vector<TileSums>& tiles) {
  TileSums sum;
  for (const TileSums& tile : tiles) {
    sum += tile;
  }
  return sum;
}

/// total(a).mean() - total(b).mean() and its standard error: the tiles in which anything was found
/// left out one by one (jackknife).
struct Difference {
  double value = 0, sigma = 0;
};
Difference difference(const std::vector<TileSums>& a, const std::vector<TileSums>& b) {
  const TileSums all_a = total(a), all_b = total(b);
  std::vector<double> left_out;
  for (size_t t = 0; t < a.size(); ++t) {
    if (a[t].length_px + b[t].length_px > 0) {
      left_out.push_back(all_a.without(a[t]).mean() - all_b.without(b[t]).mean());
    }
  }
  const auto n = double(left_out.size());
  double mean = 0, spread = 0;
  for (const double x : left_out) {
    mean += x / n;
  }
  for (const double x : left_out) {
    spread += (x - mean) * (x - mean);
  }
  return {all_a.mean() - all_b.mean(), n > 1 ? std::sqrt((n - 1) / n * spread) : 0};
}

/// 0 and +-2, +-4, ... as far as 5 % of the radius.
std::vector<double> trialAmounts(double radius_px) {
  std::vector<double> amounts{0};
  for (double px = 2; px <= std::max(8.0, 0.05 * radius_px); px *= 2) {
    amounts.insert(amounts.begin(), -px);
    amounts.push_back(px);
  }
  return amounts;
}

}  // namespace

struct StraightnessCheck::Impl {
  explicit Impl(const Camera& c) : camera(c), detector(camera), meter(camera) {}

  void prepareTrials(double reference_rad);
  void addTileSums(const Image& image,
                   const std::vector<DetectedLine>& lines,
                   std::vector<TileSums>* sums) const;
  [[nodiscard]] std::vector<TileSums> detectMoved(double amount_px);
  void runTrials(Straightness* result);

  const Camera camera;
  Detector detector;
  EdgeMeter meter;
  std::vector<Image> images;
  std::vector<LineMeasure> lines;
  double length_px = 0, longest_px = 0;
  size_t count = 0;

  std::vector<double> amounts_px;
  cv::Mat displacement;        ///< px, for a change of 1 px at the reference angle.
  std::vector<uint8_t> stays;  ///< 1 where in every trial the pixel shows the image.
};

void StraightnessCheck::Impl::prepareTrials(double reference_rad) {
  const Vector2d axis = *camera.project(Vector3d::UnitZ());
  const Vector3d reference(std::sin(reference_rad), 0, std::cos(reference_rad));
  const std::optional<Vector2d> at = camera.project(reference);
  const double radius = at ? (*at - axis).norm() : camera.width() / 2.0;
  amounts_px = trialAmounts(radius);
  displacement = cv::Mat(camera.height(), camera.width(), CV_32FC2, cv::Scalar(0, 0));
  stays.clear();
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      const Vector2d pixel(x, y);
      const std::optional<Vector3d> ray = camera.unproject(pixel);
      if (!ray) {
        stays.push_back(0);
        continue;
      }
      const double angle = fieldAngle(*ray);
      const Vector2d moved = (pixel - axis) / radius * std::pow(angle / reference_rad, 2);
      displacement.at<cv::Vec2f>(y, x) = {float(moved.x()), float(moved.y())};
      // The detector keeps 6 px away from rims; where a wrong calibration has the rim is not where
      // the image has it.
      const Vector2d outwards = (pixel - axis).stableNormalized();
      const Vector2d farthest = pixel + amounts_px.back() * moved + 6 * outwards;
      const bool stays_here =
          camera.inImage(farthest) && camera.unproject(farthest + 0.05 * radius * outwards);
      stays.push_back(stays_here ? 1 : 0);
    }
  }
}

void StraightnessCheck::Impl::addTileSums(const Image& image,
                                          const std::vector<DetectedLine>& found,
                                          std::vector<TileSums>* sums) const {
  constexpr double kStepPx = 4;
  std::vector<size_t> tiles;
  for (const DetectedLine& line : found) {
    if (isImageCircle(camera, image, line)) {
      continue;
    }
    // By points, not by lines, so that what breaks stays in its tiles.
    tiles.clear();
    const int points = std::max(1, int(line.length_px / kStepPx));
    for (int i = 0; i < points; ++i) {
      const std::optional<Vector2d> at = camera.project(line.arc.at((i + 0.5) / points));
      if (!at) {
        continue;
      }
      const cv::Point p = nearestPixel(camera, *at);
      if (stays[size_t(p.y) * size_t(camera.width()) + size_t(p.x)] != 0) {
        tiles.push_back(tileOf(camera, *at));
      }
    }
    const double step = line.length_px / points;
    for (const size_t tile : tiles) {
      (*sums)[tile] += {step, step * std::log(step * double(tiles.size()))};
    }
  }
}

/// By tile.
std::vector<TileSums> StraightnessCheck::Impl::detectMoved(double amount_px) {
  cv::Mat map = amount_px * displacement;
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      map.at<cv::Vec2f>(y, x) += cv::Vec2f(float(x), float(y));
    }
  }
  std::vector<TileSums> sums(kTilesPerSide * kTilesPerSide);
  for (const Image& image : images) {
    Image moved = image;
    cv::Mat to(image.height, image.width, matOf(image).type(), moved.bytes.data());
    cv::remap(matOf(image), to, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    addTileSums(moved, detector.detect(viewOf(moved)), &sums);
  }
  return sums;
}

void StraightnessCheck::Impl::runTrials(Straightness* result) {
  prepareTrials(result->reference_rad);
  std::vector<TileSums> as_is;
  std::vector<std::vector<TileSums>> trials;
  for (const double amount : amounts_px) {
    if (amount != 0) {
      trials.push_back(detectMoved(amount));
      continue;
    }
    // A little less and a little more: without any interpolation it would not be comparable.
    constexpr double kLittlePx = 0.5;
    as_is = detectMoved(-kLittlePx);
    const std::vector<TileSums> more = detectMoved(kLittlePx);
    for (size_t t = 0; t < as_is.size(); ++t) {
      as_is[t] += more[t];
    }
    trials.push_back(as_is);
  }

  constexpr double kSigmas = 3, kTelling = 0.02;
  double best_gain = 0;
  for (size_t i = 0; i < trials.size(); ++i) {
    const Difference gain = difference(trials[i], as_is);
    result->trials.push_back(
        {amounts_px[i], std::exp(total(trials[i]).mean()), gain.value, gain.sigma});
    const bool certain =
        std::abs(gain.value) > kSigmas * gain.sigma && std::abs(gain.value) > kTelling;
    if (certain && gain.value > best_gain) {
      best_gain = gain.value;
      result->best_px = amounts_px[i];
    } else if (certain && gain.value < 0 && amounts_px[i] < 0) {
      result->shows_below_px = amounts_px[i];  // in order: the last is the nearest
    } else if (certain && gain.value < 0 && !result->shows_above_px) {
      result->shows_above_px = amounts_px[i];
    }
  }
}

namespace {

/// Whether the lines inside the outermost band say, beyond chance, what all of them say.
bool bowedAlike(const Bulge& inner, const Bulge& all) {
  return inner.mean_px * all.mean_px > 0 && std::abs(inner.mean_px) > 2 * inner.sigma_px;
}

/// Both witnesses heard.
Straightness::Verdict verdictOf(const Straightness& s, size_t measured_lines) {
  using Verdict = Straightness::Verdict;
  constexpr size_t kEnoughLines = 20;
  // Lines near each other are no independent witnesses: hence five. In photographs under good
  // calibrations 0.02 px was seen.
  constexpr double kSigmas = 5, kSmallPx = 0.025, kFlatPx = 0.05, kTrendPx = 8;
  if (measured_lines < kEnoughLines) {
    return Verdict::kUndecided;
  }
  const double size = std::abs(s.bulge.mean_px);
  // Bulging outwards asks for a smaller radius: do lines agree?
  double trend = 0;
  for (const StraightnessTrial& trial : s.trials) {
    if (std::abs(trial.radius_px) <= kTrendPx) {
      trend += trial.radius_px > 0 ? trial.gain : trial.radius_px < 0 ? -trial.gain : 0;
    }
  }
  const bool bulges =
      size > kSmallPx && size > kSigmas * s.bulge.sigma_px && trend * s.bulge.mean_px < 0;
  const bool longer = s.best_px * s.bulge.mean_px < 0 && size > 2 * s.bulge.sigma_px;
  if (bulges || longer) {
    return Verdict::kOff;
  }
  const bool flat = size + 2 * s.bulge.sigma_px < kFlatPx;
  const bool bracketed = s.shows_below_px && s.shows_above_px && size < kSigmas * s.bulge.sigma_px;
  return flat || bracketed ? Verdict::kConsistent : Verdict::kUndecided;
}

}  // namespace

StraightnessCheck::StraightnessCheck(const Camera& camera)
    : impl_(std::make_unique<Impl>(camera)) {}
StraightnessCheck::~StraightnessCheck() = default;

void StraightnessCheck::add(const Image& image) {
  Impl& impl = *impl_;
  const std::vector<DetectedLine>& found = impl.detector.detect(viewOf(image));
  impl.meter.setImage(image);
  for (const DetectedLine& line : found) {
    if (isImageCircle(impl.camera, image, line)) {
      continue;
    }
    ++impl.count;
    impl.length_px += line.length_px;
    impl.longest_px = std::max(impl.longest_px, line.length_px);
    if (std::optional<LineMeasure> measure = impl.meter.measure(line)) {
      impl.lines.push_back(*std::move(measure));
    }
  }
  impl.images.push_back(image);
}

Straightness StraightnessCheck::result() {
  Straightness result;
  result.images = impl_->images.size();
  result.lines = impl_->count;
  result.length_px = impl_->length_px;
  result.longest_px = impl_->longest_px;
  std::vector<double> angles;
  for (const LineMeasure& line : impl_->lines) {
    angles.insert(angles.end(), line.angle_rad.begin(), line.angle_rad.end());
  }
  if (angles.empty()) {
    return result;
  }
  result.reference_rad = quantile(angles, 0.95);
  const double widest = quantile(angles, 1);
  for (int i = 0; i * kBandRad <= widest; ++i) {
    result.bands.push_back(summarise(i, impl_->lines));
  }
  double outermost = 0;
  for (const LineMeasure& line : impl_->lines) {
    outermost = std::max(outermost, kBandRad * std::floor(line.middle_angle_rad / kBandRad));
  }
  std::vector<const LineMeasure*> off_axis, inner;
  for (const LineMeasure& line : impl_->lines) {
    if (line.middle_angle_rad > kBandRad) {
      off_axis.push_back(&line);
      if (line.middle_angle_rad < outermost) {
        inner.push_back(&line);
      }
    }
  }
  result.bulge = meanBulge(off_axis);
  impl_->runTrials(&result);
  result.verdict = verdictOf(result, off_axis.size());
  if (result.verdict == Straightness::Verdict::kOff &&
      !bowedAlike(meanBulge(inner), result.bulge)) {
    result.verdict = Straightness::Verdict::kUndecided;
    result.only_beyond_rad = outermost;
  }
  return result;
}

}  // namespace dlsd::cli
