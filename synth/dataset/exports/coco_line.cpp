// LETR, DT-LSD, LINEA: COCO with a `line` field, the chord. Coordinates from the image's corner.

#include <utility>

#include "cameras/calibration/files.h"
#include "synth/dataset/exports/exporter.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using nlohmann::ordered_json;

class CocoLineExporter : public Exporter {
 public:
  explicit CocoLineExporter(const std::string& out) : out_(out) {
    makeFolders(out_ + "/annotations");
    for (const char* name : kNames) {
      makeFolders(out_ + "/" + name);
      const std::string path = out_ + "/annotations/lines_" + name + ".json";
      images_.push_back(std::make_unique<TextStream>(path));
      images_.back()->write("{\"images\": [");
      // Grows beside the images and is appended at the end.
      annotations_.push_back(std::make_unique<TextStream>(path + ".annotations"));
    }
  }

  bool add(const ExportFrame& frame) override {
    const LabelRecord& record = frame.record;
    const auto split = static_cast<size_t>(frame.split);
    const std::string file = frame.name + ".png";
    writeFileAtomically(out_ + "/" + kNames[split] + "/" + file, pngOf(frame));
    images_[split]->element(ordered_json{
        {"id", frame.number},
        {"file_name", file},
        {"height", record.height},
        {"width", record.width}}.dump());
    for (const LabelLine& line : record.lines) {
      Vector2d a = line.points.front() + kCornerShift, b = line.points.back() + kCornerShift;
      if (a.x() > b.x() || (a.x() == b.x() && a.y() > b.y())) std::swap(a, b);
      ordered_json polyline = ordered_json::array();
      for (const Vector2d& p : line.points) {
        polyline.push_back(p.x() + kCornerShift.x());
        polyline.push_back(p.y() + kCornerShift.y());
      }
      annotations_[split]->element(ordered_json{
          {"id", ++annotation_id_},
          {"image_id", frame.number},
          {"category_id", 0},
          {"area", 1},
          {"line", {a.x(), a.y(), b.x() - a.x(), b.y() - a.y()}},
          {"polyline", std::move(polyline)},
          {"label", line.id},
          {"kind",
           toString(line.kind)}}.dump());
    }
    return true;
  }

  void finish() override {
    for (size_t k = 0; k < kNames.size(); ++k) {
      images_[k]->write("\n], \"annotations\": [");
      images_[k]->take(*annotations_[k]);
      images_[k]->write(
          "\n], \"categories\": [{\"supercategory\": \"line\", \"id\": \"0\", \"name\": "
          "\"line\"}]}\n");
      images_[k]->close();
    }
  }

  [[nodiscard]] std::vector<std::string> notes() const override { return {}; }

 private:
  static constexpr std::array<const char*, 3> kNames{"train2017", "val2017", "test2017"};

  std::string out_;
  std::vector<std::unique_ptr<TextStream>> images_, annotations_;
  size_t annotation_id_ = 0;  ///< From 1: COCO's evaluation takes 0 for "none".
};

}  // namespace

std::unique_ptr<Exporter> makeCocoLineExporter(const std::string& out) {
  return std::make_unique<CocoLineExporter>(out);
}

}  // namespace dlsd
