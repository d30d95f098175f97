#include "test/unit/odometry_ceres.h"

#include <ceres/ceres.h>

namespace chase::odometry::test {

namespace {

/// Signed distance of a point from a plane as a function of the pose.
struct PlaneDistance {
  Eigen::Vector3d p_B, normal, center;

  template <class T>
  bool operator()(const T* quaternion, const T* position, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> R(quaternion);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> p(position);
    residual[0] = normal.cast<T>().dot(R * p_B.cast<T>() + p - center.cast<T>());
    return true;
  }
};

/// rho(s) = k^2 s / (k^2 + s), Geman and McClure.
class GemanMcClure : public ceres::LossFunction {
 public:
  explicit GemanMcClure(double kernel) : k2_(kernel * kernel) {}
  void Evaluate(double s, double out[3]) const override {
    const double w = k2_ / (k2_ + s);
    out[0] = s * w;
    out[1] = w * w;
    out[2] = -2.0 * w * w * w / k2_;
  }

 private:
  double k2_;
};

}  // namespace

Pose MatchWithCeres(const std::vector<Eigen::Vector3f>& planes, const SurfaceMap& map,
                    const Pose& start, double kernel) {
  Pose pose = start;
  ceres::Problem problem;
  problem.AddParameterBlock(pose.R.coeffs().data(), 4, new ceres::EigenQuaternionManifold);
  problem.AddParameterBlock(pose.p.data(), 3);
  for (const Eigen::Vector3f& point : planes) {
    const Eigen::Vector3d p_B = point.cast<double>();
    const Surface* surface = map.Find((start * p_B).cast<float>(), start.p.cast<float>());
    if (!surface) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlaneDistance, 1, 4, 3>(new PlaneDistance{
            p_B, surface->direction.cast<double>(), surface->center.cast<double>()}),
        new GemanMcClure(kernel), pose.R.coeffs().data(), pose.p.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 20;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return pose;
}

}  // namespace chase::odometry::test
