#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <vector>

namespace chase::logs {

/// The body at one instant, as it was measured: without the estimated biases.
struct Motion {
  double t = 0.0;                                    ///< s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();   ///< specific force, frame B, m/s^2
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();    ///< m/s
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< of v_WB in frame B, m^2/s^2
  int stretch = 0;                                                ///< of flight without a gap
};

/// What the autopilot is asked for from t on.
struct Asked {
  double t = 0.0;  ///< s
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< feed-forward, in the wanted B, rad/s
  double thrust = 0.0;                               ///< collective over mass, m/s^2
};

/// Both in the order of time.
struct FlightSamples {
  std::vector<Motion> motions;
  std::vector<Asked> asked;
};

/// An estimate with its standard uncertainty, infinite where the flight does not show it.
struct Parameter {
  double value = 0.0, sigma = std::numeric_limits<double>::infinity();
  double systematic = 0.0;  ///< the part of sigma that more of the same flight does not lessen
};

/// A vehicle as its flight shows it.
struct Identification {
  double seconds = 0.0;                              ///< of flight that it rests on
  Eigen::Vector3d speeds = Eigen::Vector3d::Zero();  ///< root mean squares, frame B, m/s
  Parameter drag_forward, drag_sideways;             ///< linear, over mass, along x and y of B, 1/s
  Parameter drag_horizontal;                         ///< of both, 1/s
  Parameter drag_vertical;                           ///< along z of B, 1/s
  Parameter hover_thrust;                            ///< that has to be asked for, m/s^2
  Parameter thrust_scale;                            ///< given over asked for, at the hover
  Parameter thrust_curvature;  ///< change of that share per relative change of thrust
  Parameter thrust_lag;        ///< of the motors, with what delays them, s
  Parameter attitude_gain;     ///< rate per error of roll and pitch, 1/s
  Parameter rate_share;        ///< of the rates fed forward that is flown
  Parameter rate_lag;          ///< of the body's rates, with what delays them, s
  Parameter lead;              ///< by which the thrust's direction lags what is asked, s
};

/// Three regressions: drag, thrust, attitude. Nothing where there are less than 5 s of flight.
std::optional<Identification> Identify(const FlightSamples& flight);

}  // namespace chase::logs
