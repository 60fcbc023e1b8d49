#include "properties/worst.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <utility>

namespace dlsd {

Worst::Worst(std::string what, std::vector<std::string_view> kinds)
    : what_(std::move(what)), kinds_(std::move(kinds)), seen_(kinds_.size()) {}

Worst::~Worst() {
  const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info();
  std::ostringstream text, rows;
  for (size_t k = 0; k < kinds_.size(); ++k) {
    text << (k > 0 ? "; " : "") << kinds_[k] << (kinds_[k].empty() ? "" : " ")
         << std::setprecision(3) << seen_[k].value << " (of " << seen_[k].count << ")";
    rows << (test ? test->test_suite_name() : "") << "." << (test ? test->name() : "") << "\t"
         << what_ << "\t" << kinds_[k] << "\t" << std::setprecision(3) << seen_[k].value << "\t"
         << seen_[k].count << "\n";
  }
  ::testing::Test::RecordProperty("worst " + what_, text.str());
  std::cout << "    worst " << what_ << ": " << text.str() << "\n";
  // One write, so that lines of tests that run side by side do not mix.
  const char* path = std::getenv("DLSD_WORST");
  if (path == nullptr) return;
  std::ofstream file(path, std::ios::app);
  file << rows.str();
  file.close();
  EXPECT_TRUE(file) << "DLSD_WORST = \"" << path << "\" cannot be written";
}

void Worst::see(double value, size_t kind) {
  Seen& seen = seen_[kind];
  ++seen.count;
  if (!std::isnan(seen.value) && !(value <= seen.value)) seen.value = value;
}

long Worst::count() const {
  long sum = 0;
  for (const Seen& seen : seen_) sum += seen.count;
  return sum;
}

}  // namespace dlsd
