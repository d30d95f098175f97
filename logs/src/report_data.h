#pragma once

#include <map>
#include <nlohmann/json.hpp>

#include "logs/src/metrics.h"
#include "logs/src/outlines.h"
#include "logs/src/vehicle_report.h"

namespace chase::logs {

struct NamedValue {
  std::string name;
  double value;
};

/// The series that the report's pictures show, thinned to what an eye can see.
struct ReportData {
  struct Series {
    std::vector<double> t, value;
  };

  /// A stretch of time in one lane of the time line; a mark where it has no length.
  struct Span {
    std::string lane, label;
    double from, to;  ///< s
  };

  bool truth = true;  ///< else all is what the vehicle said
  std::string title;
  double desired_distance = 0.0;  ///< m
  int width_px = 376, height_px = 240;
  std::vector<Outline> solids, crowns, movers, perceived;
  Outline chaser, target, estimated;        ///< paths, open
  std::vector<Outline> predictions, plans;  ///< fans, open
  Series distance, clearance, visible, visible_share;
  Series certified;                   ///< clearance that the plan flown then certified, m
  std::vector<Span> spans;            ///< faults, from beginning to end; of the vehicle its states
  Series pixel_u, pixel_v;            ///< of frames with the target in the image
  std::vector<StageFigures> stages;   ///< slowest first
  std::vector<NamedValue> cpu_share;  ///< processor time over flight time, per cent
  // Of the vehicle alone.
  Outline geofence;                       ///< closed
  Series pose_sigma, target_sigma;        ///< standard deviation of the position, m
  Series tracking_error;                  ///< m
  std::map<std::string, Series> latency;  ///< by channel, ms
};

ReportData PrepareReport(const FlightRecord& record, const std::vector<SampleScore>& scores);

/// Of what the vehicle said, without truth.
ReportData PrepareReport(const VehicleReport& vehicle);

nlohmann::ordered_json ToJson(const ReportData& data);

}  // namespace chase::logs
