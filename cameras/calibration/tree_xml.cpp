#include <algorithm>

#include "cameras/calibration/tree.h"

namespace dlsd::calib {
namespace {

constexpr std::string_view kSpace = " \t\r\n";
constexpr std::string_view kRoot = "opencv_storage";

/// Elements, attributes, text and comments; no CDATA, no document type, no namespaces.
class XmlParser {
 public:
  XmlParser(std::string_view text, const std::string& source) : text_(text), builder_(source) {}

  Node parse() {
    skipSpaceAndComments();
    if (rest().starts_with("<?xml")) {
      skipPast("?>");
      skipSpaceAndComments();
    }
    const Tag root = openTag();
    if (root.name != kRoot) fail("the outermost element must be opencv_storage");
    element(root);
    skipSpaceAndComments();
    if (at_ < text_.size()) fail("something follows the end of opencv_storage");
    return builder_.take();
  }

 private:
  struct Tag {
    std::string_view name;
    bool opencv_matrix = false;
    bool empty = false;  ///< <name/>
  };

  [[nodiscard]] std::string_view rest() const { return text_.substr(at_); }

  [[noreturn]] void fail(const std::string& problem) const {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + std::ptrdiff_t(at_), '\n');
    builder_.fail("is not complete and correct XML of OpenCV near line " + std::to_string(line) +
                  ": " + problem);
  }

  void skipPast(std::string_view end) {
    const size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) fail("the file ends too early");
    at_ = found + end.size();
  }

  void skipSpace() { at_ = std::min(text_.find_first_not_of(kSpace, at_), text_.size()); }

  void skipSpaceAndComments() {
    for (skipSpace(); rest().starts_with("<!--"); skipSpace()) skipPast("-->");
  }

  std::string_view name() {
    const size_t begin = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_' ||
            text_[at_] == '-' || text_[at_] == '.' || text_[at_] == ':')) {
      ++at_;
    }
    if (at_ == begin) fail("a name is expected");
    return text_.substr(begin, at_ - begin);
  }

  Tag openTag() {
    if (!rest().starts_with("<")) fail("an element is expected");
    ++at_;
    Tag tag;
    tag.name = name();
    for (;;) {
      skipSpace();
      if (rest().starts_with("/>")) {
        at_ += 2;
        tag.empty = true;
        return tag;
      }
      if (rest().starts_with(">")) {
        ++at_;
        return tag;
      }
      const std::string_view attribute = name();
      if (!rest().starts_with("=\"")) fail("an attribute needs =\"...\"");
      at_ += 2;
      const size_t begin = at_;
      skipPast("\"");
      if (attribute == "type_id") {
        tag.opencv_matrix = text_.substr(begin, at_ - 1 - begin) == "opencv-matrix";
      }
    }
  }

  void closeTag(std::string_view wanted) {
    if (!rest().starts_with("</")) fail("</" + std::string(wanted) + "> is expected");
    at_ += 2;
    if (name() != wanted) fail("</" + std::string(wanted) + "> is expected");
    skipSpace();
    if (!rest().starts_with(">")) fail("</" + std::string(wanted) + "> is expected");
    ++at_;
  }

  /// Content and closing tag of an element whose opening tag was just read.
  void element(const Tag& tag) {
    if (tag.empty) {
      builder_.null();
      return;
    }
    skipSpaceAndComments();
    if (!rest().starts_with("<")) {
      leaf();
    } else if (rest().starts_with("</")) {
      builder_.null();
    } else if (rest().starts_with("<_>") || rest().starts_with("<_ ")) {
      children(false, tag.opencv_matrix);
    } else {
      children(true, tag.opencv_matrix);
    }
    closeTag(tag.name);
  }

  void children(bool map, bool opencv_matrix) {
    if (map) {
      builder_.beginMap(opencv_matrix);
    } else {
      builder_.beginList();
    }
    for (skipSpaceAndComments(); !rest().starts_with("</"); skipSpaceAndComments()) {
      const Tag tag = openTag();
      if (map == (tag.name == "_")) fail("<_> and named elements are mixed");
      if (map) builder_.scalar(tag.name, false);
      element(tag);
    }
    builder_.end();
  }

  /// Text: one word in quotes, or words between spaces, of which several make a list.
  void leaf() {
    const size_t end = text_.find('<', at_);
    if (end == std::string_view::npos) fail("the file ends too early");
    std::string_view words = text_.substr(at_, end - at_);
    words.remove_suffix(words.size() - 1 - words.find_last_not_of(kSpace));
    at_ = end;
    if (words.size() >= 2 && words.front() == '"' && words.back() == '"') {
      builder_.scalar(words.substr(1, words.size() - 2), true);
      return;
    }
    if (words.find_first_of(kSpace) == std::string_view::npos) {
      builder_.scalar(words, false);
      return;
    }
    builder_.beginList();
    while (!words.empty()) {
      const size_t length = std::min(words.find_first_of(kSpace), words.size());
      builder_.scalar(words.substr(0, length), false);
      words.remove_prefix(length);
      words.remove_prefix(std::min(words.find_first_not_of(kSpace), words.size()));
    }
    builder_.end();
  }

  std::string_view text_;
  size_t at_ = 0;
  TreeBuilder builder_;
};

}  // namespace

Node parseOpencvXml(std::string_view text, const std::string& source) {
  return XmlParser(text, source).parse();
}

}  // namespace dlsd::calib
