#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "services/perception/place/fit_problem.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
constexpr double kStep = 1e-6;

/// A cylinder seen by the camera and the lidar with noise, some samples far off.
class Scene {
 public:
  explicit Scene(unsigned seed, const char* lens = "pinhole") : random_(seed) {
    const Vector3d target(3.0 + Uniform(), Uniform(), 0.55);
    const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.15 * Uniform(), Vector3d::UnitY()));
    PoseSample pose;
    pose.p_WB = {0.0, 0.0, 1.0 + 0.6 * Uniform()};
    pose.R_WB = tilt;
    world::Rig rig;
    rig.lens = lens;
    if (rig.lens == "fisheye") rig.lens_coefficients << 0.1, -0.02, 0.0, 0.0, 0.0;
    input.camera = CameraAt(pose, rig);
    Outline(target);
    for (int i = 0; i < 24; ++i) Hit(target, pose.p_WB);
    input.prior.mean << target + 0.1 * Vector3d(Uniform(), Uniform(), Uniform()),
        0.5 * Vector3d(Uniform(), Uniform(), Uniform());
    Matrix6d root = 0.3 * Matrix6d::Identity();
    for (int i = 0; i < 36; ++i) root.data()[i] += 0.05 * Uniform();
    input.prior.covariance = root * root.transpose();
    input.detection = &outline;
  }

  double Uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  Vector7d Near() {
    Vector7d y;
    y << input.prior.mean, input.shape.yaw;
    for (int i = 0; i < 7; ++i) y[i] += 0.1 * Uniform();
    return y;
  }

  FitInput input;
  Detection outline;

 private:
  void Outline(const Vector3d& target) {
    outline.box = *ProjectTarget(input.camera, target, {});
    const auto& b = outline.box;
    for (int i = 0; i < 8; ++i) {
      const double along = 0.3 + 0.05 * i, off = 0.4 * Uniform() + (i == 3 ? 6.0 : 0.0);
      auto& samples = outline.silhouette.samples;
      samples[kLeft].emplace_back(b.x + off, b.y + along * b.height);
      samples[kRight].emplace_back(b.x + b.width + off, b.y + along * b.height);
      samples[kTop].emplace_back(b.x + along * b.width, b.y + off);
      samples[kBottom].emplace_back(b.x + along * b.width, b.y + b.height + off);
    }
  }
  void Hit(const Vector3d& target, const Vector3d& p_WL) {
    const double toward = std::atan2(p_WL.y() - target.y(), p_WL.x() - target.x());
    const double a = toward + Uniform(), r = 0.15 + 0.03 * Uniform();
    const Vector3d p = target + Vector3d(r * std::cos(a), r * std::sin(a), 0.27 * Uniform());
    input.points.push_back({p, p_WL, 0.1 * Uniform(), (p - p_WL).norm()});
  }
  std::mt19937 random_;
};

template <class Function>
Vector7d Differences(const Function& f, const Vector7d& y) {
  Vector7d out;
  for (int i = 0; i < 7; ++i) {
    const Vector7d step = kStep * Vector7d::Unit(i);
    out[i] = (f(Vector7d(y + step)) - f(Vector7d(y - step))) / (2.0 * kStep);
  }
  return out;
}

/// `residual` of y as numbers and as jets.
template <class Function>
void ExpectGradient(const Function& residual, const Vector7d& y) {
  const Vector7d gradient = residual(Jets(y)).v;
  EXPECT_LT((gradient - Differences(residual, y)).norm(), 1e-5 * (1.0 + gradient.norm()))
      << gradient.transpose() << "\n"
      << Differences(residual, y).transpose();
}

TEST(PerceptionSolver, GradientsOfTheResidualsAreTheirDifferences) {
  Scene scene(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector7d y = scene.Near();
    const double angle = 0.1 * scene.Uniform(), sign = i % 2 ? 1.0 : -1.0;
    const PlanRay ray{{0.0, 0.0, y[2] + scene.Uniform()},
                      {std::cos(angle), std::sin(angle)},
                      0.5 * scene.Uniform()};
    const Vector3d off(0.3 * scene.Uniform(), 0.3 * scene.Uniform(), 0.4 * scene.Uniform());
    const double age = 0.2 * scene.Uniform(), half = 0.15 + 0.02 * scene.Uniform();
    const Vector3d p_W = y.head<3>() + off;
    for (const bool square : {false, true}) {
      const Solid solid{square, half, 0.5 + 0.02 * scene.Uniform()};
      Vector7d turned = y;
      turned[kYawAt] = 3.0 * scene.Uniform();
      ExpectGradient([&](const auto& at) { return SideResidual(ray, solid, sign, at); }, turned);
      ExpectGradient([&](const auto& at) { return CapResidual(ray, solid, sign, at); }, turned);
      ExpectGradient([&](const auto& at) { return PointResidual(p_W, age, solid, at); }, turned);
    }
    const Solid ball{false, half, 2.0 * half};
    ExpectGradient([&](const auto& at) { return TangentResidual(ray, ball, i % 4 < 2, sign, at); },
                   y);
    ExpectGradient([&](const auto& at) { return SpherePointResidual(p_W, age, ball, at); }, y);
  }
}

using Hits = std::function<bool(const Vector3d& ray)>;

/// The outline of what lines of sight from the camera hit, as in a dense image; within the target's
/// expected box.
void OutlineOf(const Hits& hits, const Vector3d& center, Scene* scene) {
  const Camera& camera = scene->input.camera;
  const auto edge = [&](double u, double v, double du, double dv) {
    double in = 0.0, out = 200.0;
    for (int i = 0; i < 60; ++i) {
      const double at = 0.5 * (in + out);
      (hits(camera.Ray(u + at * du, v + at * dv)) ? in : out) = at;
    }
    return Eigen::Vector2d(u + in * du, v + in * dv);
  };
  const Eigen::Vector2d middle = *camera.Project(center);
  const auto box = *ProjectTarget(camera, center, scene->input.shape);
  scene->outline.box = box;
  for (auto& samples : scene->outline.silhouette.samples) samples.clear();
  for (int i = -3; i <= 3; ++i) {
    const double v = middle.y() + 0.08 * i * box.height, u = middle.x() + 0.08 * i * box.width;
    auto& samples = scene->outline.silhouette.samples;
    samples[kLeft].push_back(edge(middle.x(), v, -1, 0));
    samples[kRight].push_back(edge(middle.x(), v, 1, 0));
    samples[kTop].push_back(edge(u, middle.y(), 0, -1));
    samples[kBottom].push_back(edge(u, middle.y(), 0, 1));
    for (const size_t side : {kLeft, kRight, kTop, kBottom}) {
      const auto& px = samples[side].back();
      const double slack = 0.02 * box.width;  // its rim is a polygon of 16 sides
      EXPECT_GT(px.x(), box.x - slack);
      EXPECT_LT(px.x(), box.x + box.width + slack);
      EXPECT_GT(px.y(), box.y - slack);
      EXPECT_LT(px.y(), box.y + box.height + slack);
    }
  }
}

TEST(PerceptionSolver, ASphereIsPlacedByItsOutline) {
  constexpr double kRadius = 0.2;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Scene scene(seed);
    const Vector3d center = scene.input.prior.position();
    scene.input.shape = {TargetShape::Kind::kSphere, {kRadius, 2.0 * kRadius}};
    scene.input.points.clear();
    const Vector3d to = center - scene.input.camera.p_WC;
    OutlineOf(
        [&](const Vector3d& sight) {
          const Vector3d ray = sight.normalized();
          return (to - to.dot(ray) * ray).norm() < kRadius;
        },
        center, &scene);
    scene.input.prior.mean.head<3>() += Vector3d(0.2, 0.1, -0.1);
    scene.input.prior.covariance = 10.0 * Matrix6d::Identity();
    EXPECT_LT((FitTarget(scene.input, {}).posterior.position() - center).norm(), 2e-3);
    scene.input.shape.kind = TargetShape::Kind::kCylinder;
    EXPECT_GT((FitTarget(scene.input, {}).posterior.position() - center).norm(), 0.1);
  }
}

/// An upright box on a square, turned.
struct TurnedBox {
  Vector3d center, half;
  double yaw;

  Vector3d Turned(const Vector3d& v) const {
    return Eigen::AngleAxisd(-yaw, Vector3d::UnitZ()) * v;
  }
  /// Distance along the ray from p to it, in rays; negative where it misses.
  double Hit(const Vector3d& p, const Vector3d& ray) const {
    const Vector3d from = Turned(p - center), d = Turned(ray);
    const Eigen::Array3d a = (-half - from).cwiseQuotient(d), b = (half - from).cwiseQuotient(d);
    const double in = a.min(b).maxCoeff(), out = a.max(b).minCoeff();
    return in < out ? in : -1.0;
  }
};

// Whichever way it is turned, of which nothing is known: by its outline and what LiDAR hits of it.
TEST(PerceptionSolver, ABoxIsPlacedHoweverItIsTurned) {
  constexpr double kHalf = 0.2, kTall = 0.6;
  double worst = 0.0, worst_round = 0.0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Scene scene(seed);
    const TurnedBox box{
        scene.input.prior.position(), {kHalf, kHalf, 0.5 * kTall}, M_PI * scene.Uniform()};
    const Vector3d p_WC = scene.input.camera.p_WC;
    scene.input.shape = {TargetShape::Kind::kBox, {kHalf, kTall}};
    scene.input.shape.yaw = box.yaw;  // for the expected box alone
    OutlineOf([&](const Vector3d& ray) { return box.Hit(p_WC, ray) > 0.0; }, box.center, &scene);
    scene.input.shape.yaw = M_PI * scene.Uniform();
    scene.input.points.clear();
    for (int i = -40; i <= 40; ++i)
      for (const double up : {-0.1, 0.1}) {
        const Vector3d aim = box.center + Vector3d(0.0, 0.01 * i, up) - p_WC;
        const double t = box.Hit(p_WC, aim);
        const Vector3d p = p_WC + t * aim;
        if (t > 0.0) scene.input.points.push_back({p, p_WC, 0.0, (p - p_WC).norm()});
      }
    scene.input.prior.mean.head<3>() += Vector3d(0.1, 0.1, -0.1);
    scene.input.prior.covariance = 10.0 * Matrix6d::Identity();
    const auto fit = FitTarget(scene.input, {});
    ASSERT_TRUE(fit.ok) << "seed " << seed;
    worst = std::max(worst, (fit.posterior.position() - box.center).norm());
    const double turn = fit.shape.yaw - box.yaw;
    EXPECT_LT(std::abs(std::remainder(turn, 0.5 * M_PI)), 0.02) << "seed " << seed;
    scene.input.shape.kind = TargetShape::Kind::kCylinder;
    scene.input.shape.size[0] = scene.input.shape.MeanHalfWidth() * 4.0 / M_PI;
    const Vector3d round = FitTarget(scene.input, {}).posterior.position() - box.center;
    worst_round = std::max(worst_round, round.head<2>().norm());
  }
  EXPECT_LT(worst, 0.01);
  EXPECT_GT(worst_round, 0.04);
}

TEST(PerceptionSolver, GradientOfTheProblemIsItsDifference) {
  const FitConfig config;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Scene scene(seed);
    if (seed % 2) {
      scene.outline.p_CT = Vector3d(0.1, 0.2, 3.0 + scene.Uniform());
      scene.outline.p_CT_covariance = 0.01 * Eigen::Matrix3d::Identity();
    }
    if (seed % 3 == 0) scene.input.shape.kind = TargetShape::Kind::kBox;
    const FitProblem problem(scene.input, config);
    ASSERT_TRUE(problem.ok());
    const Vector7d y = scene.Near();
    const auto n = static_cast<size_t>(problem.NumResiduals());
    const auto cost = [&](const Vector7d& at) {
      std::vector<double> r(n);
      problem(at.data(), r.data());
      return 0.5 * std::inner_product(r.begin(), r.end(), r.begin(), 0.0);
    };
    std::vector<Jet> r(n);
    problem(Jets(y).data(), r.data());
    Vector7d gradient = Vector7d::Zero();
    for (const Jet& sample : r) gradient += sample.a * sample.v;
    const Vector7d d = Differences(cost, y);
    EXPECT_LT((gradient - d).norm(), 1e-5 * (1.0 + d.norm())) << "seed " << seed;
  }
}

struct OverY {
  std::function<double(const Vector7d& y)> residual;
  double scale;
  bool operator()(const double* y, double* r) const {
    *r = scale * residual(Eigen::Map<const Vector7d>(y));
    return true;
  }
};

/// The same problem as Ceres' own: a block a sample, differences for derivatives, Ceres' losses.
class Reference {
 public:
  Reference(const Scene& scene, const FitConfig& config)
      : input_(scene.input),
        solid_{input_.shape.box(), input_.shape.size[0], input_.shape.size[1]} {
    y << input_.prior.mean, input_.shape.yaw;
    AddPrior();
    for (size_t side = 0; side < 4; ++side)
      for (const auto& px : scene.outline.silhouette.samples[side]) AddEdge(side, px);
    for (const auto& p : input_.points)
      Add([&](const Vector7d& at) { return PointResidual(p.p_W, p.age, solid_, at); },
          1.0 / config.lidar_sigma, kLidarWeight, input_.points.size());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solve(options, &problem_, &summary_);
  }
  double cost() const { return summary_.final_cost; }
  Matrix7d Covariance() {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance covariance(options);
    const std::vector<const double*> blocks = {y.data()};
    Matrix7d C = Matrix7d::Zero();
    if (covariance.Compute(blocks, &problem_))
      covariance.GetCovarianceBlock(y.data(), y.data(), C.data());
    return C;
  }
  Vector7d y;

 private:
  struct Prior {
    Vector7d mean;
    Matrix7d root;
    bool operator()(const double* y, double* r) const {
      Eigen::Map<Vector7d>{r} = root * (Eigen::Map<const Vector7d>(y) - mean);
      return true;
    }
  };
  void AddPrior() {
    Matrix7d covariance = Matrix7d::Zero();
    covariance.topLeftCorner<6, 6>() = input_.prior.covariance;
    covariance(kYawAt, kYawAt) = input_.shape.yaw_variance;
    const Matrix7d root = Eigen::LLT<Matrix7d>(covariance).matrixL().solve(Matrix7d::Identity());
    problem_.AddResidualBlock(
        new ceres::NumericDiffCostFunction<Prior, ceres::CENTRAL, 7, 7>(new Prior{y, root}),
        nullptr, y.data());
  }
  void Add(const std::function<double(const Vector7d& y)>& residual, double scale, double weight,
           size_t samples) {
    const double share = std::min(1.0, weight / static_cast<double>(samples));
    problem_.AddResidualBlock(
        new ceres::NumericDiffCostFunction<OverY, ceres::CENTRAL, 1, 7>(new OverY{residual, scale}),
        new ceres::ScaledLoss(new ceres::CauchyLoss(2.0), share, ceres::TAKE_OWNERSHIP), y.data());
  }
  PlanRay Ray(const Eigen::Vector2d& px) const {
    const Vector3d ray = input_.camera.Ray(px.x(), px.y());
    const double length = ray.head<2>().norm();
    return {input_.camera.p_WC, ray.head<2>() / length, ray.z() / length};
  }
  void AddEdge(size_t side, const Eigen::Vector2d& px) {
    const double range = (input_.prior.position() - input_.camera.p_WC).head<2>().norm();
    const double scale = 1.0 / (input_.detection->silhouette.sigma_px * range);
    const bool upright = side == kLeft || side == kRight;
    const Eigen::Vector2d half = upright ? Eigen::Vector2d(0.5, 0) : Eigen::Vector2d(0, 0.5);
    const PlanRay a = Ray(px - half), b = Ray(px + half);
    const double sign = side == kRight || side == kTop ? 1.0 : -1.0;
    const double turn =
        std::asin(a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x());
    const double span = upright ? turn : b.slope - a.slope;
    Add(
        [this, sign, upright, ray = Ray(px)](const Vector7d& at) {
          return upright ? SideResidual(ray, solid_, sign, at) : CapResidual(ray, solid_, sign, at);
        },
        scale / std::abs(span), kEdgeWeight, 8);
  }

  const FitInput& input_;
  const Solid solid_;
  ceres::Problem problem_;
  ceres::Solver::Summary summary_;
};

void ExpectSame(const FitResult& fit, Reference* reference) {
  ASSERT_TRUE(fit.ok);
  const Matrix7d C = reference->Covariance();
  Vector7d off = -reference->y;
  off.head<6>() += fit.posterior.mean;
  off[kYawAt] += fit.shape.yaw;
  EXPECT_NEAR(fit.cost, reference->cost(), 1e-4 * reference->cost());
  EXPECT_LT(std::sqrt(off.dot(C.ldlt().solve(off))), 0.05) << "standard deviations";
  EXPECT_LT((fit.posterior.covariance - C.topLeftCorner<6, 6>()).norm(), 0.01 * C.norm());
  EXPECT_NEAR(fit.shape.yaw_variance, C(kYawAt, kYawAt), 0.01 * C(kYawAt, kYawAt));
}

TEST(PerceptionSolver, FindsWhatCeresFindsBlockByBlock) {
  const FitConfig config;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Scene scene(seed, seed % 2 ? "pinhole" : "fisheye");
    Reference reference(scene, config);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    ExpectSame(FitTarget(scene.input, config, {400, 1e-9}), &reference);
  }
}

TEST(PerceptionSolver, AProblemWithoutARootIsRefused) {
  Scene scene(1);
  scene.input.prior.covariance.setZero();
  EXPECT_FALSE(FitTarget(scene.input, {}).ok);
  scene.input.prior.covariance.setConstant(std::nan(""));
  EXPECT_FALSE(FitTarget(scene.input, {}).ok);
  Scene wild(1);
  wild.input.points.front().p_W.x() = std::nan("");
  EXPECT_FALSE(FitTarget(wild.input, {}).ok);
}

}  // namespace
}  // namespace chase::perception
