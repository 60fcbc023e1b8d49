#pragma once
// Strict reading of the values of a calibration file: every refusal is one InputError sentence with
// file, key, value and what is allowed. And the numbers' text, both ways. Not part of the installed
// interface.

#include <cmath>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cameras/calibration/tree.h"
#include "cameras/camera.h"

namespace dlsd::calib {

/// Foreign text fit for a message: short, printable, one line.
[[nodiscard]] std::string shown(std::string_view text);
[[nodiscard]] std::string inQuotes(std::string_view text);
/// "a, b, c".
[[nodiscard]] std::string listed(std::span<const std::string_view> names);
/// One column of a table of names.
template <class Table, class Row>
[[nodiscard]] std::vector<std::string_view> column(const Table& table,
                                                   std::string_view Row::*member) {
  std::vector<std::string_view> names;
  names.reserve(table.size());
  for (const Row& row : table) names.push_back(row.*member);
  return names;
}

/// Shortest text that reads back as the same number.
[[nodiscard]] std::string shortest(double value);
/// The same with a decimal point: readers of YAML in Python take a number without one for an
/// integer or, with an exponent, for a string.
[[nodiscard]] std::string yamlNumber(double value);
/// A finite decimal number (of at most 1000 characters), or nothing. Independent of the locale.
[[nodiscard]] std::optional<double> parseNumber(std::string_view text);
/// decimal + 0.5 or, for sign -1, decimal - 0.5 as decimal text, without rounding, for pixel
/// coordinates of the other convention: x + 0.5 is often no double, so that a sum of doubles would
/// not read back as x. `decimal` is text that parseNumber accepts.
[[nodiscard]] std::string plusHalf(std::string_view decimal, int sign = 1);

/// What is allowed for a number: the interval [min, max] or (min, max] in a unit.
struct Allowed {
  double min, max;
  std::string_view unit;
  bool without_min = false;
  [[nodiscard]] std::string text() const;
};
[[nodiscard]] inline Allowed allowedBy(const ParamSpec& spec) {
  return {spec.min, spec.max, spec.unit};
}
/// The row of a model's parameter table with this name.
[[nodiscard]] const ParamSpec& specOf(std::string_view model, std::string_view param);

/// A value of the file and its place, as "cam0.intrinsics". Refers to the node and the source.
class Field {
 public:
  Field(const Node& node, const std::string& source, std::string place = "")
      : node_(&node), source_(&source), place_(std::move(place)) {}

  [[nodiscard]] const Node& node() const { return *node_; }
  [[nodiscard]] const std::string& place() const { return place_; }
  /// Throws InputError "<source>: <place> <problem>".
  [[noreturn]] void fail(const std::string& problem) const;

  /// Refuses anything but a map that has all `needed` keys, and otherwise `optional` and `ignored`
  /// ones alone.
  void expectKeys(std::span<const std::string_view> needed,
                  std::span<const std::string_view> optional = {},
                  std::span<const std::string_view> ignored = {}) const;
  [[nodiscard]] bool has(std::string_view key) const { return node_->find(key) != nullptr; }
  /// Value of a key; refused if this is no map or has no such key.
  [[nodiscard]] Field at(std::string_view key) const;
  /// Element of a list, with a name for messages.
  [[nodiscard]] Field item(size_t index, std::string_view name) const;

  [[nodiscard]] std::string word() const;
  /// One of these words; the answer is its index.
  [[nodiscard]] size_t oneOf(std::span<const std::string_view> words) const;
  [[nodiscard]] double number(const Allowed& allowed) const;
  /// A pixel coordinate that counts from the pixel's corner, in our convention: smaller by 0.5.
  [[nodiscard]] double numberFromCorner(const Allowed& allowed_here) const;
  /// @param with_point  "640.0" is allowed, too.
  [[nodiscard]] int integer(int min, int max, bool with_point = false) const;
  [[nodiscard]] int imageSize(bool with_point = false) const {
    return integer(1, Camera::kMaxImageSize, with_point);
  }
  /// A list of numbers, one for each parameter.
  [[nodiscard]] std::vector<double> numbers(std::span<const ParamSpec> specs) const;
  /// A list [width, height].
  [[nodiscard]] std::pair<int, int> resolution() const;
  /// Our extension max_field_angle, in (0, pi] rad.
  [[nodiscard]] double maxFieldAngle() const;

  /// makeCamera, with its refusal as this field's.
  [[nodiscard]] Camera camera(std::string_view model,
                              std::span<const double> params,
                              std::pair<int, int> size,
                              double max_field_angle_rad = M_PI) const;
  /// Of formats that have one word for lenses with and without distortion: the simplest model that
  /// says the same. distortion: k1, k2, p1, p2, k3.
  [[nodiscard]] Camera pinholeOrRadtan(std::span<const double> fx_fy_cx_cy,
                                       std::span<const double> distortion,
                                       std::pair<int, int> size,
                                       double max_field_angle_rad = M_PI) const;
  /// distortion: k1, k2, p1, p2, skew.
  [[nodiscard]] Camera omniOrRadtan(std::span<const double> xi_fx_fy_cx_cy,
                                    std::span<const double> distortion,
                                    std::pair<int, int> size,
                                    double max_field_angle_rad = M_PI) const;

 private:
  /// The text of a number outside quotes.
  [[nodiscard]] std::string_view numberText(const std::string& allowed) const;

  const Node* node_;
  const std::string* source_;
  std::string place_;
};

}  // namespace dlsd::calib
