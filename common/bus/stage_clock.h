#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace chase::bus {

/// Wall time per named stage. Figures go to status messages and metrics, never into results.
class StageClock {
 public:
  struct Summary {
    long count = 0;
    double mean_ms = 0, p50_ms = 0, p99_ms = 0, max_ms = 0;
  };

  /// Adds the time between its construction and its destruction.
  class Scope {
   public:
    Scope(std::vector<float>* sink) : sink_(sink), start_(std::chrono::steady_clock::now()) {}
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    /// Forgets this measurement: there was nothing to do.
    void Cancel() { sink_ = nullptr; }
    ~Scope() {
      if (sink_ == nullptr) return;
      const std::chrono::duration<float, std::milli> d = std::chrono::steady_clock::now() - start_;
      sink_->push_back(d.count());
    }

   private:
    std::vector<float>* sink_;
    std::chrono::steady_clock::time_point start_;
  };

  Scope Measure(const std::string& stage) { return Scope(&samples_ms_[stage]); }
  std::map<std::string, Summary> Summaries() const;

 private:
  std::map<std::string, std::vector<float>> samples_ms_;
};

}  // namespace chase::bus
