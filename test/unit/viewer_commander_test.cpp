#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "chase/command_t.hpp"
#include "services/viewer/commander.h"
#include "services/viewer/token_file.h"
#include "test/unit/viewer_memory_bus.h"

namespace chase::viewer {
namespace {

constexpr const char* kToken = "a token of the test";

/// A commander, a bus that keeps what is sent, and what was answered.
struct Desk {
  explicit Desk(const std::string& token = kToken, bool live = true)
      : commander(
            bus, token, live,
            [this](const Request& request, const std::string& refusal, const std::string& words) {
              replies.push_back(request.command + "|" + refusal + "|" + words);
            }) {
    bus.SetIdentity({"viewer", "", 7});
  }
  void Ask(const std::string& text, double run = 0.2) {
    if (const auto request = ParseRequest(text); request && !request->command.empty())
      commander.Take(*request);
    Run(run);
  }
  void Ask(const std::string& command, const std::string& token, double run = 0.2) {
    Ask(R"({"command": ")" + command + R"(", "token": ")" + token + R"(", "utime": )" +
            std::to_string(bus.now) + "}",
        run);
  }
  void Run(double seconds) {
    for (const int64_t end = bus.now + std::llround(seconds * 1e6); bus.now < end;) {
      bus.now += kSecond / 10;
      commander.Turn();
    }
  }
  std::vector<command_t> Sent() {
    std::vector<command_t> out;
    for (const auto& bytes : bus.sent["COMMAND"])
      out.emplace_back().decode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return out;
  }
  command_ack_t AckOf(const command_t& command, bool accepted, const std::string& reason) {
    command_ack_t ack{};
    ack.command_sender = command.sender;
    ack.command_start = command.sender_start;
    ack.id = command.id;
    ack.verdict = accepted ? command_ack_t::ACCEPTED : command_ack_t::REFUSED;
    ack.reason = reason;
    return ack;
  }

  MemoryBus bus;
  std::vector<std::string> replies;
  Commander commander;
};

TEST(ViewerCommands, WithoutTheTokenNothingIsSent) {
  Desk off(""), on, playing(kToken, false);
  off.Ask("land", "");
  off.Ask("land", kToken);
  for (const std::string& token : {std::string(), std::string("a token of the tesT"),
                                   std::string(kToken) + " ", std::string("a token")})
    on.Ask("land", token);
  on.Ask("explode", kToken);
  on.Ask("Land", kToken);
  playing.Ask("land", kToken);
  std::mt19937 random(3);
  const std::string good =
      R"({"command": "land", "token": "a token of the tesT", "utime": 100000000})";
  for (int i = 0; i < 2000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random() % 256);
    on.Ask(text);
  }
  for (Desk* desk : {&off, &on, &playing}) {
    EXPECT_TRUE(desk->bus.sent.empty());
    EXPECT_EQ(desk->commander.taken(), 0);
  }
  EXPECT_EQ(off.replies.size(), 2U);
  EXPECT_EQ(playing.replies, std::vector<std::string>{"land|a log is played: nobody flies|"});
}

TEST(ViewerCommands, WhatWasGivenLongAgoIsRefused) {
  Desk desk;
  Request request = *ParseRequest(R"({"command": "takeoff", "token": "a token of the test"})");
  for (const double age : {30.0, 2.1, -5.0}) {
    request.utime = desk.bus.now - std::llround(age * 1e6);
    desk.commander.Take(request);
  }
  desk.Run(0.2);
  EXPECT_TRUE(desk.bus.sent.empty());
  EXPECT_EQ(desk.replies,
            (std::vector<std::string>{"takeoff|given 30.0 s ago|", "takeoff|given 2.1 s ago|",
                                      "takeoff|given -5.0 s ago|"}));
  request.utime = desk.bus.now - 2 * kSecond;
  desk.commander.Take(request);
  desk.Run(0.2);
  EXPECT_FALSE(desk.bus.sent.empty());
}

TEST(ViewerCommands, WithoutATimeAndToRestTheyAreNeverLate) {
  for (const char* command : {"takeoff", "stop", "hold"}) {
    Desk desk;
    Request request = *ParseRequest(R"({"command": ")" + std::string(command) +
                                    R"(", "token": "a token of the test"})");
    if (command != std::string("takeoff")) request.utime = desk.bus.now - 30 * kSecond;
    desk.commander.Take(request);
    desk.Run(0.2);
    EXPECT_FALSE(desk.bus.sent.empty()) << command;
  }
}

TEST(ViewerCommands, IsSentUntilItIsAnsweredAndAnsweredOnce) {
  Desk desk;
  desk.Ask("hold", kToken);
  desk.Run(0.5);
  const std::vector<command_t> sent = desk.Sent();
  ASSERT_GE(sent.size(), 5U);
  for (const command_t& m : sent) {
    EXPECT_EQ(m.kind, +command_t::HOLD);
    EXPECT_EQ(m.sender, "viewer");
    EXPECT_EQ(m.sender_start, 7);
    EXPECT_EQ(m.id, sent[0].id);
    EXPECT_EQ(m.utime, sent[0].utime);
  }
  command_ack_t other = desk.AckOf(sent[0], true, "another process's");
  other.command_sender = "command";
  desk.commander.Hear(other);
  desk.Run(0.1);
  EXPECT_TRUE(desk.replies.empty());
  for (int i = 0; i < 3; ++i) desk.commander.Hear(desk.AckOf(sent[0], true, "HOLD: as commanded"));
  desk.Run(0.1);
  desk.commander.Hear(desk.AckOf(sent[0], false, "late"));
  const size_t settled = desk.Sent().size();
  desk.Run(1.0);
  EXPECT_EQ(desk.Sent().size(), settled);
  EXPECT_EQ(desk.replies, std::vector<std::string>{"hold||HOLD: as commanded"});
  EXPECT_EQ(desk.commander.taken(), 1);
}

TEST(ViewerCommands, EachGetsItsOwnAnswer) {
  Desk desk;
  desk.Ask("takeoff", kToken);
  desk.Ask("chase", kToken);
  command_t takeoff, chase;
  for (const command_t& m : desk.Sent()) (m.kind == command_t::TAKEOFF ? takeoff : chase) = m;
  EXPECT_NE(takeoff.id, chase.id);
  desk.commander.Hear(desk.AckOf(chase, false, "it is on the ground"));
  desk.Run(0.1);
  EXPECT_EQ(desk.replies,
            std::vector<std::string>{"chase|it is on the ground|it is on the ground"});
  desk.Run(6.0);
  ASSERT_EQ(desk.replies.size(), 2U);
  EXPECT_EQ(desk.replies[1], "takeoff|no answer; does chase-mission run?|");
  for (int i = 0; i < 20; ++i) desk.Ask("stop", kToken, 0.0);
  EXPECT_EQ(desk.commander.refused(), 2 + 12) << "of twenty at once eight are under way";
  Request other = *ParseRequest(R"({"command": "stop", "token": "a token of the test"})");
  other.caller = 2;
  desk.commander.Take(other);
  EXPECT_EQ(desk.commander.refused(), 2 + 12) << "another client's is none of them";
}

TEST(ViewerCommands, TokenFile) {
  const auto file =
      std::filesystem::temp_directory_path() / ("token_" + std::to_string(::getpid()));
  const auto read = [&](const std::string& text) {
    std::ofstream(file) << text;
    return TokenIn(file);
  };
  EXPECT_EQ(read("0123456789\n"), "0123456789");
  EXPECT_EQ(read("  with blanks \r\nmore\n"), "with blanks");
  for (const char* bad : {"", "\n0123456789", "  \n", "short\n"})
    EXPECT_THROW(read(bad), std::runtime_error) << bad;
  std::filesystem::remove(file);
  EXPECT_THROW(TokenIn(file), std::runtime_error);
}

}  // namespace
}  // namespace chase::viewer
