#pragma once

#include <vector>

#include "test/baselines/nlp.h"
#include "test/baselines/penin_style/spline.h"
#include "test/baselines/rival.h"

namespace chase::baselines {

struct PeninParameters {
  double weight_distance = 1.0, weight_smooth = 0.03, weight_image = 0.1;
  double margin = 0.1;            ///< on the constraints d > 1
  double desired_distance = 3.0;  ///< m
  double weight_yaw = 0.05;
  double field_deg = 40.0;                               ///< half angle of the front camera
  double least_thrust = 0.4, greatest_thrust = 1.6;      ///< in g
  double least_distance = 1.0, greatest_distance = 6.0;  ///< to the target, m
  double pair_reach = 2.0;  ///< obstacles further from the warm start than this are left out, m
  int samples = 25;
};

/// Hard-constraint tracking on flat outputs. Variables: the free control points, x y z by turns.
class TrackingNlp : public Nlp {
 public:
  TrackingNlp(const PeninParameters& parameters, const planning::PlannerConfig& config,
              const planning::PlanRequest& request, const Spline& spline,
              const Eigen::VectorXd& warm);

  int n_variables() const override { return 3 * Spline::kFree; }
  int n_constraints() const override;
  double Cost(const Eigen::VectorXd& x, Eigen::VectorXd* gradient) const override;
  void Constraints(const Eigen::VectorXd& x, Eigen::VectorXd* g, Rows* jacobian) const override;

  Spline::Controls ToControls(const Eigen::VectorXd& x) const;

 private:
  struct Instant {
    double weight;  ///< of the trapezoid, s
    Eigen::Vector3d target, target_velocity;
    Spline::Row basis[3];     ///< of position, velocity, acceleration
    std::vector<int> bodies;  ///< constrained here
  };
  struct Flat {
    Eigen::Vector3d p, v, a;
  };
  struct Slope {  ///< of one number with respect to p, v, a
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(),
                    a = Eigen::Vector3d::Zero();
  };
  static constexpr int kPlain = 8;  ///< constraints of every instant besides obstacles

  Flat At(const Instant& instant, const Spline::Controls& controls) const;
  static void Spread(const Instant& instant, const Slope& slope, double factor, double* row);
  double InstantCost(const Instant& instant, const Flat& flat, Slope* slope) const;
  void Plain(const Instant& instant, const Flat& flat, double* g, Slope* slopes) const;

  PeninParameters parameters_;
  double max_speed_, z_min_, z_max_;
  Eigen::Matrix<double, Spline::kFixed, 3> fixed_;
  Eigen::Matrix<double, Spline::kControls, Spline::kControls> smooth_;
  std::vector<Body> bodies_;
  std::vector<Instant> instants_;
};

/// Sine of the target's elevation in a camera whose optical axis lies normal to the thrust a + g
/// e3, and its slopes with respect to p and a.
double ImageElevation(const Eigen::Vector3d& u, const Eigen::Vector3d& a, Eigen::Vector3d* dp,
                      Eigen::Vector3d* da);
/// Cosine between that axis, turned towards the target, and the target's direction u.
double AxisCosine(const Eigen::Vector3d& u, const Eigen::Vector3d& a, Eigen::Vector3d* dp,
                  Eigen::Vector3d* da);
/// Rate of the bearing of u with rate w, floored near the vertical; slopes with respect to p and v
/// of u = q - p, w = q' - v.
double BearingRate(const Eigen::Vector3d& u, const Eigen::Vector3d& w, Eigen::Vector3d* dp,
                   Eigen::Vector3d* dv);

}  // namespace chase::baselines
