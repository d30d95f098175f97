#include "logs/src/migrate_rules.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "common/bus/channels.h"

namespace chase::logs {
namespace {

/// The first process that the channel table names; "PLANNING_STATUS": "planning".
void Sender(const Source& source, Value* value) {
  const std::string suffix = bus::StatusChannel("");
  std::string sender = source.channel;
  if (sender.size() > suffix.size() &&
      sender.compare(sender.size() - suffix.size(), suffix.size(), suffix) == 0) {
    sender.resize(sender.size() - suffix.size());
    std::transform(sender.begin(), sender.end(), sender.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return value->SetText(sender);
  }
  for (const bus::ChannelRow& row : bus::ChannelTable())
    if (row.channel == source.channel) value->SetText(row.sender.substr(0, row.sender.find(',')));
}

/// One variance for all axes, as xx xy xz yy yz zz.
void Isotropic(double variance, Value* value) {
  value->SetNumbers({variance, 0.0, 0.0, variance, 0.0, variance});
}
void PositionCovariance(const Source& source, Value* value) {
  Isotropic(source.old.Number("position_variance"), value);
}
void VelocityCovariance(const Source& source, Value* value) {
  Isotropic(source.old.Number("velocity_variance"), value);
}

void NoRotation(const Source&, Value* value) { value->SetNumbers({1.0, 0.0, 0.0, 0.0}); }
void One(const Source&, Value* value) { value->SetNumbers({1.0}); }

void TargetExistence(const Source& source, Value* value) {
  const double state = source.old.Number("state");
  const bool exists = state == 1.0 || state == 2.0;  // TRACKING, OCCLUDED
  value->SetNumbers({exists ? 1.0 : 0.0});
}
void PredictionExistence(const Source& source, Value* value) {
  value->SetNumbers({source.old.Number("verdict") == 2.0 ? 0.0 : 1.0});  // NO_TARGET
}

/// The map around knows no more of it than the world does.
void LocalCovariance(const Source& source, Value* value) {
  if (const Value* covariance = source.old.Find("covariance"))
    value->SetNumbers(covariance->Numbers());
}

void NotCertified(const Source&, Value* value) { value->SetNumbers({-1.0}); }

}  // namespace

Rule RuleFor(const std::string& type, const std::string& member) {
  static const std::map<std::string, Rule> rules = {
      {"obstacle_t.position_covariance", PositionCovariance},
      {"obstacle_t.velocity_covariance", VelocityCovariance},
      {"obstacle_t.orientation", NoRotation},
      {"obstacle_t.existence", One},
      {"target_t.existence", TargetExistence},
      {"prediction_t.existence", PredictionExistence},
      {"attitude_setpoint_t.motors", One},
      {"plan_t.certified_clearance", NotCertified},
      {"pose_t.local_covariance", LocalCovariance},
  };
  if (member == "sender") return Sender;  // of every message
  const auto it = rules.find(type + "." + member);
  return it == rules.end() ? nullptr : it->second;
}

}  // namespace chase::logs
