#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace chase::calibrate {

/// The board, which stands still, as the camera sees it at a stamp.
struct Turned {
  double t = 0.0;  ///< of the image, s
  Eigen::Quaterniond R_CP = Eigen::Quaterniond::Identity();
};

struct Gyro {
  double t = 0.0;                                    ///< s
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< as measured, rad/s
};

/// What a turn is by either, as rotation vectors in C, rad.
struct ComparedTurn {
  double t = 0.0;  ///< of its middle, s, by the stamps of images
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  ///< by the fit
};

struct ImuFit {
  std::string problem;  ///< why there is none; empty: there is one
  Eigen::Quaterniond R_BC = Eigen::Quaterniond::Identity();
  double delay = 0.0;                              ///< stamps of images after the gyro's, s
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< of the gyro, rad/s
  double rms = 0.0;                                ///< of the turns per axis, rad
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();  ///< about the axes of C, rad
  double delay_sigma = 0.0;                                  ///< standard deviations
  int turns = 0;                                             ///< that both measured
  std::vector<ComparedTurn> compared;                        ///< the shortest, in order of time
};

/// Rotation of the camera in the body and the delay of its stamps, within 0.2 s, from turns before
/// a board that both camera and gyroscope measure: R_C = R_BC' R_B R_BC (Tsai and Lenz 1989), with
/// the gyro's constant bias. Needs no guess; needs turns about two axes. Both in the order of time.
/// A problem where the delay is beyond that or the steps do not settle.
ImuFit FitImu(const std::vector<Turned>& seen, const std::vector<Gyro>& gyro);

}  // namespace chase::calibrate
