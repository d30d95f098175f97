#pragma once

#include <string>

namespace chase::viewer {

/// What a page is told; only the newest of each waits for a slow one.
enum class Part { kHello, kState, kObstacles, kHealth, kReply, kCloud, kImage };

/// Takes what pages are told: a server's clients, or a recording for a report.
class PageSink {
 public:
  virtual ~PageSink() = default;
  /// To all pages. Hello, obstacles and health go to those that come later as well.
  virtual void Send(Part part, std::string bytes, bool binary) = 0;
  /// Only to those that come later.
  virtual void Retain(Part part, std::string bytes) = 0;
  /// Does any page want this part?
  virtual bool Wanted(Part part) const = 0;
};

}  // namespace chase::viewer
