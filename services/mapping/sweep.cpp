#include "services/mapping/sweep.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr double kStep = 0.3;        // rad between returns in the order of firing, at most
constexpr double kFewSteps = 0.02;   // share of longer ones: gaps without returns
constexpr double kMostTurns = 1.05;  // of a sweep

}  // namespace

std::vector<float> FiringAges(const Eigen::Vector3d& origin, const Eigen::Quaterniond& R_WL,
                              const std::vector<Eigen::Vector3f>& points, double period) {
  std::vector<float> turned(points.size(), 0.0f);
  const Eigen::Matrix3f R_LW = R_WL.toRotationMatrix().transpose().cast<float>();
  const Eigen::Vector3f p_WL = origin.cast<float>();
  double last = 0.0, sum = 0.0, low = 0.0, high = 0.0;
  size_t known = 0, jumps = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f ray = R_LW * (points[i] - p_WL);
    if (ray.allFinite() && ray.head<2>().squaredNorm() > 0.0f) {
      const double azimuth = std::atan2(ray.y(), ray.x());
      if (known++ > 0) {
        double step = azimuth - last;
        if (std::abs(step) > M_PI) step -= std::copysign(2.0 * M_PI, step);
        jumps += std::abs(step) > kStep;
        sum += step;
      }
      last = azimuth;
      low = std::min(low, sum);
      high = std::max(high, sum);
    }
    turned[i] = static_cast<float>(sum);
  }
  const bool turn = static_cast<double>(jumps) <= kFewSteps * static_cast<double>(known) &&
                    high - low < kMostTurns * 2.0 * M_PI;
  const double end = -low > high ? low : high;  // clockwise turns are negative
  for (auto& age : turned)
    age = turn && known > 1
              ? static_cast<float>(
                    std::clamp(period * (end - age) / std::copysign(2.0 * M_PI, end), 0.0, period))
              : 0.0f;
  return turned;
}

}  // namespace chase::mapping
