#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/mapping/body_filter.h"
#include "services/mapping/enclosing.h"
#include "services/mapping/panorama.h"
#include "services/mapping/sweep.h"

namespace chase::mapping {

/// Returns that moved together. Frame W.
struct Cluster {
  std::vector<int> members;                          ///< indices into the sweep's returns
  Reaches reaches;                                   ///< of the returns; where hidden, as supposed
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of the box around all that, m
  double half_height = 0.0;                          ///< of that box, m
  int track = -1;                                    ///< id of the track that it belongs to
};

/// Index of the body whose outline a return exceeds least, by at most `gate` deviations, or -1;
/// `excess`: by how many.
int NearestBody(const std::vector<Footprint>& bodies, const Return& r, double gate, double* excess);

/// Finds returns where space has long been free, and what hangs together with them.
class MotionDetector {
 public:
  MotionDetector(const MoverConfig& movers, const GridConfig& grid)
      : config_(movers), ever_free_(grid.ever_free_sweeps), range_(grid.range) {}

  /// Looks at returns labelled kStatic, seen from `origin`. `expected`: where movers should be now;
  /// returns there count as moving unless a settled cell holds them, and are divided among these
  /// movers by likelihood. The others are clusters by their connection.
  std::vector<Cluster> Detect(const Eigen::Vector3d& origin, const LowestRays& rays,
                              const std::vector<Return>& returns, VoxelGrid* grid,
                              const std::vector<Footprint>& expected);
  /// What hid what in that sweep.
  const Panorama& panorama() const { return panorama_; }

 private:
  struct Candidate {
    int64_t cell;  ///< code of its cluster cell in plan
    int index;     ///< into the returns
    float z;       ///< its height, m
    bool strong;   ///< lies in ever-free space
    bool passed;   ///< and no lower than rays have passed there
    int body;      ///< index of the expected mover whose it is, or -1
  };
  std::vector<Candidate> Candidates(const std::vector<Return>& returns, VoxelGrid* grid,
                                    const std::vector<Footprint>& expected) const;
  bool InEverFree(const Key& key, VoxelGrid* grid) const;
  std::vector<Cluster> Connected(const std::vector<Candidate>& candidates, int body) const;
  std::vector<int> Look(const Eigen::Vector3d& origin, const LowestRays& rays,
                        const std::vector<Return>& returns, const std::vector<Cluster>& clusters);
  bool Join(const std::vector<Return>& returns, std::vector<Cluster>* clusters) const;
  bool Finish(const std::vector<Return>& returns, const std::vector<int>& owner, int self,
              Cluster* cluster) const;
  static void Touch(const std::vector<Return>& returns, const std::vector<int>& owner, int self,
                    const std::array<Eigen::Vector2f, kDirections>& ends, Cluster* cluster);

  MoverConfig config_;
  int ever_free_;
  double range_;
  Panorama panorama_;
};

}  // namespace chase::mapping
