#pragma once
// What the exports share. Not part of the installed interface.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "synth/dataset/exports/export.h"

namespace dlsd {

/// One frame on its way out.
struct ExportFrame {
  std::string name;  ///< Six digits: no blank and no dot, which loaders stumble over.
  size_t number;     ///< Place in the dataset.
  Split split;
  LabelRecord record;  ///< Without the lines that the options leave out.
  const Camera* camera;
  const Image* image;
  std::string image_path;
  std::vector<std::pair<std::string, std::string>> planes;  ///< Kind and path.
};

/// One format.
class Exporter {
 public:
  virtual ~Exporter() = default;
  /// Returns whether the frame was written. If not, notes() tell why.
  virtual bool add(const ExportFrame& frame) = 0;
  /// Writes what comes last.
  virtual void finish() = 0;
  /// What was left out or is not exact, and why: sentences.
  [[nodiscard]] virtual std::vector<std::string> notes() const = 0;
};

/// Each writes into the folder `out`, which is there and empty.
[[nodiscard]] std::unique_ptr<Exporter> makeUlsdExporter(const std::string& out,
                                                         const ExportOptions& options);
[[nodiscard]] std::unique_ptr<Exporter> makeLcnnExporter(const std::string& out);
[[nodiscard]] std::unique_ptr<Exporter> makeCocoLineExporter(const std::string& out);
[[nodiscard]] std::unique_ptr<Exporter> makeDeepLsdExporter(const std::string& out);
[[nodiscard]] std::unique_ptr<Exporter> makeWebDatasetExporter(const std::string& out,
                                                               const ExportOptions& options);

/// Pixel coordinates with (0, 0) in the corner of the image instead of the first pixel's centre.
inline const Eigen::Vector2d kCornerShift(0.5, 0.5);

/// A JSON array or more text that grows as frames come; the file is written as it grows.
class TextStream {
 public:
  explicit TextStream(const std::string& path);
  void write(std::string_view text);
  /// A value of the array that is being written: puts a comma before all but the first.
  void element(const std::string& json);
  /// Appends what another stream wrote, and removes that file.
  void take(TextStream& other);
  /// Throws SystemError if anything could not be written.
  void close();

 private:
  [[noreturn]] void refuse() const;
  std::string path_;
  std::ofstream file_;
  bool first_ = true;
};

/// The frame's image as PNG: the file's bytes if it is one.
[[nodiscard]] std::string pngOf(const ExportFrame& frame);
/// 8 bit, one channel.
[[nodiscard]] Image greyOf(const Image& image);
/// Three equal channels of 8 bit at 512 x 512: networks take the first three of what they read.
/// Where that is smaller, pixels are means of what they cover.
inline constexpr int kNetworkImagePx = 512;
[[nodiscard]] Image networkImage(const Image& image);
/// The flips of training data, by the number in their file names.
struct Flip {
  bool horizontal, vertical;
};
inline constexpr std::array<Flip, 4> kFlips{
    {{false, false}, {true, false}, {false, true}, {true, true}}};
[[nodiscard]] Image flipped(const Image& image, const Flip& flip);

/// 128 x 128 cells that cover the image, whatever its shape; coordinates from the corner.
inline constexpr int kHeatMapPx = 128;
/// A point of the image (pixel centres are integers) in the heat map, moved inside it: [0, 128).
[[nodiscard]] Eigen::Vector2d inHeatMap(const Eigen::Vector2d& point_px, int width, int height);
[[nodiscard]] Eigen::Vector2d flipped(const Eigen::Vector2d& in_heat_map, const Flip& flip);
/// Row-major values of a map, or of several, one after the other.
using HeatMap = std::vector<float>;
inline constexpr size_t kHeatMapCells = size_t(kHeatMapPx) * kHeatMapPx;
/// The cell of a point inside.
[[nodiscard]] inline size_t cellOf(const Eigen::Vector2d& point) {
  return static_cast<size_t>(point.y()) * kHeatMapPx + static_cast<size_t>(point.x());
}
/// Raises each cell to 1 - distance of its centre to the polyline, in cells.
void drawLine(const std::vector<Eigen::Vector2d>& points, HeatMap* map);

/// End points of lines, those that agree to 1e-3 as one.
class Junctions {
 public:
  /// Number of the junction at a point, from 0.
  int at(const Eigen::Vector2d& point);
  [[nodiscard]] const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  std::map<std::pair<long, long>, int> known_;
  std::vector<Eigen::Vector2d> points_;
};

/// An .npz file in memory: arrays of NumPy, compressed.
class Npz {
 public:
  Npz();
  ~Npz();
  Npz(const Npz&) = delete;
  Npz& operator=(const Npz&) = delete;
  void add(const std::string& key,
           std::initializer_list<size_t> shape,
           const std::vector<float>& values);
  void add(const std::string& key,
           std::initializer_list<size_t> shape,
           const std::vector<int32_t>& values);
  /// Ends the file and returns its bytes.
  [[nodiscard]] std::string bytes();

 private:
  struct Writer;
  std::unique_ptr<Writer> writer_;
};

/// x0, y0, x1, y1, ... of points.
[[nodiscard]] std::vector<float> flat(const std::vector<Eigen::Vector2d>& points);

[[nodiscard]] std::string counted(size_t count, const std::string& noun);

}  // namespace dlsd
