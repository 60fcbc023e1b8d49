#pragma once
#include <chrono>

namespace dlsd {

/// Adds the time between construction and destruction to a counter of seconds.
class StopWatch {
 public:
  using Clock = std::chrono::steady_clock;

  explicit StopWatch(double* seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~StopWatch() { *seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  StopWatch(const StopWatch&) = delete;
  StopWatch& operator=(const StopWatch&) = delete;

 private:
  double* seconds_;
  Clock::time_point start_;
};

}  // namespace dlsd
