#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace chase::simulator {

/// PX4's land detector for multicopters (MulticopterLandDetector.cpp of 1.14, parameters at their
/// defaults): ground contact, maybe landed, landed, each after a third of LNDMC_TRIG_TIME in which
/// its conditions hold; one that fails ends it at once. The throttle, not the ground, is what it
/// goes by: on the ground with more than MPC_MANTHR_MIN it flies. Left out: free fall, the times
/// for a velocity that is not valid (8 s) and for a range finder that does not see the ground (3
/// s), and its estimate of the hover thrust, by which it lands 0.3 s sooner at most.
class LandDetector {
 public:
  struct Inputs {
    int64_t utime;           ///< microseconds, rising
    bool armed;              ///< disarmed it has landed
    bool controls_climb;     ///< all modes that PX4 flies itself; OFFBOARD by attitude does not
    bool descends;           ///< in such a mode
    double throttle;         ///< asked for, 0 to 1
    double hover;            ///< MPC_THR_HOVER
    Eigen::Vector3d v_WB;    ///< m/s
    Eigen::Vector3d w_WB_B;  ///< rad/s
  };

  /// Has it landed?
  bool Update(const Inputs& in);

 private:
  struct Stage {
    bool holds = true;
    int64_t since = 0;
    void Set(bool condition, int64_t utime);
  };
  bool TouchesGround(const Inputs& in) const;
  bool MayHaveLanded(const Inputs& in) const;

  Stage ground_contact_, maybe_landed_, landed_;
};

}  // namespace chase::simulator
