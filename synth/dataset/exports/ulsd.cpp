// ULSD and ULSD-ISPRS: raw input of their json2npz.py, and what it and json2npz_gt.py would make,
// from the exact curves. Coordinates from the image's corner, (x, y).

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "cameras/arc.h"
#include "cameras/calibration/files.h"
#include "cameras/conversion.h"
#include "synth/dataset/exports/exporter.h"
#include "synth/dataset/statistics.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using nlohmann::ordered_json;

/// cv2.fisheye clamps at 90 degrees, where ULSD's programs make curves of end points.
constexpr double kMaxFisheyeAngle = 89.9 * M_PI / 180;
/// A Kannala-Brandt camera that is farther from the true one is no calibration of its image.
constexpr double kMaxFitErrorPx = 0.1;
constexpr size_t kTruthPoints = 7;

/// How ULSD is told about a camera.
struct UlsdCamera {
  std::string type;                      ///< Empty: it has no word for this one.
  std::optional<KannalaBrandt> fisheye;  ///< Of type "fisheye".
};

UlsdCamera ulsdCamera(const Camera& camera) {
  if (std::holds_alternative<Pinhole>(camera.model())) return {"pinhole", std::nullopt};
  if (const auto* p = std::get_if<Equirectangular>(&camera.model())) {
    // Their panorama is the whole sphere.
    const double w = camera.width(), h = camera.height();
    const bool whole = std::abs(p->fx - w / (2 * M_PI)) * 2 * M_PI < kMaxFitErrorPx &&
                       std::abs(p->fy - h / M_PI) * M_PI < kMaxFitErrorPx &&
                       std::abs(p->cy - (h - 1) / 2) < kMaxFitErrorPx;
    return {whole ? "spherical" : "", std::nullopt};
  }
  const auto fit = convertCamera(camera, KannalaBrandt::kName, kMaxFisheyeAngle);
  if (!fit || fit->residual.all.lost > 0 || fit->residual.all.max_px > kMaxFitErrorPx) return {};
  return {"fisheye", std::get<KannalaBrandt>(fit->camera.model())};
}

/// End points of the parts of a line that look less than 90 degrees from the axis.
std::vector<std::array<Vector2d, 2>> endsBelow90(const Camera& camera, const LabelLine& line) {
  const std::array<Vector2d, 2> whole{line.points.front(), line.points.back()};
  const auto arc = arcBetween(line.points_in_cam[0], line.points_in_cam[1]);
  if (!arc) return {whole};
  if (camera.maxFieldAngle() <= kMaxFisheyeAngle) return {whole};
  const Camera front(camera.model(), camera.width(), camera.height(), kMaxFisheyeAngle);
  std::vector<std::array<Vector2d, 2>> parts;
  const auto end = [&](double t, ImageEnd kind) {
    if (kind == ImageEnd::kRim) {
      if (const auto pixel = camera.project(arc->at(t))) return *pixel;
    }
    return t < 0.5 ? whole[0] : whole[1];
  };
  for (const ImageSpan& span : imageSpans(front, *arc)) {
    parts.push_back({end(span.t0, span.end0), end(span.t1, span.end1)});
  }
  return parts;
}

/// A line in the heat map.
struct Curve {
  std::vector<Vector2d> points;  ///< Polyline.
  std::vector<Vector2d> equal;   ///< order + 1 points at equal arc length.
  Vector2d middle;               ///< At half of the length.
};

Curve flipped(const Curve& curve, const Flip& flip) {
  Curve out = curve;
  for (Vector2d& p : out.points) p = flipped(p, flip);
  for (Vector2d& p : out.equal) p = flipped(p, flip);
  out.middle = flipped(curve.middle, flip);
  return out;
}

/// The first point has the smaller y; of equal ones, the smaller x.
std::vector<Vector2d> fromTop(std::vector<Vector2d> points) {
  const Vector2d &a = points.front(), &b = points.back();
  if (a.y() > b.y() || (a.y() == b.y() && a.x() > b.x())) {
    std::reverse(points.begin(), points.end());
  }
  return points;
}

std::vector<Vector2d> inHeatMap(const std::vector<Vector2d>& points, const LabelRecord& record) {
  std::vector<Vector2d> out;
  out.reserve(points.size());
  for (const Vector2d& p : points) out.push_back(dlsd::inHeatMap(p, record.width, record.height));
  return out;
}

/// The mask of cells with a point, and where in them the points are, from -0.5 to 0.5.
struct PointMaps {
  HeatMap mask = HeatMap(kHeatMapCells), offset = HeatMap(2 * kHeatMapCells);

  void add(const Vector2d& point) {
    const size_t cell = cellOf(point);
    mask[cell] = 1;
    for (const int k : {0, 1}) {
      offset[size_t(k) * kHeatMapCells + cell] =
          static_cast<float>(point[k] - std::floor(point[k]) - 0.5);
    }
  }
};

/// What the network is trained with.
std::string trainingNpz(const std::vector<Curve>& curves, const Flip& flip, int order) {
  const size_t points = static_cast<size_t>(order) + 1;
  const size_t channels = 4 * (points / 2);
  Junctions junctions;
  PointMaps junction_maps, centre_maps;
  HeatMap line_map(kHeatMapCells), ends(channels * kHeatMapCells);
  std::vector<float> positions;
  for (const Curve& unflipped : curves) {
    const Curve curve = flipped(unflipped, flip);
    const std::vector<Vector2d> equal = fromTop(curve.equal);
    junctions.at(equal.front());
    junctions.at(equal.back());
    for (const float value : flat(equal)) positions.push_back(value);
    drawLine(curve.points, &line_map);
    centre_maps.add(curve.middle);
    size_t channel = 0;
    for (size_t k = 0; k < points; ++k) {
      if (2 * k == points - 1) continue;  // The middle itself.
      for (const int axis : {0, 1}) {
        ends[channel++ * kHeatMapCells + cellOf(curve.middle)] =
            static_cast<float>(equal[k][axis] - curve.middle[axis]);
      }
    }
  }
  for (const Vector2d& p : junctions.points()) junction_maps.add(p);
  const size_t n = kHeatMapPx;
  Npz npz;
  npz.add("junc", {junctions.points().size(), 2}, flat(junctions.points()));
  npz.add("lpos", {curves.size(), points, 2}, positions);
  npz.add("lneg", {0}, std::vector<float>());
  npz.add("jmap", {1, n, n}, junction_maps.mask);
  npz.add("joff", {2, n, n}, junction_maps.offset);
  npz.add("cmap", {1, n, n}, centre_maps.mask);
  npz.add("coff", {2, n, n}, centre_maps.offset);
  npz.add("eoff", {channels, n, n}, ends);  // ULSD-ISPRS's name, and
  npz.add("lvec", {channels, n, n}, ends);  // that of the first version.
  npz.add("lmap", {1, n, n}, line_map);
  return npz.bytes();
}

class UlsdExporter : public Exporter {
 public:
  UlsdExporter(const std::string& out, const ExportOptions& options)
      : order_(options.order),
        raw_(out + "/dataset/" + options.name + "_raw"),
        ready_(out + "/dataset/" + options.name + "_" + std::to_string(options.order)),
        truth_(out + "/dataset/" + options.name) {
    makeFolders(raw_ + "/image");
    makeFolders(truth_);
    for (size_t k = 0; k < kNames.size(); ++k) {
      makeFolders(ready_ + "/" + kNames[k]);
      json_[k] = std::make_unique<TextStream>(raw_ + "/" + kNames[k] + ".json");
      json_[k]->write("[");
    }
  }

  bool add(const ExportFrame& frame) override {
    const LabelRecord& record = frame.record;
    if (record.lines.empty()) {
      ++empty_;  // Their programs fail on an image without lines.
      return false;
    }
    std::vector<Curve> curves;
    for (const LabelLine& line : record.lines) {
      const size_t points = static_cast<size_t>(order_) + 1;
      curves.push_back(
          {inHeatMap(line.points, record),
           inHeatMap(equalArcPoints(line.points, points), record),
           dlsd::inHeatMap(equalArcPoints(line.points, 3)[1], record.width, record.height)});
    }
    addRaw(frame);
    const Image image = networkImage(*frame.image);
    const std::string stem =
        ready_ + "/" + kNames[static_cast<size_t>(frame.split)] + "/" + frame.name;
    if (frame.split == Split::kTrain) {
      for (size_t f = 0; f < kFlips.size(); ++f) {
        const std::string name = stem + "_" + std::to_string(f);
        writeFileAtomically(name + ".png", encodePng(flipped(image, kFlips[f])));
        writeFileAtomically(name + ".npz", trainingNpz(curves, kFlips[f], order_));
      }
      return true;
    }
    const std::string png = encodePng(image);
    writeFileAtomically(stem + ".png", png);
    writeFileAtomically(stem + ".npz", trainingNpz(curves, kFlips[0], order_));
    if (frame.split == Split::kTest) {
      writeFileAtomically(truth_ + "/" + frame.name + ".png", png);
      writeFileAtomically(truth_ + "/" + frame.name + ".npz", truthNpz(record));
    }
    return true;
  }

  void finish() override {
    for (auto& json : json_) {
      json->write("\n]\n");
      json->close();
    }
  }

  [[nodiscard]] std::vector<std::string> notes() const override {
    std::vector<std::string> notes;
    if (empty_ > 0) notes.push_back(counted(empty_, "frame") + " without lines left out");
    if (wordless_ > 0) {
      notes.push_back(
          counted(wordless_, "frame") +
          " not among the raw ones (no line below 90 degrees, or a camera that ULSD has "
          "no model for); npz are there");
    }
    if (cut_ > 0) {
      notes.push_back(counted(cut_, "line") +
                      " cut or left out at 90 degrees among the raw ones, "
                      "as cv2.fisheye needs; whole in npz");
    }
    if (off_centre_) {
      notes.emplace_back(
          "json2npz.py flips images but not K: with a principal point off the centre use the npz "
          "made here");
    }
    return notes;
  }

 private:
  static constexpr std::array<const char*, 3> kNames{"train", "val", "test"};

  void addRaw(const ExportFrame& frame) {
    const LabelRecord& record = frame.record;
    const auto [it, is_new] = cameras_.try_emplace(record.camera);
    if (is_new) it->second = ulsdCamera(*frame.camera);
    const UlsdCamera& camera = it->second;
    if (camera.type.empty()) {
      ++wordless_;
      return;
    }
    ordered_json lines = ordered_json::array();
    for (const LabelLine& line : record.lines) {
      std::vector<std::array<Vector2d, 2>> parts{{line.points.front(), line.points.back()}};
      if (camera.fisheye) {
        parts = endsBelow90(*frame.camera, line);
        const bool same = parts.size() == 1 && parts[0][0] == line.points.front() &&
                          parts[0][1] == line.points.back();
        cut_ += same ? 0 : 1;
      }
      for (const auto& part : parts) {
        const Vector2d a = part[0] + kCornerShift, b = part[1] + kCornerShift;
        lines.push_back({{a.x(), a.y()}, {b.x(), b.y()}});
      }
    }
    if (lines.empty()) {
      ++wordless_;
      return;
    }
    ordered_json entry{{"filename", frame.name + ".png"}, {"type", camera.type}};
    entry["lines"] = std::move(lines);
    if (const auto& kb = camera.fisheye) {
      const double cx = kb->cx + 0.5, cy = kb->cy + 0.5;
      entry["K"] = {{kb->fx, 0, cx}, {0, kb->fy, cy}, {0, 0, 1}};
      entry["D"] = {kb->k1, kb->k2, kb->k3, kb->k4};
      off_centre_ |= std::hypot(cx - record.width / 2.0, cy - record.height / 2.0) > 0.5;
    }
    writeFileAtomically(raw_ + "/image/" + frame.name + ".png", pngOf(frame));
    json_[static_cast<size_t>(frame.split)]->element(entry.dump());
  }

  static std::string truthNpz(const LabelRecord& record) {
    Junctions junctions;
    std::vector<float> values;
    for (const LabelLine& line : record.lines) {
      const auto points = fromTop(inHeatMap(equalArcPoints(line.points, kTruthPoints), record));
      junctions.at(points.front());
      junctions.at(points.back());
      for (const float value : flat(points)) values.push_back(value);
    }
    Npz npz;
    npz.add("junc", {junctions.points().size(), 2}, flat(junctions.points()));
    npz.add("line", {record.lines.size(), kTruthPoints, 2}, values);
    return npz.bytes();
  }

  int order_;
  std::string raw_, ready_, truth_;
  std::array<std::unique_ptr<TextStream>, 3> json_;
  std::map<std::string, UlsdCamera> cameras_;
  size_t empty_ = 0, wordless_ = 0, cut_ = 0;
  bool off_centre_ = false;
};

}  // namespace

std::unique_ptr<Exporter> makeUlsdExporter(const std::string& out, const ExportOptions& options) {
  return std::make_unique<UlsdExporter>(out, options);
}

}  // namespace dlsd
