#pragma once
// Deliberate defects, to show that the tests notice them: `scripts/mutants.sh`. Not a part of any
// other build: DLSD_MUTANT is the constant `false` there.

#ifdef DLSD_MUTANTS
#include <cstdlib>
#include <string_view>

namespace dlsd {
/// Whether the environment variable DLSD_MUTANT names this defect.
[[nodiscard]] inline bool isActiveMutant(std::string_view name) {
  const char* active = std::getenv("DLSD_MUTANT");
  return active != nullptr && name == active;
}
}  // namespace dlsd

/// Each has its line in properties/mutants.tsv.
#define DLSD_MUTANT(name)                                    \
  ([]() -> bool {                                            \
    static const bool active = ::dlsd::isActiveMutant(name); \
    return active;                                           \
  }())
#else
#define DLSD_MUTANT(name) false
#endif
