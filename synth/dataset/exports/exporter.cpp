#include "synth/dataset/exports/exporter.h"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <system_error>

#include "cameras/calibration/files.h"
#include "synth/dataset/npy.h"

namespace dlsd {
namespace {

/// The largest float below 128: a point on the border belongs to the last cell.
constexpr double kLast = 0x1.fffffep+6;

}  // namespace

TextStream::TextStream(const std::string& path) : path_(path), file_(path, std::ios::binary) {
  if (!file_) refuse();
}

void TextStream::write(std::string_view text) {
  file_.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file_) refuse();
}

void TextStream::element(const std::string& json) {
  write(first_ ? "\n" : ",\n");
  first_ = false;
  write(json);
}

void TextStream::take(TextStream& other) {
  other.close();
  {
    std::ifstream from(other.path_, std::ios::binary);
    char buffer[1 << 16];
    while (from.read(buffer, sizeof buffer) || from.gcount() > 0) {
      write({buffer, static_cast<size_t>(from.gcount())});
    }
  }
  std::remove(other.path_.c_str());
}

void TextStream::close() {
  file_.close();
  if (!file_) refuse();
}

void TextStream::refuse() const {
  throw SystemError(path_ + ": cannot be written: " + std::generic_category().message(errno));
}

std::string pngOf(const ExportFrame& frame) {
  std::string bytes = readFile(frame.image_path);
  return bytes.starts_with("\x89PNG") ? bytes : encodePng(*frame.image);
}

Image greyOf(const Image& image) {
  const int type = CV_MAKETYPE(image.bits == 8 ? CV_8U : CV_16U, image.channels);
  const cv::Mat all(image.height, image.width, type, const_cast<uint8_t*>(image.bytes.data()));
  cv::Mat mat = all;
  if (image.channels == 3) cv::cvtColor(all, mat, cv::COLOR_RGB2GRAY);
  if (image.channels == 4) cv::cvtColor(all, mat, cv::COLOR_RGBA2GRAY);
  if (image.bits == 16) mat.convertTo(mat, CV_8U, 1.0 / 257);
  Image grey{image.width, image.height, 1, 8, {}};
  for (int y = 0; y < mat.rows; ++y) {
    grey.bytes.insert(grey.bytes.end(), mat.ptr(y), mat.ptr(y) + mat.cols);
  }
  return grey;
}

Image networkImage(const Image& image_in) {
  Image grey = greyOf(image_in);
  const cv::Mat from(grey.height, grey.width, CV_8U, grey.bytes.data());
  // Both keep the corners where they are. Means where it gets smaller; enlarging has none to take.
  cv::Mat less, small;
  const cv::Size size(std::min(grey.width, kNetworkImagePx),
                      std::min(grey.height, kNetworkImagePx));
  cv::resize(from, less, size, 0, 0, cv::INTER_AREA);
  cv::resize(less, small, {kNetworkImagePx, kNetworkImagePx}, 0, 0, cv::INTER_LINEAR);
  Image image{kNetworkImagePx, kNetworkImagePx, 3, 8, {}};
  image.bytes.reserve(3 * small.total());
  for (int y = 0; y < small.rows; ++y) {
    for (int x = 0; x < small.cols; ++x)
      image.bytes.insert(image.bytes.end(), 3, small.at<uint8_t>(y, x));
  }
  return image;
}

Image flipped(const Image& image, const Flip& flip) {
  Image out = image;
  const size_t pixel = static_cast<size_t>(image.channels * image.bits / 8);
  const auto at = [&](int x, int y) {
    return pixel *
           (static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x));
  };
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      std::memcpy(out.bytes.data() + at(x, y),
                  image.bytes.data() + at(flip.horizontal ? image.width - 1 - x : x,
                                          flip.vertical ? image.height - 1 - y : y),
                  pixel);
    }
  }
  return out;
}

Eigen::Vector2d inHeatMap(const Eigen::Vector2d& point_px, int width, int height) {
  const Eigen::Vector2d corner = point_px + kCornerShift;
  return {std::clamp(corner.x() * kHeatMapPx / width, 0.0, kLast),
          std::clamp(corner.y() * kHeatMapPx / height, 0.0, kLast)};
}

Eigen::Vector2d flipped(const Eigen::Vector2d& in_heat_map, const Flip& flip) {
  const auto mirrored = [](double x) { return std::min(kHeatMapPx - x, kLast); };
  return {flip.horizontal ? mirrored(in_heat_map.x()) : in_heat_map.x(),
          flip.vertical ? mirrored(in_heat_map.y()) : in_heat_map.y()};
}

void drawLine(const std::vector<Eigen::Vector2d>& points, HeatMap* map) {
  for (size_t i = 1; i < points.size(); ++i) {
    const Eigen::Vector2d a = points[i - 1], d = points[i] - a;
    const auto range = [](double from, double to) {
      const double lo = std::min(from, to) - 1.5, hi = std::max(from, to) + 1.5;
      return std::pair(std::max(0, static_cast<int>(lo)),
                       std::min(kHeatMapPx - 1, static_cast<int>(hi)));
    };
    const auto [x0, x1] = range(a.x(), points[i].x());
    const auto [y0, y1] = range(a.y(), points[i].y());
    const double length2 = d.squaredNorm();
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const Eigen::Vector2d p(x + 0.5, y + 0.5);
        const double t = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0;
        float& cell = (*map)[static_cast<size_t>(y) * kHeatMapPx + static_cast<size_t>(x)];
        cell = std::max(cell, static_cast<float>(1 - (a + t * d - p).norm()));
      }
    }
  }
}

int Junctions::at(const Eigen::Vector2d& point) {
  // Rounding must not leave the heat map.
  const auto rounded = [](double x) {
    return std::min(std::lround(x * 1e3), kHeatMapPx * 1000L - 1);
  };
  const std::pair key(rounded(point.x()), rounded(point.y()));
  const auto [it, is_new] = known_.emplace(key, static_cast<int>(points_.size()));
  if (is_new) points_.emplace_back(double(key.first) * 1e-3, double(key.second) * 1e-3);
  return it->second;
}

struct Npz::Writer {
  archive* handle = archive_write_new();
  std::string bytes;

  ~Writer() { archive_write_free(handle); }
  void require(int status) const {
    if (status != ARCHIVE_OK) {
      throw SystemError(std::string("an npz file could not be made: ") +
                        archive_error_string(handle));
    }
  }
  void addMember(const std::string& name, const std::string& content) const {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    // No time is set: the same bytes whenever and wherever they are made.
    const int status = archive_write_header(handle, entry);
    archive_entry_free(entry);
    require(status);
    if (archive_write_data(handle, content.data(), content.size()) !=
        static_cast<la_ssize_t>(content.size())) {
      require(ARCHIVE_FATAL);
    }
  }
  template <class T>
  void addArray(const std::string& key,
                std::span<const size_t> shape,
                const std::vector<T>& values) const {
    addMember(key + ".npy", npyBytes<T>(shape, values));
  }
};

Npz::Npz() : writer_(std::make_unique<Writer>()) {
  archive* handle = writer_->handle;
  writer_->require(archive_write_set_format_zip(handle));
  writer_->require(archive_write_zip_set_compression_deflate(handle));
  writer_->require(archive_write_set_bytes_in_last_block(handle, 1));
  writer_->require(archive_write_open(
      handle,
      &writer_->bytes,
      nullptr,
      [](archive*, void* bytes, const void* data, size_t size) {
        static_cast<std::string*>(bytes)->append(static_cast<const char*>(data), size);
        return static_cast<la_ssize_t>(size);
      },
      nullptr));
}

Npz::~Npz() = default;

void Npz::add(const std::string& key,
              std::initializer_list<size_t> shape,
              const std::vector<float>& values) {
  writer_->addArray(key, {shape.begin(), shape.end()}, values);
}

void Npz::add(const std::string& key,
              std::initializer_list<size_t> shape,
              const std::vector<int32_t>& values) {
  writer_->addArray(key, {shape.begin(), shape.end()}, values);
}

std::string Npz::bytes() {
  writer_->require(archive_write_close(writer_->handle));
  return std::move(writer_->bytes);
}

std::vector<float> flat(const std::vector<Eigen::Vector2d>& points) {
  std::vector<float> values;
  for (const Eigen::Vector2d& p : points) {
    values.push_back(static_cast<float>(p.x()));
    values.push_back(static_cast<float>(p.y()));
  }
  return values;
}

std::string counted(size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace dlsd
