#include "deploy/calibrate/turns.h"

#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "chase/imu_t.hpp"
#include "common/math/rotation.h"
#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/decode.h"
#include "services/perception/messages.h"

namespace chase::calibrate {

Turns ReadTurns(const std::string& file, const Board& board, const world::Rig& rig) {
  lcm::LogFile log(file, "r");
  if (!log.good()) throw std::runtime_error(file + ": cannot be read; name an LCM log");
  Turns turns;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    camera_image_t image;
    imu_t imu;
    if (event->channel == "IMU" && Decode(*event, &imu)) {
      const double t = 1e-6 * static_cast<double>(imu.utime);
      if (turns.gyro.empty() || t > turns.gyro.back().t)
        turns.gyro.push_back({t, Eigen::Vector3d(imu.gyro)});
    } else if (event->channel == "CAMERA_IMAGE" && Decode(*event, &image)) {
      ++turns.images;
      const perception::Frame frame = perception::FromMessage(image, image.utime);
      cv::Vec3d rotation, position;
      if (!frame.problem.empty() ||
          !BoardPose(FindBoard(frame.bgr, board), rig, &rotation, &position))
        continue;
      turns.seen.push_back({1e-6 * static_cast<double>(image.utime),
                            math::ExpSO3({rotation[0], rotation[1], rotation[2]})});
    }
  }
  if (turns.gyro.empty()) throw std::runtime_error(file + ": holds no IMU; record it as well");
  return turns;
}

}  // namespace chase::calibrate
