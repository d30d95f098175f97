#include "score.h"

#include <algorithm>
#include <cmath>

namespace chase::perception_stage {

namespace {

using perception::TargetState;

constexpr double kSettle = 0.5;  // s before frames count
constexpr double kWrong = 0.5;   // m off the target: another thing
constexpr double k95 = 7.815;    // 95 % of chi square with 3 degrees of freedom
constexpr double kHalf = 0.5;    // share of the target that counts as seen

double Share(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
}

bool Detected(const Outcome& o) {
  return o.estimate.state == TargetState::kTracking && o.estimate.box.width > 0.0;
}

double Error(const Outcome& o) { return (o.estimate.p_WT - o.truth).norm(); }

double Nees(const Outcome& o) {
  const Eigen::Vector3d e = o.estimate.p_WT - o.truth;
  return e.dot(o.estimate.covariance.ldlt().solve(e));
}

}  // namespace

void Score::AddFrame(const Outcome& o) {
  ms_.push_back(o.milliseconds);
  const double existence = o.estimate.Existence();
  Bin& bin = reliability_[std::min<size_t>(9, static_cast<size_t>(10.0 * existence))];
  bin.frames += 1.0;
  bin.expected += existence;
  bin.there += Error(o) < kWrong;
  lost_ += o.estimate.state == TargetState::kLost;
  if (o.t > kSettle && o.visible_share >= kHalf && o.range >= 2.0 && o.range <= 8.0) {
    ++visible_;
    recalled_ += Detected(o) && Error(o) < kWrong;
  }
  if (Detected(o)) {
    ++tracked_;
    wrong_ += Error(o) > kWrong;
  }
  if (o.estimate.state == TargetState::kOccluded) {
    ++hidden_;
    hidden_nees_ += Nees(o);
    hidden_inside_ += Nees(o) < k95;
  }
  if (!Detected(o) || o.range < 2.0 || o.range > 6.0) return;
  errors_.push_back(Error(o));
  nees_ += Nees(o);
  inside_ += Nees(o) < k95;
}

/// Full occlusions of a target that was being followed: until it is said, and from half of the
/// target being back until it is found.
void Score::AddOcclusions(const std::vector<Outcome>& flight) {
  for (size_t i = 1; i < flight.size(); ++i) {
    if (flight[i].visible_share > 0.0 || flight[i - 1].visible_share <= 0.0) continue;
    const bool followed = flight[i - 1].estimate.state == TargetState::kTracking;
    size_t end = i;
    while (end < flight.size() && flight[end].visible_share <= 0.0) ++end;
    if (!followed || end - i < 4) continue;
    size_t said = i;
    while (said < flight.size() && flight[said].estimate.state == TargetState::kTracking) ++said;
    said_.push_back(flight[std::min(said, flight.size() - 1)].t - flight[i].t);
    size_t back = end;
    while (back < flight.size() && flight[back].visible_share < kHalf &&
           flight[back].visible_share > 0.0)
      ++back;
    if (back + 8 >= flight.size() || flight[back].visible_share < kHalf) continue;
    size_t found = end;
    while (found < flight.size() && !Detected(flight[found])) ++found;
    if (found == flight.size()) --found;
    found_.push_back(std::max(0.0, flight[found].t - flight[back].t));
    wrong_after_ += Error(flight[found]) > kWrong;
  }
}

void Score::Add(const std::vector<Outcome>& flight) {
  for (const auto& o : flight) AddFrame(o);
  AddOcclusions(flight);
}

double Score::recall() const { return Share(recalled_, visible_); }
double Score::precision() const { return 1.0 - Share(wrong_, tracked_); }
double Score::rms() const {
  double sum = 0.0;
  for (double e : errors_) sum += e * e;
  return std::sqrt(Share(sum, static_cast<double>(errors_.size())));
}
double Score::p99() const { return Quantile(errors_, 0.99); }
double Score::nees() const { return Share(nees_, static_cast<double>(errors_.size())); }
double Score::coverage() const { return Share(inside_, static_cast<double>(errors_.size())); }
double Score::hidden_nees() const { return Share(hidden_nees_, hidden_); }
double Score::hidden_coverage() const { return Share(hidden_inside_, hidden_); }
double Score::calibration_error() const {
  double sum = 0.0;
  for (const Bin& b : reliability_) sum += std::abs(b.expected - b.there);
  return Share(sum, frames());
}
double Score::ms_p50() const { return Quantile(ms_, 0.5); }
double Score::ms_p99() const { return Quantile(ms_, 0.99); }
double Score::said_max() const { return Quantile(said_, 1.0); }
double Score::found_max() const { return Quantile(found_, 1.0); }
double Score::said_quantile(double share) const { return Quantile(said_, share); }
double Score::found_quantile(double share) const { return Quantile(found_, share); }

}  // namespace chase::perception_stage
