#include "synth/dataset/json_fields.h"

#include <cmath>
#include <filesystem>

#include "cameras/calibration/files.h"

namespace dlsd {

nlohmann::json parseJson(std::string_view text, const std::string& source) {
  try {
    return nlohmann::json::parse(text.begin(), text.end());
  } catch (const nlohmann::json::exception& e) {
    // The library's text starts with its own error number in brackets.
    const std::string what = e.what();
    const size_t cut = what.find("] ");
    throw InputError(source + ": not valid JSON (" +
                     (cut == std::string::npos ? what : what.substr(cut + 2)) + ")");
  }
}

JsonField JsonField::operator[](const char* key) const {
  if (!value_->is_object()) fail("must be an object");
  const std::string place = place_.empty() ? std::string(key) : place_ + "." + key;
  const auto it = value_->find(key);
  if (it == value_->end()) throw InputError(source_ + ": " + place + " is missing");
  return {*it, source_, place};
}

bool JsonField::has(const char* key) const {
  if (!value_->is_object()) fail("must be an object");
  return value_->contains(key);
}

std::vector<JsonField> JsonField::array(size_t min_size, size_t max_size) const {
  if (!value_->is_array()) fail("must be an array");
  if (value_->size() < min_size || value_->size() > max_size) {
    fail(min_size == max_size ? "must have " + std::to_string(min_size) + " elements"
                              : "must have at least " + std::to_string(min_size) + " elements");
  }
  std::vector<JsonField> fields;
  fields.reserve(value_->size());
  for (size_t i = 0; i < value_->size(); ++i) {
    fields.emplace_back((*value_)[i], source_, place_ + "[" + std::to_string(i) + "]");
  }
  return fields;
}

double JsonField::number() const {
  if (!value_->is_number()) fail("must be a finite number");
  const double number = value_->get<double>();
  if (!std::isfinite(number)) fail("must be a finite number");
  return number;
}

int JsonField::integer(int min, int max) const {
  const std::string allowed =
      "must be an integer in [" + std::to_string(min) + ", " + std::to_string(max) + "]";
  if (!value_->is_number_integer()) fail(allowed);
  const double number = value_->get<double>();  // Exact or far out of range.
  if (!(number >= min && number <= max)) fail(allowed);
  return value_->get<int>();
}

uint64_t JsonField::counter() const {
  if (!value_->is_number_unsigned()) fail("must be an integer in [0, 2^64)");
  return value_->get<uint64_t>();
}

std::string JsonField::text() const {
  if (!value_->is_string() || value_->get_ref<const std::string&>().empty()) {
    fail("must be a text that is not empty");
  }
  return value_->get<std::string>();
}

std::string JsonField::insidePath() const {
  const std::filesystem::path path(text());
  bool inside = path.is_relative();
  for (const auto& part : path) inside = inside && part != "..";
  if (!inside) fail("must be a path inside the data folder");
  return path.string();
}

Eigen::Vector2d JsonField::vector2() const {
  const auto fields = array(2, 2);
  return {fields[0].number(), fields[1].number()};
}

Eigen::Vector3d JsonField::vector3() const {
  const auto fields = array(3, 3);
  return {fields[0].number(), fields[1].number(), fields[2].number()};
}

Eigen::Vector3d JsonField::unitVector3() const {
  const Eigen::Vector3d v = vector3();
  if (!(std::abs(v.norm() - 1) <= 1e-6)) fail("must be a unit vector");
  return v;
}

void JsonField::fail(const std::string& problem) const {
  std::string value = value_->dump();
  constexpr size_t kLongest = 60;
  if (value.size() > kLongest) value = value.substr(0, kLongest) + "...";
  throw InputError(source_ + ": " + (place_.empty() ? "the document" : place_) + " = " + value +
                   " " + problem);
}

}  // namespace dlsd
