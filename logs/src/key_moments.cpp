#include "logs/src/key_moments.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "chase/camera_image_t.hpp"
#include "chase/target_t.hpp"
#include "common/bus/convert.h"
#include "common/logs/jpeg.h"
#include "common/logs/log_clock.h"
#include "logs/src/good_message.h"
#include "logs/src/output.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMost = 12;
constexpr double kApart = 1.0;    // s
constexpr double kLongest = 1.0;  // s until an image must have come
constexpr int kQuality = 75;      // of 100, as JPEG

enum Rank { kFault, kState, kLoss, kVerdict, kMiddle };

/// What a span's beginning means; no label: nothing.
Moment MomentOf(const Json& span) {
  const std::string lane = span["lane"], label = span["label"];
  const double t = span["from"];
  const auto is = [&](auto... names) { return ((label == names) || ...); };
  if (lane == "fault") return {t, label, kFault};
  if (lane == "flight") return {t, label, kState};
  if (lane == "target" && is("tracking")) return {t, "target seen", kVerdict};
  if (lane == "target" && is("occluded", "lost")) return {t, "target " + label, kLoss};
  if (lane == "pose" && is("degraded", "lost")) return {t, "pose " + label, kLoss};
  if (lane == "verdict" && !is("chase", "wider", "wait")) return {t, "plan: " + label, kVerdict};
  return {t, "", kMiddle};
}

/// Gives each moment the first image from then on, and its box when TARGET tells it.
class ImageFinder {
 public:
  ImageFinder(int64_t origin, const std::vector<Moment>& moments)
      : origin_(origin), moments_(moments) {}

  void Add(const LogEvent& e) {
    clock_.Add(e);
    AddImage(e);
    AddTarget(e);
  }
  Json Take() { return std::move(found_); }

 private:
  void AddImage(const LogEvent& e) {
    if (next_ == moments_.size()) return;
    camera_image_t m;
    if (!Good(e, "CAMERA_IMAGE", &m)) return;
    const double t = bus::Seconds(clock_.Settled(m.utime), origin_);
    while (next_ < moments_.size() && t > moments_[next_].t + kLongest) ++next_;
    if (next_ == moments_.size() || t < moments_[next_].t) return;
    const std::string jpeg = Jpeg(m, kQuality);
    if (!jpeg.empty()) {
      of_utime_[m.utime] = found_.size();
      found_.push_back({{"t", std::round(t * 1e3) / 1e3},
                        {"label", moments_[next_].label},
                        {"width", m.width},
                        {"height", m.height},
                        {"jpeg", Base64(jpeg)}});
    }
    ++next_;
  }

  void AddTarget(const LogEvent& e) {
    target_t m;
    if (of_utime_.empty() || !Good(e, "TARGET", &m)) return;
    const auto image = of_utime_.find(m.utime);
    if (image == of_utime_.end()) return;
    Json& moment = found_[image->second];
    moment["state"] = m.state;
    if (m.box_px[2] > 0.0) moment["box"] = m.box_px;
  }

  LogClock clock_;
  int64_t origin_;
  const std::vector<Moment>& moments_;
  size_t next_ = 0;
  Json found_ = Json::array();
  std::map<int64_t, size_t> of_utime_;  // place of an image in found_
};

}  // namespace

std::vector<Moment> KeyMoments(const Json& spans, std::vector<Moment> others) {
  double first = 1e300, last = -1e300;
  std::map<std::string, std::string> labels;  // the last of each lane
  for (const Json& span : spans) {
    first = std::min(first, span["from"].get<double>());
    last = std::max(last, span["to"].get<double>());
    const Moment moment = MomentOf(span);
    const std::string lane = span["lane"], label = span["label"];
    const bool same = lane == "flight" && labels[lane] == label;  // for another reason
    labels[lane] = label;
    if (!moment.label.empty() && !same) others.push_back(moment);
  }
  if (first <= last) {
    others.push_back({0.5 * (std::max(first, 0.0) + last), "midway", kMiddle});
    others.push_back({last - kApart, "at the end", kMiddle});
  }
  std::stable_sort(others.begin(), others.end(), [](const Moment& a, const Moment& b) {
    return std::pair(a.rank, a.t) < std::pair(b.rank, b.t);
  });
  std::vector<Moment> kept;
  for (const Moment& m : others) {
    const bool near = std::any_of(kept.begin(), kept.end(),
                                  [&](const Moment& k) { return std::abs(k.t - m.t) < kApart; });
    if (!near && kept.size() < kMost) kept.push_back(m);
  }
  std::sort(kept.begin(), kept.end(), [](const Moment& a, const Moment& b) { return a.t < b.t; });
  return kept;
}

Json ImagesAt(const std::string& log, int64_t origin, const std::vector<Moment>& moments) {
  LogReader reader(log);
  ImageFinder finder(origin, moments);
  for (LogEvent e; reader.Next(&e);) finder.Add(e);
  return finder.Take();
}

}  // namespace chase::logs
