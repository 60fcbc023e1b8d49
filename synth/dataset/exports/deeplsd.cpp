// DeepLSD: grey images and one HDF5 file each with flat arrays. Coordinates are (x, y) with (0, 0)
// at the first pixel's centre.

#include <hdf5.h>

#include <cmath>
#include <limits>

#include "cameras/calibration/files.h"
#include "synth/dataset/exports/exporter.h"
#include "synth/dataset/nearest_line.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;

/// Half of the 21 x 21 square by which lines are dilated to what is no background.
constexpr int kForegroundReach = 10;

/// An identifier of the HDF5 library and what gives it back.
class H5 {
 public:
  H5(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {
    if (id_ < 0) throw SystemError("an HDF5 file could not be made");
  }
  ~H5() { close_(id_); }
  H5(const H5&) = delete;
  H5& operator=(const H5&) = delete;
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor)

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void require(herr_t status) {
  if (status < 0) throw SystemError("an HDF5 file could not be made");
}

/// A file that grows in memory.
class Hdf5File {
 public:
  Hdf5File() : access_(H5Pcreate(H5P_FILE_ACCESS), H5Pclose), file_(create(access_), H5Fclose) {}

  template <class T>
  void add(const char* name, const std::vector<T>& values) {
    constexpr bool kIsFloat = std::is_same_v<T, float>;
    static_assert(kIsFloat || std::is_same_v<T, uint8_t>);
    const hsize_t size = values.size(), chunk = std::min<hsize_t>(size, 1 << 16);
    const H5 space(H5Screate_simple(1, &size, nullptr), H5Sclose);
    const H5 options(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    require(H5Pset_obj_track_times(options, false));  // The same bytes whenever they are made.
    require(H5Pset_chunk(options, 1, &chunk));
    require(H5Pset_shuffle(options));
    require(H5Pset_deflate(options, 1));
    const hid_t type = kIsFloat ? H5T_IEEE_F32LE : H5T_STD_U8LE;
    const H5 data(H5Dcreate2(file_, name, type, space, H5P_DEFAULT, options, H5P_DEFAULT),
                  H5Dclose);
    require(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  }

  [[nodiscard]] std::string bytes() {
    require(H5Fflush(file_, H5F_SCOPE_LOCAL));
    const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
    if (size < 0) throw SystemError("an HDF5 file could not be made");
    std::string bytes(static_cast<size_t>(size), '\0');
    if (H5Fget_file_image(file_, bytes.data(), bytes.size()) != size) {
      throw SystemError("an HDF5 file could not be made");
    }
    return bytes;
  }

 private:
  static hid_t create(hid_t access) {
    require(H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr));  // Errors are said by us.
    require(H5Pset_fapl_core(access, size_t(1) << 20, false));
    return H5Fcreate("memory", H5F_ACC_TRUNC, H5P_DEFAULT, access);
  }

  H5 access_, file_;
};

/// 1 where no pixel that a curve passes through is within kForegroundReach in both directions.
std::vector<uint8_t> background(const LabelRecord& record) {
  const int w = record.width, h = record.height;
  const auto at = [&](int x, int y) { return size_t(y) * size_t(w) + size_t(x); };
  std::vector<uint8_t> on(size_t(w) * size_t(h), 0);
  for (const LabelLine& line : record.lines) {
    for (size_t i = 1; i < line.points.size(); ++i) {
      const Vector2d a = line.points[i - 1], d = line.points[i] - a;
      const int steps = 1 + static_cast<int>(4 * d.norm());
      for (int k = 0; k <= steps; ++k) {
        const Vector2d p = a + d * (double(k) / steps) + kCornerShift;
        on[at(std::clamp(static_cast<int>(p.x()), 0, w - 1),
              std::clamp(static_cast<int>(p.y()), 0, h - 1))] = 1;
      }
    }
  }
  // Dilation by a square is one along rows, then one along columns: `last` is the last one seen.
  const auto dilate = [](int count, auto&& get, auto&& set) {
    int last = std::numeric_limits<int>::min() / 2;
    int ahead = 0;
    for (int i = 0; i < count; ++i) {
      for (; ahead < count && ahead <= i + kForegroundReach; ++ahead) {
        if (get(ahead)) last = ahead;
      }
      set(i, last >= i - kForegroundReach);
    }
  };
  std::vector<uint8_t> rows(on.size()), mask(on.size());
  for (int y = 0; y < h; ++y) {
    dilate(
        w,
        [&](int x) { return on[at(x, y)] != 0; },
        [&](int x, bool near) { rows[at(x, y)] = near ? 1 : 0; });
  }
  for (int x = 0; x < w; ++x) {
    dilate(
        h,
        [&](int y) { return rows[at(x, y)] != 0; },
        [&](int y, bool near) { mask[at(x, y)] = near ? 0 : 1; });
  }
  return mask;
}

class DeepLsdExporter : public Exporter {
 public:
  explicit DeepLsdExporter(const std::string& out) : out_(out) {
    for (const char* split : kNames) {
      makeFolders(out_ + "/images/" + split);
      makeFolders(out_ + "/gt/" + split);
    }
  }

  bool add(const ExportFrame& frame) override {
    const LabelRecord& record = frame.record;
    if (record.lines.empty()) {
      ++empty_;
      return false;
    }
    const auto w = static_cast<size_t>(record.width), h = static_cast<size_t>(record.height);
    std::vector<float> distance(w * h), direction(w * h), closest(2 * w * h);
    NearestLine(record.lines)
        .forEach(0, 0, record.width, record.height, [&](int x, int y, const auto& nearest) {
          const size_t i = size_t(y) * w + size_t(x);
          distance[i] = static_cast<float>(nearest.distance);
          direction[i] = directionAngle(nearest.along);
          closest[2 * i] = static_cast<float>(nearest.point.x());
          closest[2 * i + 1] = static_cast<float>(nearest.point.y());
        });
    Hdf5File file;
    file.add("df", distance);
    file.add("line_level", direction);
    file.add("closest", closest);
    file.add("bg_mask", background(record));
    const std::string name =
        std::string(kNames[static_cast<size_t>(frame.split)]) + "/" + frame.name;
    writeFileAtomically(out_ + "/images/" + name + ".png", encodePng(greyOf(*frame.image)));
    writeFileAtomically(out_ + "/gt/" + name + ".hdf5", file.bytes());
    return true;
  }

  void finish() override {}

  [[nodiscard]] std::vector<std::string> notes() const override {
    if (empty_ == 0) return {};
    return {counted(empty_, "frame") + " without lines left out: nothing is nearest in them"};
  }

 private:
  static constexpr std::array<const char*, 3> kNames{"train", "val", "test"};

  std::string out_;
  size_t empty_ = 0;
};

}  // namespace

std::unique_ptr<Exporter> makeDeepLsdExporter(const std::string& out) {
  return std::make_unique<DeepLsdExporter>(out);
}

}  // namespace dlsd
