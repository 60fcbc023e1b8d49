// The one file that knows yaml-cpp.
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <sstream>

#include "cameras/calibration/tree.h"

namespace dlsd::calib {
namespace {

/// Receives yaml-cpp's events, so that limits hold while it parses, not afterwards.
class Receiver : public YAML::EventHandler {
 public:
  explicit Receiver(TreeBuilder* builder) : builder_(builder) {}

  void OnDocumentStart(const YAML::Mark& /*mark*/) override {
    // Of some broken texts yaml-cpp makes empty documents without end.
    if (++documents_ > 2) refuseSecondDocument();
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuseAnchor(mark, anchor);
    // An empty document after the first: `rostopic echo` ends each message by ---.
    if (documents_ > 1) return;
    enter(mark);
    builder_->null();
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    refuseAnchor(mark, 1);
  }
  void OnScalar(const YAML::Mark& mark,
                const std::string& tag,
                YAML::anchor_t anchor,
                const std::string& value) override {
    refuseSecondDocument();
    refuseAnchor(mark, anchor);
    builder_->scalar(value, tag == "!");
  }
  void OnSequenceStart(const YAML::Mark& mark,
                       const std::string& /*tag*/,
                       YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    refuseSecondDocument();
    refuseAnchor(mark, anchor);
    enter(mark);
    builder_->beginList();
  }
  void OnSequenceEnd() override { builder_->end(); }
  void OnMapStart(const YAML::Mark& mark,
                  const std::string& tag,
                  YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    refuseSecondDocument();
    refuseAnchor(mark, anchor);
    enter(mark);
    builder_->beginMap(tag.ends_with("opencv-matrix"));
  }
  void OnMapEnd() override { builder_->end(); }

 private:
  void enter(const YAML::Mark& mark) { builder_->at(mark.line + 1, mark.column + 1); }
  void refuseSecondDocument() const {
    if (documents_ > 1) builder_->fail("holds more than one YAML document, allowed is one");
  }
  void refuseAnchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
    if (anchor != 0) {
      builder_->fail("line " + std::to_string(mark.line + 1) +
                     ": uses an anchor or alias of YAML (& or *), allowed are plain values");
    }
  }

  TreeBuilder* builder_;
  int documents_ = 0;
};

}  // namespace

Node parseYaml(const std::string& text, const std::string& source) {
  TreeBuilder builder(source);
  Receiver receiver(&builder);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(receiver)) {
    }
  } catch (const YAML::Exception& e) {
    builder.fail("is not complete and correct YAML or JSON near line " +
                 std::to_string(e.mark.line + 1) + ", column " + std::to_string(e.mark.column + 1));
  }
  return builder.take();
}

}  // namespace dlsd::calib
