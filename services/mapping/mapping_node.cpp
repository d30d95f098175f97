#include "services/mapping/mapping_node.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/bus/convert.h"

namespace chase::mapping {

namespace {

bool Write(const std::string& file, const std::string& bytes) {
  std::ofstream out(file, std::ios::binary);
  return out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).good();
}

Sweep ToSweep(const scan_registered_t& m, double t, double period) {
  const Eigen::Quaterniond R_WL = bus::ToQuaternion(m.orientation);
  Sweep sweep{t, bus::ToVector(m.pos), {}, {}, R_WL * Eigen::Vector3d::UnitZ()};
  sweep.points.reserve(m.x.size());
  for (size_t i = 0; i < m.x.size(); ++i) sweep.points.emplace_back(m.x[i], m.y[i], m.z[i]);
  sweep.ages = FiringAges(sweep.origin, R_WL, sweep.points, period);
  return sweep;
}

}  // namespace

MappingNode::MappingNode(bus::Bus& bus, const MappingConfig& config)
    : bus_(bus), config_(config), mapper_(std::make_unique<Mapper>(config)) {
  if (!config_.save_map.empty() && !std::ofstream(config_.save_map, std::ios::app))
    throw std::runtime_error("save_map: " + config_.save_map +
                             " cannot be written; check the folder and its rights");
  bus_.Subscribe<scan_registered_t>("SCAN_REGISTERED",
                                    [this](const scan_registered_t& m) { OnScan(m); });
  bus_.Subscribe<target_t>("TARGET", [this](const target_t& m) { OnTarget(m); });
}

MappingNode::~MappingNode() {
  if (config_.save_map.empty() || !has_scan_) return;
  int occupied = 0;
  mapper_->CompleteTree();
  Write(config_.save_map, mapper_->WriteTree(&occupied));
}

double MappingNode::Seconds(int64_t utime) {
  if (!origin_) origin_ = utime;
  return bus::Seconds(utime, *origin_);
}

void MappingNode::OnTarget(const target_t& m) {
  if (m.state != target_t::TRACKING && m.state != target_t::OCCLUDED) return;
  if (!epoch_.Is(m.epoch)) return;
  TargetEstimate estimate;
  estimate.t = Seconds(m.utime);
  estimate.mean = bus::ToVector(m.mean);
  estimate.velocity = bus::ToVector(m.velocity);
  estimate.sigma = std::sqrt(std::max(0.0, 0.5 * (m.covariance[0] + m.covariance[4])));
  estimate.radius = std::max(0.0, m.radius);
  estimate.height = std::max(0.0, m.height);
  estimate.seen = m.state == target_t::TRACKING;
  mapper_->ObserveTarget(estimate);
}

void MappingNode::OnScan(const scan_registered_t& m) {
  const double t = Seconds(m.utime);
  lost_ = m.health == pose_t::HEALTH_LOST || m.health == pose_t::HEALTH_STARTING;
  const bool in_this_frame = epoch_.Is(m.epoch);
  if (!in_this_frame) order_ = {};
  const auto order = order_.Take(m.utime);
  if (lost_ || order == bus::StampOrder::Verdict::kLate) {
    ++refused_;
    return;
  }
  epoch_.Change(m.epoch);
  if (!in_this_frame || order == bus::StampOrder::Verdict::kSetBack) {
    mapper_ = std::make_unique<Mapper>(config_);
    last_map_.reset();
  }
  has_scan_ = true;
  {
    auto timer = bus_.Time("map");
    last_list_ = mapper_->Insert(ToSweep(m, t, config_.movers.sweep_time));
  }
  Publish("UNSEEN", last_list_.unseen, 0, m.utime);
  Publish("OBSTACLES", last_list_.obstacles, last_list_.n_cut, m.utime);
  {
    auto timer = bus_.Time("tree");
    mapper_->UpdateTree();
  }
  const auto period = static_cast<int64_t>(config_.map_period * 1e6);
  if (!last_map_ || m.utime - *last_map_ >= period) PublishMap(m.utime);
  SaveTiles();
}

void MappingNode::Publish(const std::string& channel, const std::vector<world::Obstacle>& obstacles,
                          int n_cut, int64_t utime) {
  obstacles_t out{};
  out.utime = utime;
  out.epoch = epoch_.value();
  out.n_cut = n_cut;
  for (const auto& obstacle : obstacles)
    out.obstacles.push_back(bus::ToMessage(obstacle, *origin_));
  out.n_obstacles = static_cast<int32_t>(out.obstacles.size());
  bus_.Publish(channel, std::move(out));
}

void MappingNode::PublishMap(int64_t utime) {
  auto timer = bus_.Time("write_map");
  last_map_ = utime;
  map_t out{};
  out.utime = utime;
  out.epoch = epoch_.value();
  out.resolution = config_.grid.resolution;
  out.format = "bt";
  const std::string bytes = mapper_->WriteTree(&out.n_occupied);
  out.size = static_cast<int32_t>(bytes.size());
  out.data.assign(bytes.begin(), bytes.end());
  bus_.Publish("MAP", std::move(out));
}

void MappingNode::SaveTiles() {
  for (const auto& tile : mapper_->TakeTiles()) {
    if (config_.save_map.empty()) continue;
    std::ostringstream name;
    name << config_.save_map << ".tile_" << tile.x << "_" << tile.y << "_" << tile.z << ".bt";
    if (!Write(name.str(), tile.bytes)) bus_.ReportError(name.str() + " could not be written");
  }
}

bus::NodeReport MappingNode::Report() const {
  bus::NodeReport report;
  if (!has_scan_) report.state = bus::NodeReport::State::kStarting;
  if (lost_) report.state = bus::NodeReport::State::kDegraded;
  std::ostringstream detail;
  detail << last_list_.n_static << " static, " << last_list_.n_moving << " moving, "
         << last_list_.n_cut << " cut, " << mapper_->Bytes() / (1 << 20) << " MiB, " << refused_
         << " sweeps refused";
  report.detail = detail.str();
  return report;
}

}  // namespace chase::mapping
