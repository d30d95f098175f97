#include "services/viewer/page_feed.h"

#include <cmath>

#include "common/bus/convert.h"
#include "common/logs/jpeg.h"
#include "services/viewer/cloud.h"

namespace chase::viewer {
namespace {

constexpr int kTicksPerSecond = 10, kTicksPerObstacles = 5;
constexpr int64_t kHalfStep = 25000;  // us: sweeps and frames come in steps of their own
constexpr double kWholeLog = 1e9;     // s

}  // namespace

PageFeed::PageFeed(bus::Bus& bus, PageSink& sink, const ViewerConfig& config,
                   const std::string& source)
    : bus_(bus),
      sink_(sink),
      config_(config),
      source_(source),
      history_(source.empty() ? config.trail : kWholeLog) {}

double PageFeed::Elapsed(int64_t utime) {
  if (start_ < 0) start_ = utime;
  return bus::Seconds(utime, start_);
}

double PageFeed::Time(int64_t utime) {
  if (origin_ == 0) origin_ = utime;
  return bus::Seconds(utime, origin_);
}

bool PageFeed::Due(Part part, int64_t utime, double rate_hz) {
  if (!sink_.Wanted(part)) return false;
  int64_t& last = sent_[part];
  const auto period = static_cast<int64_t>(1e6 / rate_hz) - kHalfStep;
  if (utime >= last && utime - last < period) return false;
  last = utime;
  return true;
}

void PageFeed::Take(const pose_t& m) {
  Time(newest_ = m.utime);
  if (m.epoch != epoch_ && epoch_ >= 0) {  // what was drawn in the old frame W is nowhere now
    history_.ForgetPositions();
    auto faults = std::move(scene_.faults);
    Forget();
    scene_.faults = std::move(faults);
  }
  epoch_ = m.epoch;
  if (first_epoch_ < 0) first_epoch_ = epoch_;
  scene_.drone = FromMessage(m);
  heard_.pose = bus_.Now();
}

void PageFeed::Take(const target_t& m) {
  scene_.target = FromMessage(m);
  heard_.target = bus_.Now();
  target_utime_ = m.utime;
  if (image_ && target_utime_ >= image_->utime) SendImage();
}

void PageFeed::Take(const plan_t& m) {
  Time(m.utime);
  scene_.plan = FromMessage(m, origin_);
  heard_.plan = bus_.Now();
}

void PageFeed::Take(const prediction_t& m) {
  Time(m.utime);
  scene_.forecast.reset();
  if (m.verdict != prediction_t::NO_TARGET) scene_.forecast = FromMessage(m, origin_);
  heard_.forecast = bus_.Now();
}

void PageFeed::Take(const obstacles_t& m) {
  Time(newest_ = m.utime);
  obstacles_ = FromMessage(m, origin_);
  obstacles_sent_ = false;
  scene_.obstacles_age = 0.0;
  heard_.obstacles = bus_.Now();
}

void PageFeed::Take(const flight_state_t& m) {
  Time(m.utime);
  scene_.flight = FromMessage(m, start_ < 0 ? origin_ : start_);
  heard_.flight = bus_.Now();
}

void PageFeed::Take(const tracking_t& m) {
  scene_.tracking = Tracking{Code(m.following), 0.0};
  heard_.tracking = bus_.Now();
}

template <class Sweep>
void PageFeed::SendCloud(const Sweep& m, const Eigen::Vector3d& centre) {
  if (!Due(Part::kCloud, m.utime, config_.cloud_rate_hz)) return;
  auto timer = bus_.Time("cloud");
  sink_.Send(Part::kCloud,
             EncodeCloud(Time(m.utime), generation_, centre, m.x, m.y, m.z,
                         static_cast<size_t>(config_.cloud_points)),
             true);
}

void PageFeed::Take(const scan_registered_t& m) { SendCloud(m, bus::ToVector(m.pos)); }

void PageFeed::Take(const lidar_scan_t& m) {
  if (!scene_.drone) SendCloud(m, Eigen::Vector3d::Zero());
}

void PageFeed::Take(const camera_image_t& m) {
  scene_.image_age = 0.0;
  heard_.image = bus_.Now();
  if (!Due(Part::kImage, m.utime, config_.image_rate_hz)) return;
  auto timer = bus_.Time("image");
  std::string jpeg = logs::Jpeg(m, config_.jpeg_quality);
  if (jpeg.empty()) return;
  SendImage();  // the one before
  image_ = Image{m.utime, bus_.Now(), m.width, m.height, std::move(jpeg)};
  if (target_utime_ >= m.utime) SendImage();
}

void PageFeed::SendImage() {
  if (!image_) return;
  const auto target = target_utime_ == image_->utime ? scene_.target : std::nullopt;
  sink_.Send(Part::kImage,
             EncodeImage(Time(image_->utime), image_->width, image_->height, target, image_->jpeg),
             true);
  image_.reset();
}

void PageFeed::Take(const status_t& m) {
  const auto before = statuses_.find(m.name);
  const status_t* last = before == statuses_.end() ? nullptr : &before->second;
  health_[m.name] = FromMessage(m, last);
  status_heard_[m.name] = bus_.Now();
  if (m.name == "planning" && last) scene_.plan_ms = MeanStageMs(m, *last, "plan");
  statuses_[m.name] = m;
}

void PageFeed::Take(const event_t& m) {
  if (m.phase == event_t::BEGINS)
    scene_.faults.insert(m.name);
  else
    scene_.faults.erase(m.name);
}

void PageFeed::Age() {
  const auto since = [this](int64_t heard) { return bus::Seconds(bus_.Now(), heard); };
  if (scene_.drone) scene_.drone->age = since(heard_.pose);
  if (scene_.target) scene_.target->age = since(heard_.target);
  if (scene_.plan) scene_.plan->age = since(heard_.plan);
  if (scene_.forecast) scene_.forecast->age = since(heard_.forecast);
  if (scene_.flight) scene_.flight->age = since(heard_.flight);
  if (scene_.tracking) scene_.tracking->age = since(heard_.tracking);
  if (scene_.obstacles_age) scene_.obstacles_age = since(heard_.obstacles);
  if (scene_.image_age) scene_.image_age = since(heard_.image);
}

void PageFeed::Remember(int64_t utime) {
  Age();
  scene_.processes = WorstState(Processes());
  if (origin_ != 0) history_.Add(SampleOf(scene_, Elapsed(utime)));
}

void PageFeed::Forget() {
  scene_ = Scene();
  obstacles_.clear();
  obstacles_sent_ = false;
  statuses_.clear();
  health_.clear();
  mission_health_.reset();
  sent_.clear();
  image_.reset();
  target_utime_ = -1;
  epoch_ = -1;
  ++generation_;
}

void PageFeed::SendHello() {
  sink_.Retain(Part::kHello, HelloText(source_, play_ ? play_->duration : 0.0,
                                       source_.empty() && !config_.token.empty(), history_));
}

std::vector<ProcessHealth> PageFeed::Processes() {
  const int64_t now = bus_.Now();
  for (auto& [name, health] : health_) health.age = bus::Seconds(now, status_heard_[name]);
  return Joined(health_, mission_health_.value_or(health_t{}), now);
}

void PageFeed::Tick(int64_t utime, const std::string& self) {
  Age();
  scene_.processes = WorstState(Processes());
  if (!play_) Remember(utime);
  const bool second = ticks_++ % kTicksPerSecond == 0;
  if (!play_ && second) SendHello();
  const bool paused = play_ && !play_->playing;
  if (image_ && (paused || bus::Seconds(bus_.Now(), image_->heard) > kMostShownAge.target))
    SendImage();
  if (!sink_.Wanted(Part::kState)) return;
  auto timer = bus_.Time("tick");
  if (epoch_ >= 0 && epoch_ != first_epoch_) scene_.truth.clear();
  scene_.utime = bus_.Now();
  sink_.Send(Part::kState, StateText(scene_, Elapsed(utime), generation_, play_), false);
  if (!obstacles_sent_ && ticks_ % kTicksPerObstacles == 0) {
    obstacles_sent_ = true;
    sink_.Send(Part::kObstacles,
               ObstaclesText(obstacles_, Time(newest_), Elapsed(utime), generation_), false);
  }
  if (second) sink_.Send(Part::kHealth, HealthText(Processes(), self), false);
}

}  // namespace chase::viewer
