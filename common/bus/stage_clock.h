#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>

namespace chase::bus {

/// Wall time per named stage, in the same memory however long it runs. Figures go to status
/// messages and metrics, never into results.
class StageClock {
 public:
  /// Of all durations so far; percentiles to within 1.1 % between 10 ns and 43 s.
  struct Summary {
    long count = 0;
    double mean_ms = 0, p50_ms = 0, p99_ms = 0, max_ms = 0;
  };

  /// Counts of durations in bins of equal ratio, 2^(1/32): a bin's middle is off by 2^(1/64) - 1 =
  /// 1.1 % at most. What is shorter or longer counts in the first or last bin.
  class Histogram {
   public:
    void Add(double ms);
    Summary Summarise() const;

   private:
    static constexpr int kBinsPerOctave = 32, kOctaves = 32;
    static constexpr double kLeastMs = 1e-5;

    double Percentile(double share) const;

    std::array<int64_t, kBinsPerOctave * kOctaves> counts_{};
    long count_ = 0;
    double sum_ms_ = 0.0, max_ms_ = 0.0;
  };

  /// Adds the time between its construction and its destruction.
  class Scope {
   public:
    Scope(Histogram* sink) : sink_(sink), start_(std::chrono::steady_clock::now()) {}
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    /// Forgets this measurement: there was nothing to do.
    void Cancel() { sink_ = nullptr; }
    ~Scope() {
      if (sink_ == nullptr) return;
      const std::chrono::duration<double, std::milli> d = std::chrono::steady_clock::now() - start_;
      sink_->Add(d.count());
    }

   private:
    Histogram* sink_;
    std::chrono::steady_clock::time_point start_;
  };

  Scope Measure(const std::string& stage) { return Scope(&stages_[stage]); }
  std::map<std::string, Summary> Summaries() const;

 private:
  std::map<std::string, Histogram> stages_;
};

}  // namespace chase::bus
