// The vector kernels: equal bit for bit at every width, and true bounds.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include "services/prediction/pack_kernels.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

constexpr int kMaxDims = 24;

struct Problem {
  SquaresTerm sum, exponent;
  std::array<float, kMaxDims * kLanes> table;
  std::array<float, kMaxDims> origin;
};

Problem MakeProblem(uint64_t seed) {
  InstanceGenerator random(seed);
  Problem p{};
  const double scale = std::pow(10.0, random.Uniform(-3, 2));
  p.sum = {1 + static_cast<int>(random.Uniform(0, 11.9)), static_cast<float>(random.Uniform(0, 1)),
           seed % 2 ? static_cast<float>(scale * random.Uniform(0, 2)) : 0.0F};
  p.exponent = {1 + static_cast<int>(random.Uniform(0, 11.9)),
                static_cast<float>(random.Uniform(-100, 5)),
                seed % 3 ? static_cast<float>(scale * random.Uniform(0, 2)) : 0.0F};
  for (float& x : p.table) x = static_cast<float>(scale * random.Normal());
  for (float& x : p.origin) x = static_cast<float>(scale * random.Normal());
  return p;
}

std::array<float, kLanes> Bounds(const Kernels& kernels, const Problem& p, uint32_t wanted) {
  std::array<float, kLanes> out{};
  kernels.cost_bounds(p.sum, p.exponent, p.table.data(), p.origin.data(), wanted, out.data());
  return out;
}

TEST(PackKernels, AreEqualBitForBitAtEveryWidth) {
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const Problem p = MakeProblem(seed);
    const auto narrow = Bounds(BaselineKernels(), p, ~0U), best = Bounds(BestKernels(), p, ~0U);
    ASSERT_EQ(std::memcmp(narrow.data(), best.data(), sizeof narrow), 0) << "seed " << seed;
    InstanceGenerator random(seed + 77);
    const uint32_t wanted = static_cast<uint32_t>(random.Uniform(0, 4294967295.0));
    const float limit = static_cast<float>(random.Uniform(0, 9)) * p.table[0] * p.table[0];
    ASSERT_EQ(BaselineKernels().inside(p.table.data(), p.origin.data(), wanted, limit),
              BestKernels().inside(p.table.data(), p.origin.data(), wanted, limit))
        << "seed " << seed;
  }
}

// In double precision: the ball of `radius` about the point holds nothing cheaper.
double LeastCost(const Problem& p, int lane) {
  double norms[2] = {0.0, 0.0};
  for (int d = 0; d < p.sum.dims + p.exponent.dims; ++d) {
    const double x = static_cast<double>(p.origin[static_cast<size_t>(d)]) +
                     static_cast<double>(p.table[static_cast<size_t>(d * kLanes + lane)]);
    norms[d >= p.sum.dims] += x * x;
  }
  const auto least = [](const SquaresTerm& term, double squared) {
    const double left = std::max(0.0, std::sqrt(squared) - static_cast<double>(term.radius));
    return static_cast<double>(term.constant) + left * left;
  };
  return least(p.sum, norms[0]) + std::exp(std::min(80.0, least(p.exponent, norms[1])));
}

// A part whose norm is wholly rounding is covered by its radius in use; here it is kept away from.
TEST(PackKernels, BoundFromBelowAndClosely) {
  int close = 0, all = 0;
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const Problem p = MakeProblem(seed);
    const auto bounds = Bounds(BestKernels(), p, ~0U);
    for (int lane = 0; lane < kLanes; ++lane, ++all) {
      const double bound = static_cast<double>(bounds[static_cast<size_t>(lane)]);
      const double cost = LeastCost(p, lane);
      ASSERT_LE(bound, cost * (1 + 1e-6) + 1e-6) << "seed " << seed << " lane " << lane;
      close += bound >= cost * 0.99 - 1e-6;
    }
  }
  EXPECT_GT(close, all * 9 / 10);
}

TEST(PackKernels, TellInsideFromOutside) {
  for (uint64_t seed = 0; seed < 500; ++seed) {
    const Problem p = MakeProblem(seed);
    const float limit = 3.0F * p.table[5] * p.table[5];
    const uint32_t bits = BestKernels().inside(p.table.data(), p.origin.data(), ~0U, limit);
    for (size_t lane = 0; lane < kLanes; ++lane) {
      double squared = 0.0;
      for (size_t d = 0; d < 3; ++d) {
        const double x =
            static_cast<double>(p.origin[d]) + static_cast<double>(p.table[d * kLanes + lane]);
        squared += x * x;
      }
      if (std::abs(squared - static_cast<double>(limit)) < 1e-5 * (squared + 1e-9)) continue;
      EXPECT_EQ(bits >> lane & 1U, squared < static_cast<double>(limit) ? 1U : 0U);
    }
  }
}

}  // namespace
}  // namespace chase::prediction
