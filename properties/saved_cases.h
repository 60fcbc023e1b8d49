#pragma once
// Runs a property whose predicate is in properties/checks: the smallest case that fails is saved as
// a folder that `dlsd replay` understands.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <exception>
#include <filesystem>
#include <optional>
#include <string>

#include "properties/checks/counterexample.h"
#include "properties/checks/judge.h"
#include "properties/holds.h"

namespace dlsd {

/// Judges check(draw()) on a share of RC_PARAMS' number of cases, as `holds` does, and adds what
/// came of each to sums with tally(case, outcome), to the first failure and with it; of what
/// RapidCheck tries after it, nothing. An outcome has a `failure` (empty: the property holds) and
/// says whether the property `applies`; cases to which it doesn't are discarded, after they were
/// tallied. What is thrown is a failure. Each case is on disk while it is judged. Returns how many
/// cases were judged.
template <class Draw, class Check, class Tally>
long holdsOrSaves(double share, const Draw& draw, const Check& check, const Tally& tally) {
  const std::string parent = "counterexamples";
  nlohmann::ordered_json failed;
  std::string failure;
  const long cases = holds(share, [&] {
    const auto drawn = draw();
    const nlohmann::ordered_json json = toJson(drawn);
    const UnfinishedCase unfinished(parent, json);
    decltype(check(drawn)) outcome;
    try {
      outcome = check(drawn);
    } catch (const std::exception& e) {
      outcome.failure = std::string("an exception: ") + e.what();
    }
    if (failed.is_null()) tally(drawn, outcome);
    if (!outcome.failure.empty()) {
      failed = json;
      failure = outcome.failure;
      RC_FAIL(outcome.failure);
    }
    RC_PRE(outcome.applies);
  });
  if (!failed.is_null()) {
    const std::string folder =
        saveCounterexample(parent, failed, failure, judgeCase(failed, "case", true).shown);
    ADD_FAILURE() << failure << "\ndlsd replay "
                  << std::filesystem::absolute(folder + "/case.json").string();
  }
  return cases;
}

}  // namespace dlsd
