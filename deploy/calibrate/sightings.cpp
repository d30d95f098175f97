#include "deploy/calibrate/sightings.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <stdexcept>

#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/decode.h"
#include "services/perception/messages.h"

namespace chase::calibrate {
namespace {

constexpr int64_t kSweep = 100'000, kNeighbour = 150'000, kApart = 500'000;  // us
constexpr double kStill = 1.0;                                               // px between frames

struct Seen {
  int64_t utime;
  View view;
  cv::Mat bgr;
};
struct Swept {
  int64_t utime;
  std::vector<Eigen::Vector3d> points;
};

/// Mean way of the corners that both views show, px; large where there is none.
double Moved(const View& a, const View& b) {
  double sum = 0.0;
  int n = 0;
  for (std::size_t i = 0; i < a.ids.size(); ++i)
    for (std::size_t j = 0; j < b.ids.size(); ++j)
      if (a.ids[i] == b.ids[j]) sum += cv::norm(a.px[i] - b.px[j]), ++n;
  return n > 0 ? sum / n : 1e9;
}

bool StandsStill(const std::vector<Seen>& seen, std::size_t i) {
  if (i == 0 || i + 1 == seen.size()) return false;
  for (const Seen* other : {&seen[i - 1], &seen[i + 1]})
    if (std::llabs(other->utime - seen[i].utime) > kNeighbour ||
        Moved(other->view, seen[i].view) > kStill)
      return false;
  return true;
}

Plane PlaneOf(const Seen& seen, const Swept& swept, const Board& board, const world::Rig& rig) {
  cv::Vec3d rotation, position;
  Plane plane;
  if (!BoardPose(seen.view, rig, &rotation, &position)) return plane;
  cv::Matx33d R;
  cv::Rodrigues(rotation, R);
  Eigen::Matrix3d R_CP;
  cv::cv2eigen(cv::Mat(R), R_CP);
  plane.X_CP.linear() = R_CP;
  plane.X_CP.translation() = Eigen::Vector3d(position[0], position[1], position[2]);
  plane.size = {board.columns * board.square, board.rows * board.square};
  plane.points = swept.points;
  return plane;
}

}  // namespace

Sightings ReadSightings(const std::string& file, const Board& board, const world::Rig& rig) {
  lcm::LogFile log(file, "r");
  if (!log.good()) throw std::runtime_error(file + ": cannot be read; name an LCM log");
  Sightings sightings;
  std::vector<Seen> seen;
  std::vector<Swept> swept;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    camera_image_t image;
    lidar_scan_t scan;
    if (event->channel == "CAMERA_IMAGE" && Decode(*event, &image)) {
      ++sightings.images;
      const perception::Frame frame = perception::FromMessage(image, image.utime);
      View view = frame.problem.empty() ? FindBoard(frame.bgr, board) : View();
      if (view.empty()) continue;
      ++sightings.seen;
      seen.push_back({image.utime, std::move(view), frame.bgr});
    } else if (event->channel == "LIDAR_SCAN" && Decode(*event, &scan)) {
      ++sightings.sweeps;
      Swept s{scan.utime, {}};
      for (const auto& p : perception::FromMessage(scan, scan.utime).points)
        s.points.push_back(p.cast<double>());
      swept.push_back(std::move(s));
    }
  }
  int64_t last = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].utime - last < kApart || !StandsStill(seen, i)) continue;
    for (const Swept& s : swept) {
      if (seen[i].utime < s.utime || seen[i].utime > s.utime + kSweep) continue;
      last = seen[i].utime;
      sightings.frames.push_back(seen[i].bgr);
      sightings.planes.push_back(PlaneOf(seen[i], s, board, rig));
      break;
    }
  }
  return sightings;
}

}  // namespace chase::calibrate
