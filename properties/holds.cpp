#include "properties/holds.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <string>

namespace dlsd {

long holds(double share, const std::function<void()>& property) {
  using Clock = std::chrono::steady_clock;
  const char* given = std::getenv("DLSD_SHRINK_SECONDS");
  const std::chrono::duration<double> most_shrinking(given != nullptr ? std::atof(given) : 5);
  long cases = 0;
  std::string message;
  std::optional<Clock::time_point> first_failure;
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  params.maxSuccess = std::max(10, static_cast<int>(params.maxSuccess * share));
  params.maxDiscardRatio = 1;
  rc::detail::TestMetadata metadata;
  metadata.id = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  const auto result = rc::detail::checkTestable(
      [&] {
        // RapidCheck shrinks for as long as it likes: later candidates count as no failure.
        if (first_failure && Clock::now() - *first_failure > most_shrinking) return;
        if (!first_failure) ++cases;
        try {
          property();
        } catch (const rc::detail::CaseResult& failure) {
          if (failure.type == rc::detail::CaseResult::Type::Failure) {
            message = failure.description;
            if (!first_failure) first_failure = Clock::now();
          }
          throw;
        }
      },
      metadata,
      params);
  std::ostringstream text;
  rc::detail::printResultMessage(result, text);
  EXPECT_TRUE(result.is<rc::detail::SuccessResult>()) << text.str() << message;
  return cases;
}

}  // namespace dlsd
