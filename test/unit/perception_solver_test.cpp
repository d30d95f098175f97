#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "services/perception/cylinder_problem.h"
#include "services/perception/quick_fit.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
constexpr double kStep = 1e-6;

/// A cylinder seen by the camera and the lidar with noise, some samples far off.
class Scene {
 public:
  explicit Scene(unsigned seed) : random_(seed) {
    const Vector3d target(3.0 + Uniform(), Uniform(), 0.55);
    const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.15 * Uniform(), Vector3d::UnitY()));
    PoseSample pose;
    pose.p_WB = {0.0, 0.0, 1.0 + 0.6 * Uniform()};
    pose.R_WB = tilt;
    input.camera = CameraAt(pose, {});
    input.shape.variance = {9e-4, 9e-4};
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
  Vector8d Near() {
    Vector8d y;
    y << input.prior.mean, input.shape.size;
    for (int i = 0; i < 8; ++i) y[i] += (i < 6 ? 0.1 : 0.02) * Uniform();
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
Vector8d Differences(const Function& f, const Vector8d& y) {
  Vector8d out;
  for (int i = 0; i < 8; ++i) {
    const Vector8d step = kStep * Vector8d::Unit(i);
    out[i] = (f(y + step) - f(y - step)) / (2.0 * kStep);
  }
  return out;
}

template <class Residual>
void ExpectGradient(const Residual& residual, const Vector8d& y) {
  Vector8d gradient;
  EXPECT_EQ(residual(y, &gradient), residual(y, nullptr));
  const auto f = [&](const Vector8d& at) { return residual(at, nullptr); };
  EXPECT_LT((gradient - Differences(f, y)).norm(), 1e-5 * (1.0 + gradient.norm()))
      << gradient.transpose() << "\n"
      << Differences(f, y).transpose();
}

TEST(PerceptionSolver, GradientsOfTheResidualsAreTheirDifferences) {
  Scene scene(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector8d y = scene.Near();
    const double angle = 0.1 * scene.Uniform(), sign = i % 2 ? 1.0 : -1.0;
    const PlanRay ray{{0.0, 0.0, y[2] + scene.Uniform()},
                      {std::cos(angle), std::sin(angle)},
                      0.5 * scene.Uniform()};
    ExpectGradient(SideResidual{ray, sign, 7.0}, y);
    ExpectGradient(CapResidual{ray, sign, 7.0}, y);
    const Vector3d off(0.3 * scene.Uniform(), 0.3 * scene.Uniform(), 0.4 * scene.Uniform());
    ExpectGradient(PointResidual{y.head<3>() + off, 0.2 * scene.Uniform(), 40.0}, y);
    ExpectGradient(TangentResidual{ray, i % 4 < 2, sign, 7.0}, y);
    ExpectGradient(SpherePointResidual{y.head<3>() + off, 0.2 * scene.Uniform(), 40.0}, y);
  }
}

// Where lines of sight touch a sphere: the edge of what is hit in a dense image of it.
TEST(PerceptionSolver, ASphereIsPlacedByItsOutline) {
  constexpr double kRadius = 0.2;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Scene scene(seed);
    const Vector3d center = scene.input.prior.position();
    scene.input.shape = {true, {kRadius, 2.0 * kRadius}, Eigen::Vector2d::Zero()};
    scene.input.points.clear();
    const Camera& camera = scene.input.camera;
    const auto hits = [&](double u, double v) {
      const Vector3d ray = camera.Ray(u, v).normalized(), to = center - camera.p_WC;
      return (to - to.dot(ray) * ray).norm() < kRadius;
    };
    const auto edge = [&](double u, double v, double du, double dv) {
      double in = 0.0, out = 200.0;
      for (int i = 0; i < 60; ++i)
        (hits(u + 0.5 * (in + out) * du, v + 0.5 * (in + out) * dv) ? in : out) = 0.5 * (in + out);
      return Eigen::Vector2d(u + in * du, v + in * dv);
    };
    const Eigen::Vector2d middle = *camera.Project(center);
    const auto box = *ProjectTarget(camera, center, scene.input.shape);
    scene.outline.box = box;
    for (auto& samples : scene.outline.silhouette.samples) samples.clear();
    for (int i = -3; i <= 3; ++i) {
      const double v = middle.y() + 0.08 * i * box.height, u = middle.x() + 0.08 * i * box.width;
      auto& samples = scene.outline.silhouette.samples;
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
    scene.input.prior.mean.head<3>() += Vector3d(0.2, 0.1, -0.1);
    scene.input.prior.covariance = 10.0 * Matrix6d::Identity();
    EXPECT_LT((FitCylinder(scene.input, {}).posterior.position() - center).norm(), 2e-3);
    scene.input.shape.sphere = false;
    EXPECT_GT((FitCylinder(scene.input, {}).posterior.position() - center).norm(), 0.1);
  }
}

TEST(PerceptionSolver, GradientOfTheProblemIsItsDifference) {
  FitConfig config;
  config.estimate_shape = true;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Scene scene(seed);
    if (seed % 2) {
      scene.outline.p_CT = Vector3d(0.1, 0.2, 3.0 + scene.Uniform());
      scene.outline.p_CT_covariance = 0.01 * Eigen::Matrix3d::Identity();
    }
    const CylinderProblem problem(scene.input, config);
    ASSERT_TRUE(problem.ok());
    const Vector8d y = scene.Near();
    const auto normal = problem.Linearised<8>(y);
    EXPECT_NEAR(normal.cost, problem.Cost(y), 1e-9 * normal.cost) << "seed " << seed;
    const Vector8d d = Differences([&](const Vector8d& at) { return problem.Cost(at); }, y);
    EXPECT_LT((normal.gradient - d).norm(), 1e-5 * (1.0 + d.norm())) << "seed " << seed;
    const auto six = problem.Linearised<6>(y);
    EXPECT_LT((six.gradient - normal.gradient.head<6>()).norm(), 1e-9 * (1.0 + d.norm()));
    EXPECT_LT((six.information - normal.information.topLeftCorner<6, 6>()).norm(),
              1e-9 * normal.information.norm());
  }
}

template <class Residual>
struct OverY {
  Residual residual;
  bool operator()(const double* y, double* r) const {
    *r = residual(Eigen::Map<const Vector8d>(y), nullptr);
    return true;
  }
};

/// The same problem as Ceres' own: a block a sample, differences for derivatives, Ceres' losses.
class Reference {
 public:
  Reference(const Scene& scene, const FitConfig& config) : input_(scene.input), config_(config) {
    y << input_.prior.mean, input_.shape.size;
    AddPrior();
    for (size_t side = 0; side < 4; ++side)
      for (const auto& px : scene.outline.silhouette.samples[side]) AddEdge(side, px);
    for (const auto& p : input_.points)
      Add(PointResidual{p.p_W, p.age, 1.0 / config.lidar_sigma}, config.lidar_weight,
          input_.points.size());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solve(options, &problem_, &summary_);
  }
  double cost() const { return summary_.final_cost; }
  Matrix8d Covariance() {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance covariance(options);
    const std::vector<const double*> blocks = {y.data()};
    Matrix8d C = Matrix8d::Zero();
    if (covariance.Compute(blocks, &problem_))
      covariance.GetCovarianceBlock(y.data(), y.data(), C.data());
    return C;
  }
  Vector8d y;

 private:
  struct Prior {
    Vector8d mean;
    Matrix8d root;
    bool operator()(const double* y, double* r) const {
      Eigen::Map<Vector8d>{r} = root * (Eigen::Map<const Vector8d>(y) - mean);
      return true;
    }
  };
  void AddPrior() {
    Matrix8d covariance = Matrix8d::Zero();
    covariance.topLeftCorner<6, 6>() = input_.prior.covariance;
    covariance.diagonal().tail<2>() = input_.shape.variance;
    const Matrix8d root = Eigen::LLT<Matrix8d>(covariance).matrixL().solve(Matrix8d::Identity());
    problem_.AddResidualBlock(
        new ceres::NumericDiffCostFunction<Prior, ceres::CENTRAL, 8, 8>(new Prior{y, root}),
        nullptr, y.data());
  }
  template <class Residual>
  void Add(const Residual& residual, double weight, size_t samples) {
    using Function = OverY<Residual>;
    const double share = std::min(1.0, weight / static_cast<double>(samples));
    problem_.AddResidualBlock(
        new ceres::NumericDiffCostFunction<Function, ceres::CENTRAL, 1, 8>(new Function{residual}),
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
    if (upright)
      Add(SideResidual{Ray(px), sign, scale / std::abs(turn)}, config_.edge_weight, 8);
    else
      Add(CapResidual{Ray(px), sign, scale / std::abs(b.slope - a.slope)}, config_.edge_weight, 8);
  }

  const FitInput& input_;
  const FitConfig& config_;
  ceres::Problem problem_;
  ceres::Solver::Summary summary_;
};

void ExpectSame(const FitResult& fit, Reference* reference) {
  ASSERT_TRUE(fit.ok);
  const Matrix8d C = reference->Covariance();
  Vector8d off = -reference->y;
  off.head<6>() += fit.posterior.mean;
  off.tail<2>() += fit.shape.size;
  EXPECT_NEAR(fit.cost, reference->cost(), 1e-4 * reference->cost());
  EXPECT_LT(std::sqrt(off.dot(C.ldlt().solve(off))), 0.05) << "standard deviations";
  EXPECT_LT((fit.posterior.covariance - C.topLeftCorner<6, 6>()).norm(), 0.01 * C.norm());
  EXPECT_NEAR(fit.shape.variance[1], C(7, 7), 0.01 * C(7, 7));
}

TEST(PerceptionSolver, BothSolversFindWhatCeresFindsBlockByBlock) {
  FitConfig config;
  config.estimate_shape = true;
  config.max_iterations = 60;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Scene scene(seed);
    Reference reference(scene, config);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const auto quick = QuickFit(scene.input, config);
    ExpectSame(quick, &reference);
    ExpectSame(FitCylinder(scene.input, config), &reference);
    ExpectSame(FitCylinder(scene.input, config, &quick), &reference);
  }
}

/// Where the solution lies on a kink of a residual, a fresh trust region may get past it.
TEST(PerceptionSolver, RefiningWhatHasConvergedChangesHardlyAnything) {
  FitConfig config;
  config.max_iterations = 60;
  int changed = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const Scene scene(seed);
    const auto quick = QuickFit(scene.input, config);
    const auto full = FitCylinder(scene.input, config, &quick);
    ASSERT_TRUE(quick.ok && full.ok) << "seed " << seed;
    EXPECT_LE(full.cost, quick.cost * (1.0 + 1e-9)) << "seed " << seed;
    const Matrix6d off = quick.posterior.covariance - full.posterior.covariance;
    changed += std::abs(quick.log_evidence - full.log_evidence) > 0.01 ||
               off.norm() > 0.01 * full.posterior.covariance.norm();
  }
  EXPECT_LE(changed, 2);
}

TEST(PerceptionSolver, AProblemWithoutARootIsRefused) {
  Scene scene(1);
  scene.input.prior.covariance.setZero();
  EXPECT_FALSE(QuickFit(scene.input, {}).ok);
  scene.input.prior.covariance.setConstant(std::nan(""));
  EXPECT_FALSE(QuickFit(scene.input, {}).ok);
  Scene wild(1);
  wild.input.points.front().p_W.x() = std::nan("");
  EXPECT_FALSE(QuickFit(wild.input, {}).ok);
}

}  // namespace
}  // namespace chase::perception
