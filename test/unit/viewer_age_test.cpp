// What a page is told while nothing comes: nothing yet, or nothing any more.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/viewer/page_feed.h"
#include "test/unit/viewer_memory_bus.h"

namespace chase::viewer {
namespace {

using nlohmann::json;

/// Keeps the newest text of each part.
struct Sink : PageSink {
  void Send(Part part, std::string bytes, bool binary) override {
    if (!binary) told[part] = json::parse(bytes);
  }
  void Retain(Part part, std::string bytes) override { told[part] = json::parse(bytes); }
  bool Wanted(Part) const override { return true; }
  std::map<Part, json> told;
};

TEST(ViewerAge, AStateIsToldBeforeAnythingIsHeard) {
  MemoryBus bus;
  Sink sink;
  PageFeed feed(bus, sink, ViewerConfig(), "");
  feed.Tick(bus.now, "");
  EXPECT_EQ(sink.told.count(Part::kState), 1U) << "a page cannot tell this from a dead link";
}

}  // namespace
}  // namespace chase::viewer
