#include "synth/dataset/exports/export.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "cameras/calibration/files.h"
#include "synth/dataset/exports/exporter.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;

constexpr std::array<ExportFormatInfo, 5> kFormats{{
    {ExportFormat::kUlsd, "ulsd", "ULSD: curves by end points and calibration, and ready npz"},
    {ExportFormat::kLcnn, "lcnn", "L-CNN, HAWP and others: chords, and ready npz"},
    {ExportFormat::kCocoLine, "coco-line", "LETR, DT-LSD, LINEA: COCO with line and polyline"},
    {ExportFormat::kDeepLsd, "deeplsd", "DeepLSD: distance and angle fields, HDF5"},
    {ExportFormat::kWebDataset, "webdataset", "WebDataset, Hugging Face: tar shards of everything"},
}};

/// Marks a folder as ours to remove.
constexpr const char* kMark = ".dlsd-export";

/// The folder in which the export grows: gone at the end, by rename or, if that never came,
/// removed.
class PartialFolder {
 public:
  explicit PartialFolder(const std::string& out) : out_(out), path_(out + ".partial") {
    std::error_code error;
    if (fs::exists(out_, error) && !(fs::is_directory(out_, error) && fs::is_empty(out_, error))) {
      throw InputError(out +
                       ": is there already and not an empty folder: choose another or "
                       "delete it");
    }
    if (fs::exists(path_, error)) {
      if (!fs::exists(path_ / kMark, error)) {
        throw InputError(path_.string() + ": is there already, and not from an earlier export");
      }
      fs::remove_all(path_, error);
    }
    makeFolders(path_.string());
    writeFileAtomically((path_ / kMark).string(), "");
  }
  ~PartialFolder() {
    std::error_code ignored;
    if (!done_) fs::remove_all(path_, ignored);
  }
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  [[nodiscard]] std::string path() const { return path_.string(); }
  void finish() {
    fs::remove(path_ / kMark);
    std::error_code error;
    fs::rename(path_, out_, error);  // Over an empty folder, or none.
    if (error) throw SystemError(out_ + ": cannot be written: " + error.message());
    done_ = true;
  }

 private:
  std::string out_;
  fs::path path_;
  bool done_ = false;
};

/// "a/b/" -> "a/b": a name that can be made longer.
std::string withoutSlash(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

std::unique_ptr<Exporter> makeExporter(const std::string& out, const ExportOptions& options) {
  switch (options.format) {
    case ExportFormat::kUlsd:
      return makeUlsdExporter(out, options);
    case ExportFormat::kLcnn:
      return makeLcnnExporter(out);
    case ExportFormat::kCocoLine:
      return makeCocoLineExporter(out);
    case ExportFormat::kDeepLsd:
      return makeDeepLsdExporter(out);
    case ExportFormat::kWebDataset:
      return makeWebDatasetExporter(out, options);
  }
  throw std::invalid_argument("format: unknown");
}

/// Lines that the options leave out go, and out of the junctions too.
void filterLines(const ExportOptions& options, LabelRecord* record) {
  std::vector<int> gone;
  std::erase_if(record->lines, [&](const LabelLine& line) {
    const bool out =
        !(line.length_px >= options.min_length_px && line.contrast >= options.min_contrast);
    if (out) gone.push_back(line.id);
    return out;
  });
  if (gone.empty()) return;
  std::sort(gone.begin(), gone.end());
  for (Junction& junction : record->junctions) {
    std::erase_if(junction.lines,
                  [&](int id) { return std::binary_search(gone.begin(), gone.end(), id); });
  }
  std::erase_if(record->junctions, [](const Junction& j) { return j.lines.size() < 2; });
}

/// Kind and path of a frame's planes.
std::vector<std::pair<std::string, std::string>> planesOf(const Dataset& dataset, size_t i) {
  std::vector<std::pair<std::string, std::string>> planes;
  const auto& frame = dataset.manifest().at("frames").at(i);
  if (!frame.contains("planes")) return planes;
  const nlohmann::json document = frame.at("planes");
  for (const JsonField& plane :
       JsonField(document, dataset.folder() + "/manifest.json", "planes").array()) {
    planes.emplace_back(plane["kind"].text(), dataset.folder() + "/" + plane["file"].insidePath());
  }
  return planes;
}

[[noreturn]] void refuse(const std::string& field, double value, const char* allowed) {
  throw std::invalid_argument(field + " = " + nlohmann::json(value).dump() +
                              " is out of range: allowed is " + allowed);
}

}  // namespace

std::span<const ExportFormatInfo> exportFormats() {
  return kFormats;
}

Split splitOf(size_t i, const std::array<double, 3>& shares) {
  constexpr uint64_t kGolden = 0x9e3779b97f4a7c15ULL;  // 2^64 / golden ratio
  const double place = static_cast<double>((uint64_t(i) * kGolden) >> 11) * 0x1p-53;
  if (place < shares[0]) return Split::kTrain;
  return place < shares[0] + shares[1] || shares[2] <= 0 ? Split::kVal : Split::kTest;
}

void ExportOptions::check() const {
  double sum = 0;
  for (const double share : shares) {
    if (!(share >= 0 && share <= 1)) refuse("split", share, "[0, 1]");
    sum += share;
  }
  if (!(std::abs(sum - 1) <= 1e-9)) refuse("split", sum, "shares that sum to 1");
  if (!(min_length_px >= 0 && min_length_px <= 1e6)) {
    refuse("min_length_px", min_length_px, "[0, 1e6]");
  }
  if (!(min_contrast >= 0 && min_contrast <= 255)) refuse("min_contrast", min_contrast, "[0, 255]");
  if (order < 1 || order > 4) refuse("order", order, "[1, 4]");
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  if (!plain) {
    throw std::invalid_argument("name = \"" + name + "\": allowed are letters, digits, '_', '-'");
  }
}

ExportResult exportDataset(const Dataset& dataset,
                           const ExportOptions& options,
                           const std::function<void(size_t)>& on_frame) {
  options.check();
  if (options.out.empty()) throw std::invalid_argument("out: a folder is needed");
  PartialFolder folder(withoutSlash(options.out));
  const std::unique_ptr<Exporter> exporter = makeExporter(folder.path(), options);
  ExportResult result;
  for (size_t i = 0; i < dataset.size(); ++i) {
    char name[24];
    std::snprintf(name, sizeof name, "%06zu", i);
    ExportFrame frame{
        name, i, splitOf(i, options.shares), dataset.labels(i), nullptr, nullptr, "", {}};
    const Image image = dataset.image(frame.record);
    frame.camera = &dataset.camera(frame.record);
    frame.image = &image;
    frame.image_path = dataset.folder() + "/" + frame.record.image;
    frame.planes = planesOf(dataset, i);
    filterLines(options, &frame.record);
    if (exporter->add(frame)) {
      ++result.frames[static_cast<size_t>(frame.split)];
      result.lines += frame.record.lines.size();
    }
    if (on_frame) on_frame(i + 1);
  }
  exporter->finish();
  result.notes = exporter->notes();
  folder.finish();
  return result;
}

}  // namespace dlsd
