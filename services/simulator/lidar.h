#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "common/world/random.h"
#include "common/world/rig.h"
#include "services/simulator/scene.h"
#include "services/simulator/velodyne.h"

namespace chase::simulator {

/// A VLP-16: 16 lasers from -15 to 15 degrees, 1800 firing sequences a turn.
struct LidarConfig {
  double rate = 10.0;
  double noise = 0.02;
  double dropout = 0.005;
  double min_range = 0.5, max_range = 100.0;
  bool packets = false;

  template <class V>
  void Visit(V& v) {
    v("rate", rate, "sweeps, Hz; 0: none");
    v("noise", noise, "standard deviation of a range, m");
    v("dropout", dropout, "share of returns lost");
    v("min_range", min_range, "m");
    v("max_range", max_range, "m");
    v("packets", packets, "as a true VLP-16: data packets, lasers up to 11 mm off the centre");
  }
  std::string Problem() const;
};

inline constexpr int kRings = 16;
inline constexpr int kFirings = 1800;               // sequences a sweep
inline constexpr double kFiringPeriod = 55.296e-6;  // s from sequence to sequence
inline constexpr double kLaserPeriod = 2.304e-6;    // s from laser to laser

/// Time of a ring's laser after its sequence's start [s]: lasers fire from below and above by
/// turns.
double LaserDelay(int ring);

/// Direction of a ring's laser in frame L. A sweep starts at the back and turns clockwise seen from
/// above, 0.2 degrees a sequence.
Eigen::Vector3d LaserDirection(int firing, int ring);

/// One sweep as measured: points in frame L at their own firing times.
struct Sweep {
  double start = 0.0;  ///< s
  std::vector<float> x, y, z, t;
  std::vector<uint8_t> intensity, ring;
};

/// A pose at a time; a short history of them is what the sensor moves along.
struct TimedPose {
  double t = 0.0;  ///< s
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
};

/// Between two poses, linear and on the great circle.
TimedPose Interpolated(const TimedPose& a, const TimedPose& b, double t);

class Lidar {
 public:
  Lidar(const LidarConfig& config, const world::Rig& rig, uint64_t seed);

  /// Fires every sequence due before `poses.back().t`. Poses of the body in order of time, about
  /// 1 ms apart, the first no later than the newest of the call before. The scene stands still.
  void Advance(const std::vector<TimedPose>& poses, const Scene& scene);

  /// The sweep that was completed last, once.
  std::optional<Sweep> Take();

  /// The data packets completed since the last call, where the configuration asks for them.
  std::vector<DataPacket> TakePackets() { return writer_.Take(); }

 private:
  double FiringTime(int firing) const;
  int FireNext(const std::vector<TimedPose>& poses, const Scene& scene);
  void Aim(const TimedPose& body, int lane, RayPacket* rays) const;
  void RecordFiring(int firing, const RayPacket* rays, const HitPacket* hits, int lane);
  void Record(int firing, int ring, const RayPacket& rays, const HitPacket& hits, int lane);

  LidarConfig config_;
  Eigen::Vector3d p_BL_;
  Eigen::Quaterniond q_BL_;
  world::Random random_;
  std::vector<Eigen::Vector3f> directions_;  // [firing][ring]
  long sweep_index_ = 0;
  int firing_ = 0;
  Sweep sweep_;
  std::optional<Sweep> complete_;
  PacketWriter writer_;
};

}  // namespace chase::simulator
