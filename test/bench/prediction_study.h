#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "services/prediction/observation_window.h"
#include "services/prediction/predictor.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {

/// A ground target on straights and curves, two of three of them 90 degrees at 0.8 m, with stops:
/// positions every 10 ms over 60 s.
inline std::vector<Eigen::Vector2d> DriveTarget(InstanceGenerator* random, double top_speed) {
  std::vector<Eigen::Vector2d> path;
  Eigen::Vector2d x(0, 0);
  double heading = 0.0;
  const double ds = 0.01;
  const auto advance = [&](double length, double curvature) {
    for (double s = 0; s < length; s += ds, heading += curvature * ds)
      path.push_back(x += ds * Eigen::Vector2d(std::cos(heading), std::sin(heading)));
  };
  while (path.size() < static_cast<size_t>(70.0 * top_speed / ds)) {
    advance(random->Uniform(1, 5), 0.0);
    const bool sharp = random->Uniform(0, 1) < 0.67;
    const double radius = sharp ? 0.8 : random->Uniform(1.5, 4);
    const double angle = sharp ? M_PI / 2 : random->Uniform(0.3, 1.5);
    advance(radius * angle, (random->Uniform(0, 1) < 0.5 ? -1 : 1) / radius);
  }
  std::vector<Eigen::Vector2d> run;
  double s = 0, speed = 0, goal = top_speed, timer = random->Uniform(4, 12);
  for (int i = 0; i < 6000; ++i, timer -= 0.01) {
    if (timer < 0) {
      const bool stop = goal > 0 && random->Uniform(0, 1) < 0.4;
      goal = stop ? 0.0 : random->Uniform(0.5, 1.0) * top_speed;
      timer = stop ? random->Uniform(2, 4) : random->Uniform(4, 12);
    }
    speed += std::clamp(goal - speed, -0.005, 0.005);
    s += 0.01 * speed;
    run.push_back(path[std::min(static_cast<size_t>(s / ds), path.size() - 1)]);
  }
  return run;
}

/// Root mean squares of the error at 0.5, 1 and 2.5 s, m.
struct StudyResult {
  Eigen::Array3d ours = Eigen::Array3d::Zero();
  Eigen::Array3d constant_velocity = Eigen::Array3d::Zero();  ///< least-squares line over 0.5 s
};

inline Eigen::Vector2d LineAhead(const std::vector<Eigen::Vector2d>& seen, double ahead) {
  Eigen::Vector2d mean(0, 0), slope(0, 0);
  double spread = 0;
  const int n = static_cast<int>(seen.size());
  for (const auto& x : seen) mean += x / n;
  for (int i = 0; i < n; ++i) {
    const double t = 0.05 * (i - 0.5 * (n - 1));
    slope += t * seen[static_cast<size_t>(i)];
    spread += t * t;
  }
  return mean + slope / spread * (0.05 * 0.5 * (n - 1) + ahead);
}

inline StudyResult StudyAccuracy(const PredictorConfig& config, const WindowConfig& window_config,
                                 double sigma, int runs) {
  StudyResult result;
  const double ahead[] = {0.5, 1.0, 2.5};
  int count = 0;
  for (int r = 0; r < runs; ++r) {
    InstanceGenerator random(static_cast<uint64_t>(r));
    const auto truth = DriveTarget(&random, 1.0);
    ObservationWindow window(window_config);
    std::vector<Eigen::Vector2d> recent;
    for (size_t i = 0; i + 255 < truth.size(); i += 5) {
      PredictRequest request;
      request.now = 0.01 * static_cast<double>(i);
      const Eigen::Vector2d seen =
          truth[i] + sigma * Eigen::Vector2d(random.Normal(), random.Normal());
      window.Add(
          {request.now, {seen.x(), seen.y(), 0.5}, sigma * sigma * Eigen::Matrix3d::Identity()});
      recent.push_back(seen);
      if (recent.size() > 11) recent.erase(recent.begin());
      if (i < 200 || i % 50 != 0) continue;
      request.observations = window.Merged();
      const auto prediction = Predictor(config).Predict(request).trajectory;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector2d there = truth[i + static_cast<size_t>(100 * ahead[k])];
        result.ours[k] +=
            (prediction.Position(request.now + ahead[k]).head<2>() - there).squaredNorm();
        result.constant_velocity[k] += (LineAhead(recent, ahead[k]) - there).squaredNorm();
      }
      ++count;
    }
  }
  result.ours = (result.ours / count).sqrt();
  result.constant_velocity = (result.constant_velocity / count).sqrt();
  return result;
}

}  // namespace chase::prediction
