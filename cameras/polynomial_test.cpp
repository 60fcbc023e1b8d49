#include "cameras/polynomial.h"

#include <gtest/gtest.h>

#include <array>

namespace dlsd {
namespace {

TEST(Polynomial, IsEvaluated) {
  EXPECT_EQ(evalPolynomial(std::array{1.0, 2.0, 3.0}, 2), 17);
  EXPECT_EQ(evalPolynomial({}, 2), 0);
}

TEST(SignChanges, AreFoundInOrder) {
  const std::array cubic{-6.0, 11.0, -6.0, 1.0};  // (x - 1)(x - 2)(x - 3)
  const auto roots = signChanges(cubic, 0, 10);
  ASSERT_EQ(roots.size(), 3U);
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(roots[i], static_cast<double>(i + 1), 1e-14);
  EXPECT_EQ(signChanges(cubic, 1.5, 2.5).size(), 1U);
  EXPECT_TRUE(signChanges(cubic, 4, 10).empty());
}

TEST(SignChanges, IgnoreRootsOfEvenOrder) {
  EXPECT_TRUE(signChanges(std::array{1.0, -2.0, 1.0}, 0, 10).empty());         // (x - 1)^2
  EXPECT_EQ(signChanges(std::array{-1.0, 3.0, -3.0, 1.0}, 0, 10).size(), 1U);  // (x - 1)^3
}

TEST(SignChanges, TakeVanishingCoefficientsAsTheyCome) {
  EXPECT_EQ(signChanges(std::array{-1.0, 1.0, 0.0, 0.0}, 0, 10), (std::vector<double>{1}));
  EXPECT_EQ(signChanges(std::array{-16.0, 0.0, 0.0, 0.0, 1.0}, 0, 10), (std::vector<double>{2}));
  EXPECT_TRUE(signChanges(std::array{3.0, 0.0, 0.0}, 0, 10).empty());
  EXPECT_TRUE(signChanges(std::array{0.0, 0.0}, 0, 10).empty());
  EXPECT_TRUE(signChanges(std::array{5.0}, 0, 10).empty());
  EXPECT_TRUE(signChanges({}, 0, 10).empty());
}

TEST(Polynomial, InterpolationGivesBackAPolynomialAndComesNearAFunction) {
  const std::array<double, 5> known{1, -2, 0, 3, 0.5};
  const auto same =
      interpolateAtChebyshevNodes<5>(2, [&](double x) { return evalPolynomial(known, x); });
  for (size_t i = 0; i < known.size(); ++i) EXPECT_NEAR(same[i], known[i], 1e-13) << i;

  const auto sine = interpolateAtChebyshevNodes<10>(1, [](double x) { return std::sin(x); });
  for (double x = 0; x <= 1; x += 0.01) {
    // max |sin^(10)| / (10! 2^19)
    EXPECT_NEAR(evalPolynomial(sine, x), std::sin(x), 6e-13) << x;
  }
}

}  // namespace
}  // namespace dlsd
