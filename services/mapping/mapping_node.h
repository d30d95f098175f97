#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/epoch.h"
#include "common/bus/node.h"
#include "common/bus/stamp_order.h"
#include "services/mapping/mapper.h"

namespace chase::mapping {

/// SCAN_REGISTERED and TARGET in; OBSTACLES with every usable sweep and MAP once a period out.
class MappingNode : public bus::Node {
 public:
  /// Throws std::runtime_error when config.save_map cannot be written.
  MappingNode(bus::Bus& bus, const MappingConfig& config);
  /// Writes config.save_map, if asked for.
  ~MappingNode() override;

  bus::NodeReport Report() const override;

 private:
  void OnScan(const scan_registered_t& m);
  void OnTarget(const target_t& m);
  void Publish(const std::string& channel, const std::vector<world::Obstacle>& obstacles, int n_cut,
               int64_t utime);
  void PublishMap(int64_t utime);
  void SaveTiles();
  double Seconds(int64_t utime);

  bus::Bus& bus_;
  MappingConfig config_;
  std::unique_ptr<Mapper> mapper_;
  bus::Epoch epoch_;
  bus::StampOrder order_;
  bool has_scan_ = false;
  std::optional<int64_t> origin_, last_map_;  ///< utime
  int refused_ = 0;    ///< sweeps that odometry calls unusable, or that come from the past
  bool lost_ = false;  ///< the last sweep was unusable
  ObstacleList last_list_;
};

}  // namespace chase::mapping
