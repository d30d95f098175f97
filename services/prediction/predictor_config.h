#pragma once

#include <string>

#include "services/prediction/steady_motion.h"

namespace chase::prediction {

/// Parameters of Problem 1 of Jeon 2021 and of its search.
struct PredictorConfig {
  MotionConfig motion;
  int samples = 5;
  int steps = 8;
  int degree = 3;
  double horizon = 2.5;
  double fit_weight = 100.0;
  double damping = 0.0;
  double density_weight = 1.0;
  double contour_sigmas = 3.0;
  double sigma_floor = 0.05;
  double spread = 0.2;
  bool planar = true;
  double max_target_speed = 4.0;
  double inflation = 1.0;
  double overlap_tolerance = 0.15;
  double smallest_shrink = 0.5;
  int table_limit = 400000;
  int visit_limit = 60000;
  int node_limit = 4000;

  template <class V>
  void Visit(V& v) {
    v("motion", motion, "");
    v("samples", samples, "N_v, points per observation: its mean and a contour around it");
    v("steps", steps, "N_o, points are sampled around the newest so many observations");
    v("degree", degree, "m_q of the prediction, 1 to 7");
    v("horizon", horizon, "T, length of the prediction, s");
    v("fit_weight", fit_weight, "w of eq. (8), pull towards the points, 1/s^3");
    v("damping", damping, "weight of the squared speed in eq. (8), 1/s^2; 0: the paper's");
    v("density_weight", density_weight, "w_q of Problem 1, relative to the densities at the means");
    v("contour_sigmas", contour_sigmas, "radius of the contour, standard deviations");
    v("sigma_floor", sigma_floor, "least standard deviation of an observation, m");
    v("spread", spread,
      "least standard deviation that points are sampled with, m: how wide the candidates fan out");
    v("planar", planar, "hold z at the mean height: a target on the ground");
    v("max_target_speed", max_target_speed, "the mean prediction is slowed down to this, m/s");
    v("inflation", inflation, "share of the target's radius that obstacles grow by");
    v("overlap_tolerance", overlap_tolerance,
      "an obstacle that covers the target shrinks to leave this share of its size free");
    v("smallest_shrink", smallest_shrink, "an obstacle that would shrink below this is left out");
    v("table_limit", table_limit, "up to so many candidates two tables are searched, then a tree");
    v("visit_limit", visit_limit, "of the tables; the gap to the optimum is reported");
    v("node_limit", node_limit, "of the tree; the gap to the optimum is reported");
  }

  /// Names the first field that makes no sense, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::prediction
