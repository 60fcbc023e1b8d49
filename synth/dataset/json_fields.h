#pragma once
// Strict reading of JSON objects: every refusal names the source, the key, the value and what is
// allowed. Used by the readers of records and manifests; not part of the installed interface.

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace dlsd {

/// Parses a JSON text. Throws InputError "<source>: not valid JSON ...".
[[nodiscard]] nlohmann::json parseJson(std::string_view text, const std::string& source);

/// A view of one JSON value inside a document, which knows its place ("lines[3].points").
class JsonField {
 public:
  JsonField(const nlohmann::json& value, std::string source, std::string place = "")
      : value_(&value), source_(std::move(source)), place_(std::move(place)) {}

  /// Member of an object; InputError if this is no object or the key is missing.
  [[nodiscard]] JsonField operator[](const char* key) const;
  [[nodiscard]] bool has(const char* key) const;
  /// Elements of an array; InputError if this is no array or its size is outside [min, max].
  [[nodiscard]] std::vector<JsonField> array(size_t min_size = 0, size_t max_size = SIZE_MAX) const;

  [[nodiscard]] double number() const;  ///< Finite.
  [[nodiscard]] int integer(int min, int max) const;
  [[nodiscard]] uint64_t counter() const;  ///< Integer in [0, 2^64).
  [[nodiscard]] std::string text() const;  ///< Not empty.
  /// A relative path that does not lead out of its folder.
  [[nodiscard]] std::string insidePath() const;
  [[nodiscard]] Eigen::Vector2d vector2() const;
  [[nodiscard]] Eigen::Vector3d vector3() const;
  /// A unit vector to 1e-6.
  [[nodiscard]] Eigen::Vector3d unitVector3() const;
  [[nodiscard]] const nlohmann::json& raw() const { return *value_; }

  /// Throws InputError "<source>: <place> = <value> <problem>".
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  const nlohmann::json* value_;
  std::string source_, place_;
};

}  // namespace dlsd
