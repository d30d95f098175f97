#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "common/world/separation.h"
#include "test/unit/separation_model.h"

namespace chase::world {
namespace {

// ---- the prover, against distances by nearest points ----

struct Tally {
  int pairs = 0, kept = 0, touching = 0, undecided = 0, intervals = 0, most = 0;
  int false_kept = 0, false_touching = 0, missed = 0;
  std::array<int, 3> kept_of_kind = {0, 0, 0};
};

/// Grows the balls of a pair until the gap is at most 2 cm, above or below zero.
double Tighten(Random* random, double gap, SeparationPair* pair) {
  const double wanted = random->Uniform(-0.02, 0.02);
  if (gap <= wanted) return gap;
  pair->drone.radius[0] += gap - wanted;
  pair->target.radius[0] += gap - wanted;
  return wanted;
}

Tally ProveRandomPairs(uint64_t seed, int n) {
  Tally t;
  for (int i = 0; i < n; ++i) {
    Random random(seed, static_cast<uint64_t>(i));
    SeparationPair pair = RandomPair(&random);
    double gap = LeastGap(pair);
    if (i % 3 == 0) gap = Tighten(&random, gap, &pair);
    const SeparationResult result = Separate(pair.drone, pair.second(), pair.body);
    const bool kept = result.kept == Kept::kOff, touches = result.kept == Kept::kTouches;
    const int intervals = static_cast<int>(result.certificate.size());
    ++t.pairs;
    t.kept += kept;
    t.touching += touches;
    t.undecided += !kept && !touches;
    t.intervals += intervals;
    t.most = std::max(t.most, intervals);
    t.kept_of_kind[static_cast<size_t>(pair.body.kind)] += kept;
    t.false_kept += kept && gap < -1e-7;
    t.false_touching += touches && GapAt(pair, result.tau) > 1e-7;
    for (const double tau : {0.0, random.Uniform(0.0, 1.0), 1.0}) {
      const double now = GapAt(pair, tau);
      t.false_touching +=
          Touch(pair.drone, pair.second(), pair.body, tau) ? now > 1e-7 : now < -1e-7;
    }
    t.missed += !kept && gap > 0.005;
    if ((kept && gap < -1e-7) || (!kept && gap > 0.005))
      ADD_FAILURE() << "seed " << seed << " pair " << i << " gap " << gap << " kept " << kept;
  }
  return t;
}

void Expect(const Tally& t) {
  EXPECT_EQ(t.false_kept, 0);
  EXPECT_EQ(t.false_touching, 0);
  EXPECT_EQ(t.missed, 0);
  EXPECT_LE(t.intervals, 3.5 * t.kept);
  for (int kept : t.kept_of_kind) EXPECT_GT(kept, t.pairs / 20);
  EXPECT_GT(t.touching, t.pairs / 5);
  std::printf(
      "%d pairs: %d kept off (%d ellipsoids, %d boxes, %d cylinders), %d touching, %d "
      "undecided; %.2f intervals a proof, %d at most\n",
      t.pairs, t.kept, t.kept_of_kind[0], t.kept_of_kind[1], t.kept_of_kind[2], t.touching,
      t.undecided, static_cast<double>(t.intervals) / t.kept, t.most);
}

TEST(Separation, KeepsOffWhatStaysClearAndNothingThatComesCloser) {
  Expect(ProveRandomPairs(1, 3000));
}

/// Asked of many bodies in a row, of other degrees, radii and uncertainties, the balls get the
/// answers that they get for each alone.
TEST(Separation, ManyBodiesGetTheAnswersOfOne) {
  int kept = 0;
  for (uint64_t seed = 0; seed < 100; ++seed) {
    Random random(seed, 21);
    SeparationPair pair = RandomPair(&random);
    Separator many(pair.drone, pair.second());
    for (int i = 0; i < 20; ++i) {
      Body body = RandomPair(&random).body;
      if (i % 5 == 1) body.center.conservativeResizeLike(Curve::Zero(10, 3));
      if (i % 3 == 0) pair.drone.radius *= random.Uniform(0.5, 1.4);
      many.TakeRadii();
      const SeparationResult a = many.From(body), b = Separate(pair.drone, pair.second(), body);
      ASSERT_EQ(a.kept, b.kept) << seed << " " << i;
      ASSERT_EQ(a.certificate.size(), b.certificate.size());
      for (size_t k = 0; k < a.certificate.size(); ++k)
        EXPECT_EQ(a.certificate[k].normal, b.certificate[k].normal);
      if (a.kept != Kept::kOff) continue;
      ++kept;
      EXPECT_TRUE(Certifies(a.certificate, pair.drone, pair.second(), body));
      // What holds for both holds for the drone's ball, with what is left of it as its radius.
      Ball drone = pair.drone;
      drone.radius[0] += a.room.drone - 1e-9;
      EXPECT_TRUE(Certifies(a.certificate, drone, nullptr, body));
    }
  }
  EXPECT_GT(kept, 500);
}

/// What a plane proves of a ball over one interval says nothing of the other ball over another.
TEST(Separation, NothingIsProvenOfBallsOverTwoIntervals) {
  const Ball ball{Eigen::RowVector3d(0.0, 0.0, 9.0), math::Polynomial::Constant(1, 0.5)};
  Body body;
  body.center = Eigen::RowVector3d::Zero();
  body.half.setOnes();
  body.kind = Body::Kind::kCylinder;
  const Sweep early(ball, 0.0, 0.5, 0), late(ball, 0.5, 1.0, 0);
  EXPECT_GT(ProvenRooms(Eigen::Vector3d::UnitZ(), early, &early, body).Least(), 7.0);
  EXPECT_LT(ProvenRooms(Eigen::Vector3d::UnitZ(), early, &late, body).Least(), -1e300);
}

/// --gtest_also_run_disabled_tests --gtest_filter=*HundredThousand*: about ten minutes.
TEST(Separation, DISABLED_HundredThousandPairs) { Expect(ProveRandomPairs(2, 100000)); }

}  // namespace
}  // namespace chase::world
