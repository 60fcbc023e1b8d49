#pragma once
// Worst errors that a property has seen, for the tables in docs and notes.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace dlsd {

/// Worst value of a property, for each kind of input apart. When it goes out of scope, which is
/// when its test ends, it is printed, recorded with the test, and appended as a line "test, what,
/// kind, worst, count" (tab-separated) to the file that the environment variable DLSD_WORST names,
/// if there is one. Properties show it their first failure, and nothing of what RapidCheck tries to
/// shrink that.
class Worst {
 public:
  /// @param what   What is measured, and in which unit.
  /// @param kinds  Names of the kinds of input, if there are several.
  explicit Worst(std::string what, std::vector<std::string_view> kinds = {""});
  ~Worst();
  Worst(const Worst&) = delete;
  Worst& operator=(const Worst&) = delete;

  /// NaN counts as worse than everything, whatever is seen later.
  void see(double value, size_t kind = 0);
  /// Of all kinds.
  [[nodiscard]] long count() const;

 private:
  struct Seen {
    double value = 0;
    long count = 0;
  };
  std::string what_;
  std::vector<std::string_view> kinds_;
  std::vector<Seen> seen_;
};

}  // namespace dlsd
