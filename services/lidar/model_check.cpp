#include "services/lidar/model_check.h"

#include <cmath>
#include <cstdio>

namespace chase::lidar {
namespace {

constexpr double kHourUs = 3600e6;
constexpr double kToleranceUs = 20.0;
constexpr double kHdl32IntervalUs = 12 * 46.08;
constexpr int kOddIntervalsToRefuse = 50;

double ExpectedIntervalUs(const uint8_t* data) {
  const bool dual = static_cast<ReturnMode>(data[1204]) == ReturnMode::kDual;
  return kBlocks * kBlockPeriod * 1e6 / (dual ? 2.0 : 1.0);
}

double BlockStepDeg(const uint8_t* data) {
  const auto azimuth = [data](size_t block) {
    return data[100 * block + 2] | (data[100 * block + 3] << 8);
  };
  return ((azimuth(kBlocks - 1) - azimuth(0) + 36000) % 36000) * 0.01 / (kBlocks - 1);
}

bool Near(double a, double b) { return std::abs(a - b) < kToleranceUs; }

const char* OtherProduct(uint8_t product) {
  switch (product) {
    case 0x24:
      return "Puck Hi-Res (VLP-16 Hi-Res)";
    case 0x28:
      return "VLP-32C";
    case 0xA1:
      return "VLS-128";
    default:
      return nullptr;
  }
}

std::string Evidence(const uint8_t* data, double interval_us) {
  char text[200];
  std::snprintf(text, sizeof text,
                "packets are %.0f us apart (a VLP-16's %.0f us), the azimuth advances %.2f degrees "
                "a block and the product byte is 0x%02x",
                interval_us, ExpectedIntervalUs(data), BlockStepDeg(data), data[1205]);
  return text;
}

}  // namespace

ModelCheck::Verdict ModelCheck::Refuse(const std::string& what) {
  reason_ = what;
  return verdict_ = Verdict::kOther;
}

ModelCheck::Verdict ModelCheck::JudgeInterval(const uint8_t* data, double interval_us) {
  if (Near(interval_us, ExpectedIntervalUs(data))) return verdict_ = Verdict::kVlp16;
  if (Near(interval_us, kHdl32IntervalUs) || Near(interval_us, kHdl32IntervalUs / 2))
    return Refuse("these packets are an HDL-32E's, not a VLP-16's: " + Evidence(data, interval_us) +
                  "; its 32 lasers would decode to wrong elevations");
  if (++odd_intervals_ < kOddIntervalsToRefuse) return verdict_;
  return Refuse("no VLP-16 sends packets like these: " + Evidence(data, interval_us));
}

ModelCheck::Verdict ModelCheck::Add(const uint8_t* data) {
  if (verdict_ != Verdict::kUndecided) return verdict_;
  if (const char* product = OtherProduct(data[1205]))
    return Refuse(std::string("these packets are a ") + product + "'s, not a VLP-16's");
  const uint32_t stamp = PacketStamp(data);
  double interval = static_cast<double>(stamp) - static_cast<double>(last_stamp_us_);
  if (interval < 0) interval += kHourUs;
  const bool has_last = has_last_;
  has_last_ = true;
  last_stamp_us_ = stamp;
  return has_last ? JudgeInterval(data, interval) : verdict_;
}

}  // namespace chase::lidar
