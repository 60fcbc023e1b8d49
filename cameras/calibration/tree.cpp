#include "cameras/calibration/tree.h"

#include <algorithm>
#include <numeric>

#include "cameras/calibration/fields.h"
#include "cameras/calibration/files.h"

namespace dlsd::calib {

const Node* Node::find(std::string_view key) const {
  for (size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] == key) return &items[i];
  }
  return nullptr;
}

void TreeBuilder::fail(const std::string& problem) const {
  throw InputError(source_ + ": " + problem);
}

void TreeBuilder::refuseKey() const {
  fail("line " + std::to_string(line_) + ", column " + std::to_string(column_) +
       ": a list, a map or nothing stands where a key is expected, which is a plain word (or a "
       "bracket is not closed)");
}

std::string TreeBuilder::place(std::string_view key) const {
  std::string text;
  for (const Open& open : open_) {
    if (open.node.isList()) {
      text += "[";
      text += std::to_string(open.node.items.size());
      text += "]";
    } else if (&open != &open_.back()) {
      text += (text.empty() ? "" : ".") + open.key;
    }
  }
  return shown(text + (text.empty() ? "" : ".") + std::string(key));
}

void TreeBuilder::scalar(std::string_view text, bool quoted) {
  if (!open_.empty() && open_.back().node.isMap() && !open_.back().has_key) {
    open_.back().key = text;
    open_.back().has_key = true;
    return;
  }
  Node node;
  node.kind = Node::Kind::kScalar;
  node.text = text;
  node.quoted = quoted;
  add(std::move(node));
}

void TreeBuilder::begin(Node::Kind kind, bool opencv_matrix) {
  if (!open_.empty() && open_.back().node.isMap() && !open_.back().has_key) {
    refuseKey();
  }
  if (open_.size() >= kMaxDepth) {
    fail("is nested deeper than " + std::to_string(kMaxDepth) +
         " levels, which no calibration file is");
  }
  Open open;
  open.node.kind = kind;
  open.node.opencv_matrix = opencv_matrix;
  open_.push_back(std::move(open));
}

void TreeBuilder::end() {
  Node& node = open_.back().node;
  if (node.isMap()) {
    std::vector<size_t> order(node.keys.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      return node.keys[a] < node.keys[b];
    });
    const auto twice = std::adjacent_find(order.begin(), order.end(), [&](size_t a, size_t b) {
      return node.keys[a] == node.keys[b];
    });
    if (twice != order.end()) fail(place(node.keys[*twice]) + " is given twice, allowed is once");
  }
  Node done = std::move(node);
  open_.pop_back();
  add(std::move(done));
}

void TreeBuilder::add(Node node) {
  if (++nodes_ > kMaxNodes) {
    fail("holds more than " + std::to_string(kMaxNodes) +
         " values, which no calibration file does");
  }
  if (open_.empty()) {
    root_ = std::move(node);
    return;
  }
  Open& parent = open_.back();
  if (parent.node.isMap()) {
    if (!parent.has_key) refuseKey();
    parent.node.keys.push_back(std::move(parent.key));
    parent.has_key = false;
  }
  parent.node.items.push_back(std::move(node));
}

}  // namespace dlsd::calib
