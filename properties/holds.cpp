#include "properties/holds.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/detail/TestListenerAdapter.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <string>

namespace dlsd {

namespace {

/// Keeps the last case that failed. RapidCheck itself runs it once more for its report, when
/// the time for shrinking may be over.
class LastFailure : public rc::detail::TestListenerAdapter {
 public:
  void onTestCaseFinished(const rc::detail::CaseDescription& tried) override { see(tried); }
  void onShrinkTried(const rc::detail::CaseDescription& tried, bool /*accepted*/) override {
    see(tried);
  }
  [[nodiscard]] const std::optional<rc::detail::CaseDescription>& get() const { return last_; }

 private:
  void see(const rc::detail::CaseDescription& tried) {
    if (tried.result.type == rc::detail::CaseResult::Type::Failure) last_ = tried;
  }
  std::optional<rc::detail::CaseDescription> last_;
};

}  // namespace

long holds(double share, const std::function<void()>& property) {
  using Clock = std::chrono::steady_clock;
  const char* given = std::getenv("DLSD_SHRINK_SECONDS");
  const std::chrono::duration<double> most_shrinking(given != nullptr ? std::atof(given) : 5);
  long judged = 0;
  std::optional<Clock::time_point> first_failure;
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  params.maxSuccess = std::max(10, static_cast<int>(params.maxSuccess * share));
  params.maxDiscardRatio = 1;
  rc::detail::TestMetadata metadata;
  metadata.id = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  LastFailure last;
  auto result = rc::detail::checkTestable(
      [&] {
        // RapidCheck shrinks for as long as it likes: later candidates count as no failure.
        if (first_failure && Clock::now() - *first_failure > most_shrinking) return;
        const auto fail = [&] {
          if (first_failure) return;
          ++judged;
          first_failure = Clock::now();
        };
        try {
          property();
          if (!first_failure) ++judged;
        } catch (const rc::detail::CaseResult& thrown) {
          if (thrown.type == rc::detail::CaseResult::Type::Failure) fail();
          throw;
        } catch (const rc::GenerationFailure&) {  // RapidCheck discards the case.
          throw;
        } catch (...) {
          fail();
          throw;
        }
      },
      metadata,
      params,
      last);
  rc::detail::FailureResult failure;
  if (result.match(failure) && last.get()) {
    failure.counterExample = last.get()->example();
    failure.description = last.get()->result.description;
    result = failure;
  }
  std::ostringstream text;
  rc::detail::printResultMessage(result, text);
  EXPECT_TRUE(result.is<rc::detail::SuccessResult>()) << text.str();
  return judged;
}

}  // namespace dlsd
