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

polynomial_t Constant() {
  polynomial_t p{};
  p.duration = 1.0;
  p.n_coefficients = 3;
  p.coefficients = {1, 2, 3};
  return p;
}

TEST(ViewerAge, WhatIsNotHeardAnyMoreIsStale) {
  MemoryBus bus;
  Sink sink;
  PageFeed feed(bus, sink, ViewerConfig(), "");
  const auto state = [&](double later) {
    bus.now += static_cast<int64_t>(later * kSecond);
    feed.Tick(bus.now, "");
    return sink.told[Part::kState];
  };
  EXPECT_FALSE(state(0.0).contains("obstacles")) << "never heard is not old";
  plan_t plan{};
  plan.position = Constant();
  prediction_t prediction{};
  prediction.verdict = prediction_t::OK;
  prediction.target = Constant();
  target_t target{};
  target.state = target_t::TRACKING;
  feed.Take(pose_t{});
  feed.Take(target);
  feed.Take(plan);
  feed.Take(prediction);
  feed.Take(obstacles_t{});
  feed.Take(flight_state_t{});
  feed.Take(tracking_t{});
  feed.Take(camera_image_t{});
  const json fresh = state(0.1), old = state(5.0);
  for (const char* part :
       {"drone", "target", "plan", "forecast", "obstacles", "flight", "tracking", "image"}) {
    EXPECT_EQ(fresh[part]["stale"], false) << part;
    EXPECT_EQ(old[part]["stale"], true) << part;
    EXPECT_EQ(old[part]["age"], 5.1) << part;
  }
  for (const int code : {5, 6, 7, 14}) {
    EXPECT_EQ(fresh["row"][code], code == 6 ? 1 : 0) << code;
    EXPECT_EQ(old["row"][code], -1) << code;
  }
  for (const int figure : {1, 2, 3, 8, 11}) {
    EXPECT_FALSE(fresh["row"][figure].is_null()) << figure;
    EXPECT_TRUE(old["row"][figure].is_null()) << figure;
  }
}

}  // namespace
}  // namespace chase::viewer
