#include "cameras/calibration/fields.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>

#include "cameras/calibration/files.h"
#include "cameras/mutant.h"

namespace dlsd::calib {
namespace {

constexpr double kHalf = 0.5;

/// Digits d0 d1 ... dn-1 meaning 0.d0 d1 ... x 10^point, without sign.
struct Decimal {
  std::string digits;
  long point = 0;
};

/// The digit that stands for 10^power.
int digitAt(const Decimal& d, long power) {
  const long i = d.point - 1 - power;
  return i >= 0 && i < static_cast<long>(d.digits.size()) ? d.digits[static_cast<size_t>(i)] - '0'
                                                          : 0;
}

}  // namespace

std::string shown(std::string_view text) {
  constexpr size_t kMaxShown = 60;
  std::string out;
  for (const char c : text.substr(0, kMaxShown)) out += (c >= ' ' && c < 0x7f) ? c : '?';
  if (text.size() > kMaxShown) out += "...";
  return out;
}

std::string inQuotes(std::string_view text) {
  std::string out = "\"";
  out += shown(text);
  out += "\"";
  return out;
}

std::string listed(std::span<const std::string_view> names) {
  std::string text;
  for (const std::string_view name : names) {
    if (!text.empty()) text += ", ";
    text += name;
  }
  return text;
}

std::string shortest(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string yamlNumber(double value) {
  std::string text = shortest(value);
  if (text.find('.') == std::string::npos) {
    text.insert(std::min(text.find('e'), text.size()), ".0");
  }
  return text;
}

std::optional<double> parseNumber(std::string_view text) {
  constexpr size_t kMaxLength = 1000;
  if (text.size() > kMaxLength) return std::nullopt;
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::string plusHalf(std::string_view decimal, int sign) {
  // Both terms as digits over the same powers of ten, then school arithmetic.
  bool negative = false;
  if (decimal.starts_with('+') || decimal.starts_with('-')) {
    negative = decimal[0] == '-';
    decimal.remove_prefix(1);
  }
  long exponent = 0;
  if (const size_t e = decimal.find_first_of("eE"); e != std::string_view::npos) {
    const std::string_view power = decimal.substr(decimal[e + 1] == '+' ? e + 2 : e + 1);
    decimal = decimal.substr(0, e);
    // The power of a zero may be anything, that of other doubles is small.
    const bool zero = decimal.find_first_not_of("0.") == std::string_view::npos;
    if (!zero) (void)std::from_chars(power.data(), power.data() + power.size(), exponent);
  }
  const size_t dot = std::min(decimal.find('.'), decimal.size());
  Decimal a{std::string(decimal.substr(0, dot)), static_cast<long>(dot) + exponent};
  if (dot < decimal.size()) a.digits += decimal.substr(dot + 1);
  const Decimal half{"5", 0};

  const long low = std::min(a.point - static_cast<long>(a.digits.size()), -1L);
  const long high = std::max(a.point, 1L);
  std::string sum;  // From the lowest digit up, as base-10 two's complement.
  int carry = 0;
  for (long power = low; power <= high; ++power) {
    const int y = digitAt(a, power) * (negative ? -1 : 1) + digitAt(half, power) * sign + carry;
    const int digit = ((y % 10) + 10) % 10;
    carry = (y - digit) / 10;
    sum += static_cast<char>('0' + digit);
  }
  const bool below_zero = carry < 0;
  if (below_zero) {  // 10^n - sum
    int borrow = 0;
    for (char& c : sum) {
      const int y = -(c - '0') - borrow;
      const int digit = ((y % 10) + 10) % 10;
      borrow = (digit - y) / 10;
      c = static_cast<char>('0' + digit);
    }
  }
  const auto fraction = static_cast<size_t>(-low);
  std::reverse(sum.begin(), sum.end());
  std::string whole = sum.substr(0, sum.size() - fraction);
  std::string rest = sum.substr(sum.size() - fraction);
  whole.erase(0, std::min(whole.find_first_not_of('0'), whole.size() - 1));
  rest.erase(rest.find_last_not_of('0') + 1);
  std::string out(below_zero ? "-" : "");
  out += whole;
  out += ".";
  out += rest.empty() ? "0" : rest;
  return out;
}

std::string Allowed::text() const {
  std::string out = without_min ? "(" : "[";
  out += shortest(min) + ", " + shortest(max) + "]";
  if (!unit.empty()) out += " ";
  out += unit;
  return out;
}

const ParamSpec& specOf(std::string_view model, std::string_view param) {
  for (const ParamSpec& spec : paramSpecsOf(model)) {
    if (spec.name == param) return spec;
  }
  throw std::invalid_argument("model " + std::string(model) + " has no parameter " +
                              std::string(param));
}

void Field::fail(const std::string& problem) const {
  throw InputError(*source_ + ": " + place_ + (place_.empty() ? "" : " ") + problem);
}

void Field::expectKeys(std::span<const std::string_view> needed,
                       std::span<const std::string_view> optional,
                       std::span<const std::string_view> ignored) const {
  const auto allowed = [&] {
    std::vector<std::string_view> all(needed.begin(), needed.end());
    all.insert(all.end(), optional.begin(), optional.end());
    all.insert(all.end(), ignored.begin(), ignored.end());
    return listed(all);
  };
  if (!node_->isMap()) fail("must be a map with " + listed(needed));
  for (const std::string& key : node_->keys) {
    const auto in = [&](std::span<const std::string_view> names) {
      return std::find(names.begin(), names.end(), key) != names.end();
    };
    if (!in(needed) && !in(optional) && !in(ignored)) {
      fail("has the unknown key " + inQuotes(key) + ", allowed are " + allowed());
    }
  }
  for (const std::string_view key : needed) {
    if (!has(key)) {
      Field(*node_, *source_, place_ + (place_.empty() ? "" : ".") + std::string(key))
          .fail("is missing, needed are " + listed(needed));
    }
  }
}

Field Field::at(std::string_view key) const {
  const std::string place = place_ + (place_.empty() ? "" : ".") + std::string(key);
  if (!node_->isMap()) fail("must be a map with the key " + std::string(key));
  const Node* const value = node_->find(key);
  if (value == nullptr) Field(*node_, *source_, place).fail("is missing");
  return {*value, *source_, place};
}

Field Field::item(size_t index, std::string_view name) const {
  std::string place = place_ + std::string("[") + std::to_string(index) + "]";
  if (!name.empty()) place += " (" + std::string(name) + ")";
  return {node_->items.at(index), *source_, std::move(place)};
}

std::string Field::word() const {
  if (!node_->isScalar()) fail("must be one word");
  return node_->text;
}

size_t Field::oneOf(std::span<const std::string_view> words) const {
  const std::string given = word();
  const auto found = std::find(words.begin(), words.end(), given);
  if (found == words.end()) {
    fail("= " + inQuotes(given) + " is not supported, allowed is one of " + listed(words));
  }
  return static_cast<size_t>(found - words.begin());
}

std::string_view Field::numberText(const std::string& allowed) const {
  if (!node_->isScalar()) fail("must be a number, allowed is " + allowed);
  if (node_->quoted) {
    fail("= " + inQuotes(node_->text) + " is text in quotes, allowed is " + allowed);
  }
  return node_->text;
}

double Field::number(const Allowed& allowed) const {
  const std::string_view text = numberText(allowed.text());
  const std::optional<double> value = parseNumber(text);
  if (!value) fail("= " + inQuotes(text) + " is not a finite number, allowed is " + allowed.text());
  if (!(*value >= allowed.min && *value <= allowed.max) ||
      (allowed.without_min && *value == allowed.min)) {
    fail("= " + shortest(*value) + " is out of range, allowed is " + allowed.text());
  }
  return *value;
}

double Field::numberFromCorner(const Allowed& allowed_here) const {
  (void)number({allowed_here.min + kHalf, allowed_here.max + kHalf, allowed_here.unit});
  return parseNumber(DLSD_MUTANT("read-half-pixel") ? node_->text : plusHalf(node_->text, -1))
      .value();
}

int Field::integer(int min, int max, bool with_point) const {
  const std::string allowed =
      "a whole number in [" + std::to_string(min) + ", " + std::to_string(max) + "]";
  const std::string_view text = numberText(allowed);
  int value = 0;
  auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (with_point && error == std::errc() && stop != text.data() + text.size() && *stop == '.') {
    ++stop;
    while (stop != text.data() + text.size() && *stop == '0') ++stop;
  }
  if (error != std::errc() || stop != text.data() + text.size() || value < min || value > max) {
    fail("= " + inQuotes(text) + " is out of range, allowed is " + allowed);
  }
  return value;
}

std::vector<double> Field::numbers(std::span<const ParamSpec> specs) const {
  std::vector<std::string_view> names;
  for (const ParamSpec& spec : specs) names.push_back(spec.name);
  const std::string wanted =
      "must be a list of " + std::to_string(specs.size()) + " numbers [" + listed(names) + "]";
  if (!node_->isList()) fail(wanted);
  if (node_->items.size() != specs.size()) {
    fail(wanted + ", got " + std::to_string(node_->items.size()));
  }
  std::vector<double> values;
  for (size_t i = 0; i < specs.size(); ++i) {
    values.push_back(item(i, specs[i].name).number(allowedBy(specs[i])));
  }
  return values;
}

std::pair<int, int> Field::resolution() const {
  if (!node_->isList() || node_->items.size() != 2) {
    fail("must be a list of 2 whole numbers [width, height]");
  }
  return {item(0, "width").imageSize(), item(1, "height").imageSize()};
}

double Field::maxFieldAngle() const {
  return number({0, M_PI, "rad", true});
}

Camera Field::camera(std::string_view model,
                     std::span<const double> params,
                     std::pair<int, int> size,
                     double max_field_angle_rad) const {
  try {
    return makeCamera(model, params, size.first, size.second, max_field_angle_rad);
  } catch (const std::invalid_argument& e) {
    throw InputError(*source_ + ": " + place_ + (place_.empty() ? "" : ": ") + e.what());
  }
}

Camera Field::pinholeOrRadtan(std::span<const double> fx_fy_cx_cy,
                              std::span<const double> distortion,
                              std::pair<int, int> size,
                              double max_field_angle_rad) const {
  std::vector<double> params(fx_fy_cx_cy.begin(), fx_fy_cx_cy.end());
  if (std::all_of(distortion.begin(), distortion.end(), [](double k) { return k == 0; })) {
    return camera("pinhole", params, size, max_field_angle_rad);
  }
  params.insert(params.end(), distortion.begin(), distortion.end());
  return camera("pinhole_radtan", params, size, max_field_angle_rad);
}

Camera Field::omniOrRadtan(std::span<const double> xi_fx_fy_cx_cy,
                           std::span<const double> distortion,
                           std::pair<int, int> size,
                           double max_field_angle_rad) const {
  std::vector<double> params(xi_fx_fy_cx_cy.begin(), xi_fx_fy_cx_cy.end());
  if (std::all_of(distortion.begin(), distortion.end(), [](double k) { return k == 0; })) {
    return camera("omni", params, size, max_field_angle_rad);
  }
  params.insert(params.end(), distortion.begin(), distortion.end());
  return camera("omni_radtan", params, size, max_field_angle_rad);
}

}  // namespace dlsd::calib
