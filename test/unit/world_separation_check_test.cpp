#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/world/separation.h"
#include "test/unit/separation_pairs.h"

namespace chase::world {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

bool Holds(const Certificate& c, const SeparationPair& pair) {
  return Certifies(c, pair.drone, pair.second(), pair.body);
}
bool HoldsExactly(const Certificate& c, const SeparationPair& pair) {
  return CertifiesExactly(c, pair.drone, pair.second(), pair.body);
}

struct Proven {
  SeparationPair pair;
  Certificate certificate;
};

/// Random pairs that are kept off; the normals get other lengths, which mean the same.
Proven RandomProven(Random* random) {
  for (;;) {
    const SeparationPair pair = RandomPair(random);
    SeparationResult result = Separate(pair.drone, pair.second(), pair.body);
    if (result.kept != Kept::kOff) continue;
    for (Separation& s : result.certificate) s.normal *= random->Uniform(0.75, 1.4);
    return {pair, result.certificate};
  }
}

// ---- a second formulation: corners, axes and samples in time ----

Vector3d At(const Curve& curve, double tau) {
  Vector3d x = Vector3d::Zero();
  for (Eigen::Index k = curve.rows(); k-- > 0;) x = x * tau + curve.row(k).transpose();
  return x;
}

double RootOfForm(const Matrix3d& Q, const Vector3d& n) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(Q);
  const Vector3d axes = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return axes.cwiseProduct(eigen.eigenvectors().transpose() * n).norm();
}

double FurthestAlong(const Body& body, const Vector3d& n) {
  if (body.kind == Body::Kind::kEllipsoid) return RootOfForm(body.shape, n);
  double most = -HUGE_VAL;
  for (int corner = 0; corner < 8; ++corner) {
    Vector3d x = body.half;
    for (int a = 0; a < 3; ++a)
      if (corner >> a & 1) x[a] = -x[a];
    if (body.kind == Body::Kind::kCylinder) {
      const double angle = std::atan2(n.y(), n.x());
      x.head<2>() = body.half.x() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    most = std::max(most, n.dot(body.kind == Body::Kind::kBox ? Vector3d(body.shape * x) : x));
  }
  return most;
}

double RoomAt(const SeparationPair& pair, const Separation& s, double tau) {
  const Vector3d& n = s.normal;
  const Body& b = pair.body;
  const Matrix3d S = b.covariance[0] + tau * b.covariance[1] + tau * tau * b.covariance[2];
  const double taken = FurthestAlong(b, n) + b.sigmas * RootOfForm(S, n);
  const auto room = [&](const Ball& ball) {
    return n.dot(At(ball.center, tau) - At(b.center, tau)) - taken -
           n.norm() * math::Evaluate(ball.radius, tau);
  };
  return (pair.sight ? std::min(room(pair.drone), room(pair.target)) : room(pair.drone)) / n.norm();
}

double LeastRoom(const SeparationPair& pair, const Separation& s) {
  double least = HUGE_VAL;
  for (int i = 0; i <= 200; ++i)
    least = std::min(least, RoomAt(pair, s, s.from + (s.to - s.from) * i / 200.0));
  return least;
}

TEST(SeparationCheck, ProvenRoomIsBelowTheSampledOneAndNearIt) {
  double worst = 0.0;
  for (uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed, 11);
    const Proven proven = RandomProven(&random);
    for (const Separation& s : proven.certificate) {
      const double room = ProvenRoom(s, proven.pair.drone, proven.pair.second(), proven.pair.body);
      const double sampled = LeastRoom(proven.pair, s);
      ASSERT_GE(room, 0.0) << seed;
      ASSERT_LE(room, sampled + 1e-9) << seed;
      worst = std::max(worst, RoomAt(proven.pair, {s.from, s.from, s.normal}, s.from) - room);
    }
  }
  EXPECT_LT(worst, 20.0);  // m: the room at an instant, not just anything
}

TEST(SeparationCheck, TrueCertificatesPassInBothArithmetics) {
  for (uint64_t seed = 0; seed < 1000; ++seed) {
    Random random(seed, 12);
    const Proven proven = RandomProven(&random);
    ASSERT_TRUE(Holds(proven.certificate, proven.pair)) << seed;
    if (seed % 4 == 0) {
      ASSERT_TRUE(HoldsExactly(proven.certificate, proven.pair)) << seed;
    }
  }
}

// ---- tampering ----

Separation& PickOne(Random* random, Certificate* c) { return (*c)[random->Next() % c->size()]; }

/// Bends the normal ever further until it no longer separates.
void BendNormal(Random* random, Proven* p) {
  Separation& s = PickOne(random, &p->certificate);
  const Vector3d axis = RandomVector(random, 1.0, 1.0, 1.0).normalized();
  const Vector3d n = s.normal;
  for (double angle = random->Uniform(0.0, 0.3); angle < M_PI; angle += 0.05) {
    s.normal = Eigen::AngleAxisd(angle, axis) * n;
    if (LeastRoom(p->pair, s) < -1e-6) return;
  }
}

/// One plane for what took several.
void WidenInterval(Random* random, Proven* p) {
  for (int i = 0; i < 20 && p->certificate.size() < 2; ++i) *p = RandomProven(random);
  Separation s = PickOne(random, &p->certificate);
  s.from = 0.0;
  s.to = 1.0;
  p->certificate = {s};
}

void GrowBody(Random* random, Proven* p) {
  const Separation s = PickOne(random, &p->certificate);
  Body& body = p->pair.body;
  for (int i = 0; i < 60 && LeastRoom(p->pair, s) >= -1e-6; ++i) {
    body.half *= 1.1;
    if (body.kind == Body::Kind::kEllipsoid) body.shape *= 1.21;
  }
}

/// Just too far towards the drone.
void MoveBody(Random* random, Proven* p) {
  const Separation s = PickOne(random, &p->certificate);
  const double room = LeastRoom(p->pair, s);
  p->pair.body.center.row(0) += (room + 1e-6) * s.normal.normalized().transpose();
}

void GrowRadius(Random* random, Proven* p) {
  const Separation s = PickOne(random, &p->certificate);
  const double room = std::max(0.0, LeastRoom(p->pair, s));
  p->pair.drone.radius.conservativeResize(3);
  p->pair.drone.radius[2] = 0.0;
  p->pair.drone.radius[0] += room + 1e-6;
  p->pair.target.radius[0] += room + 1e-6;
}

/// Leaves a gap in time: a piece is missing, or an end is off by one unit in the last place.
void BreakCover(Random* random, Proven* p) {
  const size_t i = random->Next() % p->certificate.size();
  Separation& s = p->certificate[i];
  switch (random->Next() % 3) {
    case 0:
      p->certificate.erase(p->certificate.begin() + static_cast<std::ptrdiff_t>(i));
      return;
    case 1:
      s.to = std::nextafter(s.to, 0.0);
      return;
    default:
      s.from = std::nextafter(s.from, 1.0);
  }
}

bool IsBroken(const Proven& p) {
  double end = 0.0;
  for (const Separation& s : p.certificate) {
    if (s.from > end || LeastRoom(p.pair, s) < -1e-9) return true;
    end = s.to;
  }
  return end < 1.0;
}

TEST(SeparationCheck, TamperedCertificatesAreRefused) {
  struct Way {
    std::string name;
    std::function<void(Random*, Proven*)> tamper;
  };
  const std::vector<Way> ways = {{"normal bent", BendNormal},  {"interval widened", WidenInterval},
                                 {"body grown", GrowBody},     {"body moved", MoveBody},
                                 {"radius grown", GrowRadius}, {"gap in time", BreakCover}};
  std::vector<int> count(ways.size(), 0);
  int total = 0;
  for (uint64_t seed = 0; total < 10000; ++seed) {
    Random random(seed, 13);
    const Proven proven = RandomProven(&random);
    for (size_t w = 0; w < ways.size(); ++w) {
      Proven tampered = proven;
      ways[w].tamper(&random, &tampered);
      if (!IsBroken(tampered)) continue;
      ++count[w];
      ++total;
      ASSERT_FALSE(Holds(tampered.certificate, tampered.pair)) << ways[w].name << " " << seed;
      if (seed % 16 == 0) {
        ASSERT_FALSE(HoldsExactly(tampered.certificate, tampered.pair))
            << ways[w].name << " " << seed;
      }
    }
  }
  for (size_t w = 0; w < ways.size(); ++w) EXPECT_GT(count[w], 200) << ways[w].name;
}

/// The body moved along the normal until the last place that floating point accepts: the integers
/// accept it, too, and go on for no more than the bound on rounding.
TEST(SeparationCheck, AcceptsNothingThatExactArithmeticRefuses) {
  int further = 0;
  for (uint64_t seed = 0; seed < 400; ++seed) {
    Random random(seed, 14);
    Proven p = RandomProven(&random);
    const Separation s = PickOne(&random, &p.certificate);
    const Curve center = p.pair.body.center;
    const auto move = [&](double by) {
      p.pair.body.center.row(0) = center.row(0) + by * s.normal.normalized().transpose();
    };
    const auto exact = [&] {
      return IsCertificateExact({s}, s.from, s.to, p.pair.drone, p.pair.second(), p.pair.body);
    };
    double low = 0.0, high = 100.0;
    for (int i = 0; i < 60; ++i) {
      const double by = 0.5 * (low + high);
      move(by);
      const bool holds = ProvenRoom(s, p.pair.drone, p.pair.second(), p.pair.body) >= 0.0;
      (holds ? low : high) = by;
    }
    move(low);
    ASSERT_TRUE(exact()) << seed;
    move(high);
    further += exact();
    move(high + 1e-10);
    ASSERT_FALSE(exact()) << seed;
  }
  EXPECT_GT(further, 300) << "the bound on rounding was not tried";
}

// ---- the list itself ----

TEST(Certificate, KeepsItsOrderWhileItGrowsAndShrinks) {
  const auto nth = [](int i) { return Separation{0.1 * i, 0.1 * (i + 1), Vector3d::UnitY()}; };
  Certificate c;
  for (int n = 0; n < 5; ++n) {
    EXPECT_EQ(c.empty(), n == 0);
    c.push_back(nth(n));
    ASSERT_EQ(c.size(), static_cast<size_t>(n + 1));
    for (int i = 0; i <= n; ++i) EXPECT_EQ(c[static_cast<size_t>(i)].from, 0.1 * i) << n;
    EXPECT_EQ(c.front().from, 0.0);
    EXPECT_EQ(c.back().from, 0.1 * n);
  }
  for (const int left : {1, 2, 3, 4}) {  // the first goes, again and again
    c.erase(c.begin());
    const Certificate copy = c;
    ASSERT_EQ(copy.size(), static_cast<size_t>(5 - left));
    for (int i = left; i < 5; ++i) EXPECT_EQ(copy[static_cast<size_t>(i - left)].from, 0.1 * i);
  }
  c.clear();
  EXPECT_EQ(c.begin(), c.end());
}

// ---- input that is none ----

Proven StandingWall() {
  Proven p;
  p.pair.drone.center = Vector3d(0.0, 0.0, 1.0).transpose();
  p.pair.drone.radius = math::Polynomial::Constant(1, 0.4);
  p.pair.body.kind = Body::Kind::kBox;
  p.pair.body.half = {1.25, 0.05, 1.0};
  p.pair.body.center = Vector3d(0.0, 1.0, 1.0).transpose();
  p.certificate = {{0.0, 1.0, -Vector3d::UnitY()}};
  return p;
}

TEST(SeparationCheck, RoomOfAStandingWallIsItsDistance) {
  const Proven p = StandingWall();
  EXPECT_NEAR(ProvenRoom(p.certificate[0], p.pair.drone, nullptr, p.pair.body), 0.55, 1e-12);
}

TEST(SeparationCheck, WhatIsNoInputProvesNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(Proven*)>> ways = {
      [](Proven* p) { p->certificate.clear(); },
      [](Proven* p) { p->certificate[0].normal.setZero(); },
      [](Proven* p) { p->certificate[0].normal *= 3.0; },
      [](Proven* p) { p->certificate[0].from = -0.1; },
      [](Proven* p) { p->certificate[0].to = 1.1; },
      [=](Proven* p) { p->certificate[0].to = nan; },
      [=](Proven* p) { p->certificate[0].normal.x() = nan; },
      [=](Proven* p) { p->pair.drone.center(0, 1) = nan; },
      [=](Proven* p) { p->pair.drone.center(0, 1) = -HUGE_VAL; },
      [=](Proven* p) { p->pair.drone.radius[0] = nan; },
      [=](Proven* p) { p->pair.body.center(0, 0) = nan; },
      [=](Proven* p) { p->pair.body.shape(0, 1) = nan; },
      [](Proven* p) { p->pair.body.half.x() = -1.0; },
      [=](Proven* p) { p->pair.body.sigmas = nan; },
      [](Proven* p) { p->pair.body.sigmas = -1.0; },
      [](Proven* p) { p->pair.drone.radius = math::Polynomial::Zero(17); },
  };
  for (size_t w = 0; w < ways.size(); ++w) {
    Proven p = StandingWall();
    ASSERT_TRUE(Holds(p.certificate, p.pair) && HoldsExactly(p.certificate, p.pair));
    ways[w](&p);
    EXPECT_FALSE(Holds(p.certificate, p.pair)) << w;
    if (w + 1 < ways.size()) {
      EXPECT_FALSE(HoldsExactly(p.certificate, p.pair)) << w;
    }
    const SeparationResult result = Separate(p.pair.drone, nullptr, p.pair.body);
    EXPECT_TRUE(result.kept == Kept::kOff ? Holds(result.certificate, p.pair) : true) << w;
  }
}

}  // namespace
}  // namespace chase::world
