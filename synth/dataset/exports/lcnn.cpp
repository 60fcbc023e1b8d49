// L-CNN's "wireframe": raw input of its dataset/wireframe.py, and the .npz that it would make.
// Lines are chords. Raw coordinates (x, y), in .npz (y, x, t) with t = 0; from the image's corner.

#include <algorithm>
#include <cmath>
#include <set>

#include "cameras/calibration/files.h"
#include "synth/dataset/exports/exporter.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using nlohmann::ordered_json;

/// Most pairs of junctions without a line that are kept: by number, and by position.
constexpr size_t kMaxNegativeIds = 4000, kMaxNegatives = 2000;

using Pair = std::array<int, 2>;

/// A frame as junctions and which of them are joined, in the heat map.
struct Wireframe {
  std::vector<Vector2d> junctions;
  std::vector<Pair> positive;
  std::vector<Pair> negative;  ///< Those that look most like lines first.
};

float lineEvidence(const Vector2d& a, const Vector2d& b, const HeatMap& line_map) {
  const int steps = 1 + static_cast<int>((b - a).cwiseAbs().maxCoeff());
  float sum = 0;
  for (int k = 0; k <= steps; ++k) sum += line_map[cellOf(a + (b - a) * (double(k) / steps))];
  return sum / static_cast<float>(steps + 1);
}

Wireframe wireframeOf(const LabelRecord& record) {
  Wireframe out;
  Junctions junctions;
  HeatMap line_map(kHeatMapCells);
  std::set<Pair> joined;
  for (const LabelLine& line : record.lines) {
    const Vector2d a = inHeatMap(line.points.front(), record.width, record.height);
    const Vector2d b = inHeatMap(line.points.back(), record.width, record.height);
    Pair pair{junctions.at(a), junctions.at(b)};
    if (pair[0] == pair[1]) continue;
    if (pair[0] > pair[1]) std::swap(pair[0], pair[1]);
    if (!joined.insert(pair).second) continue;
    out.positive.push_back(pair);
    drawLine({a, b}, &line_map);
  }
  out.junctions = junctions.points();
  std::vector<std::pair<float, Pair>> others;
  const int count = static_cast<int>(out.junctions.size());
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      const Vector2d &a = out.junctions[size_t(i)], &b = out.junctions[size_t(j)];
      if (cellOf(a) == cellOf(b) || joined.contains({i, j})) continue;
      others.emplace_back(-lineEvidence(a, b, line_map), Pair{i, j});
    }
  }
  const size_t kept = std::min(others.size(), kMaxNegativeIds);
  std::partial_sort(others.begin(), others.begin() + long(kept), others.end());
  for (size_t k = 0; k < kept; ++k) out.negative.push_back(others[k].second);
  return out;
}

std::vector<int32_t> ids(const std::vector<Pair>& pairs) {
  std::vector<int32_t> values;
  for (const Pair& pair : pairs) values.insert(values.end(), pair.begin(), pair.end());
  return values;
}

std::string npzOf(const Wireframe& wireframe, const Flip& flip, double aspect_ratio) {
  HeatMap mask(kHeatMapCells), offset(2 * kHeatMapCells), line_map(kHeatMapCells);
  std::vector<Vector2d> junctions;
  for (const Vector2d& p : wireframe.junctions) junctions.push_back(flipped(p, flip));
  std::vector<float> positions;
  const auto append = [](const Vector2d& p, std::vector<float>* values) {
    values->insert(values->end(), {static_cast<float>(p.y()), static_cast<float>(p.x()), 0.0F});
  };
  for (const Vector2d& p : junctions) {
    append(p, &positions);
    const size_t cell = cellOf(p);
    mask[cell] = 1;
    offset[cell] = static_cast<float>(p.y() - std::floor(p.y()) - 0.5);
    offset[kHeatMapCells + cell] = static_cast<float>(p.x() - std::floor(p.x()) - 0.5);
  }
  const auto ends = [&](const std::vector<Pair>& pairs, size_t count) {
    std::vector<float> values;
    for (size_t k = 0; k < count; ++k) {
      for (const int id : pairs[k]) append(junctions[size_t(id)], &values);
    }
    return values;
  };
  for (const auto& [i, j] : wireframe.positive) {
    drawLine({junctions[size_t(i)], junctions[size_t(j)]}, &line_map);
  }
  const size_t n = kHeatMapPx, positive = wireframe.positive.size();
  const size_t negative = std::min(wireframe.negative.size(), kMaxNegatives);
  Npz npz;
  npz.add("aspect_ratio", {}, std::vector<float>{static_cast<float>(aspect_ratio)});
  npz.add("jmap", {1, n, n}, mask);
  npz.add("joff", {1, 2, n, n}, offset);
  npz.add("lmap", {n, n}, line_map);
  npz.add("junc", {junctions.size(), 3}, positions);
  npz.add("Lpos", {positive, 2}, ids(wireframe.positive));
  npz.add("Lneg", {wireframe.negative.size(), 2}, ids(wireframe.negative));
  npz.add("lpos", {positive, 2, 3}, ends(wireframe.positive, positive));
  npz.add("lneg", {negative, 2, 3}, ends(wireframe.negative, negative));
  return npz.bytes();
}

class LcnnExporter : public Exporter {
 public:
  explicit LcnnExporter(const std::string& out) : out_(out), raw_(out + "/raw") {
    makeFolders(raw_ + "/images");
    for (size_t k = 0; k < kNames.size(); ++k) {
      makeFolders(out_ + "/" + kNames[k]);
      json_[k] = std::make_unique<TextStream>(raw_ + "/" + kNames[k] + ".json");
      json_[k]->write("[");
    }
  }

  bool add(const ExportFrame& frame) override {
    const LabelRecord& record = frame.record;
    const Wireframe wireframe = wireframeOf(record);
    if (wireframe.positive.empty() || wireframe.negative.empty()) {
      ++unfit_;  // Their loader asserts a negative example.
      return false;
    }
    const auto split = static_cast<size_t>(frame.split);
    writeFileAtomically(raw_ + "/images/" + frame.name + ".png", pngOf(frame));
    ordered_json lines = ordered_json::array();
    for (const LabelLine& line : record.lines) {
      const Vector2d a = line.points.front() + kCornerShift, b = line.points.back() + kCornerShift;
      lines.push_back({a.x(), a.y(), b.x(), b.y()});
    }
    const ordered_json entry{{"filename", frame.name + ".png"}, {"lines", std::move(lines)}};
    json_[split]->element(entry.dump());

    const Image image = networkImage(*frame.image);
    const double aspect_ratio = double(record.width) / record.height;
    const size_t flips = frame.split == Split::kTrain ? kFlips.size() : 1;
    for (size_t f = 0; f < flips; ++f) {
      const std::string stem =
          out_ + "/" + kNames[split] + "/" + frame.name + "_" + std::to_string(f);
      writeFileAtomically(stem + ".png", encodePng(flipped(image, kFlips[f])));
      writeFileAtomically(stem + "_label.npz", npzOf(wireframe, kFlips[f], aspect_ratio));
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
    if (unfit_ == 0) return {};
    return {counted(unfit_, "frame") +
            " left out: L-CNN needs a line and two junctions that no line joins"};
  }

 private:
  static constexpr std::array<const char*, 3> kNames{"train", "valid", "test"};

  std::string out_, raw_;
  std::array<std::unique_ptr<TextStream>, 3> json_;
  size_t unfit_ = 0;
};

}  // namespace

std::unique_ptr<Exporter> makeLcnnExporter(const std::string& out) {
  return std::make_unique<LcnnExporter>(out);
}

}  // namespace dlsd
