#pragma once
// The text of a calibration file as a tree of maps, lists and scalars, the same for YAML, JSON and
// OpenCV's XML. Not part of the installed interface.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dlsd::calib {

/// Bounds of what is parsed: real calibrations stay far below, and time and memory stay bounded.
inline constexpr size_t kMaxFileBytes = 4 << 20;
inline constexpr size_t kMaxNodes = 500'000;
inline constexpr size_t kMaxDepth = 32;

struct Node {
  enum class Kind : uint8_t { kNull, kScalar, kList, kMap };
  Kind kind = Kind::kNull;
  bool quoted = false;            ///< A scalar that stood in quotes: a word, never a number.
  bool opencv_matrix = false;     ///< A map marked as cv::Mat.
  std::string text;               ///< Of a scalar.
  std::vector<std::string> keys;  ///< Of a map, each once; keys[i] belongs to items[i].
  std::vector<Node> items;        ///< Of a list or a map.

  [[nodiscard]] bool isMap() const { return kind == Kind::kMap; }
  [[nodiscard]] bool isList() const { return kind == Kind::kList; }
  [[nodiscard]] bool isScalar() const { return kind == Kind::kScalar; }
  /// The value of a key, or nullptr if this is no map or has no such key.
  [[nodiscard]] const Node* find(std::string_view key) const;
};

/// Puts a tree together from a parser's events, and refuses (InputError) duplicate keys, keys that
/// are no words, and trees that are too deep or too large. In a map, keys and values alternate.
class TreeBuilder {
 public:
  explicit TreeBuilder(std::string source) : source_(std::move(source)) {}

  /// Where the next event stands in the text, both from 1.
  void at(int line, int column) {
    line_ = line;
    column_ = column;
  }
  void null() { add(Node{}); }
  void scalar(std::string_view text, bool quoted);
  void beginList() { begin(Node::Kind::kList, false); }
  void beginMap(bool opencv_matrix) { begin(Node::Kind::kMap, opencv_matrix); }
  void end();

  /// The whole tree, after its last event.
  [[nodiscard]] Node take() { return std::move(root_); }
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  struct Open {
    Node node;
    std::string key;  ///< Of the value that comes next.
    bool has_key = false;
  };
  void begin(Node::Kind kind, bool opencv_matrix);
  void add(Node node);
  [[noreturn]] void refuseKey() const;
  [[nodiscard]] std::string place(std::string_view key) const;

  std::string source_;
  std::vector<Open> open_;
  Node root_;
  size_t nodes_ = 0;
  int line_ = 1, column_ = 1;
};

/// Exactly one document of YAML, or of JSON, which is read as the YAML that it is.
/// `source` names the file in messages. Throws InputError.
[[nodiscard]] Node parseYaml(const std::string& text, const std::string& source);

/// XML as cv::FileStorage writes it: <opencv_storage> with elements, text and type_id.
[[nodiscard]] Node parseOpencvXml(std::string_view text, const std::string& source);

}  // namespace dlsd::calib
