// Writes the inputs that a fuzz target begins with: fuzz_corpus FLIGHT.lcm OUT. make_corpus calls
// it.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "chase/flight_state_t.hpp"
#include "common/bus/log_writer.h"
#include "common/config/config.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "common/logs/record.h"
#include "common/world/scenario.h"
#include "lcmtypes/lcm_texts.h"
#include "logs/src/message_fields.h"
#include "test/fuzz/service_configs.h"
#include "test/unit/fcu_random.h"
#include "test/unit/lidar_packets.h"

namespace {

using namespace chase;  // NOLINT(google-build-using-namespace)
using Bytes = std::vector<uint8_t>;
using Events = std::vector<logs::LogEvent>;

constexpr size_t kSmall = 2000;  // bytes of a message; larger ones are of two points instead
constexpr int64_t kElements = 2;
// What chase-mission hears, a little of it.
const std::vector<std::string> kMissionHears = {
    "COMMAND", "POSE", "TARGET", "TRACKING", "ATTITUDE_SETPOINT", "PLANNING_STATUS"};

std::filesystem::path out;

void Write(const std::string& target, const std::string& name, const Bytes& bytes) {
  std::filesystem::create_directories(out / target);
  std::ofstream file(out / target / name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<long>(bytes.size()));
}

Bytes ToBytes(const std::string& text) { return {text.begin(), text.end()}; }

Events ReadLog(const std::string& file) {
  logs::LogReader log(file);
  Events events;
  for (logs::LogEvent event; log.Next(&event);) events.push_back(event);
  return events;
}

/// A message with zeros in all fields, and two elements in each list.
Bytes ZeroMessage(const logs::Schema& schema, const logs::Struct& type) {
  logs::Record record = logs::Zero(schema, type);
  std::map<std::string, int64_t> lengths;
  for (const auto& member : type.members)
    for (const auto& dimension : member.dimensions)
      if (!dimension.fixed) lengths[dimension.text] = kElements;
  for (const auto& member : type.members)
    record.values.at(member.name) = logs::Zero(schema, member, lengths);
  for (const auto& [name, length] : lengths) record.Set(name, {static_cast<double>(length)});
  return ToBytes(logs::BigEndian(static_cast<uint64_t>(schema.Fingerprint(type)), 8) +
                 logs::Encode(schema, type, record));
}

/// The smallest small message of each type.
std::map<std::string, logs::LogEvent> Smallest(const Events& events) {
  std::map<std::string, logs::LogEvent> found;
  for (const auto& event : events) {
    if (event.bytes.size() > kSmall) continue;
    auto& kept = found[logs::TypeOf(event.bytes)];
    if (kept.bytes.empty() || event.bytes.size() < kept.bytes.size()) kept = event;
  }
  return found;
}

void WriteMessages(const std::map<std::string, logs::LogEvent>& smallest) {
  const logs::Schema schema(LcmToday());
  for (const auto& type : schema.structs()) {
    const Bytes zero = ZeroMessage(schema, type);
    if (logs::TypeOf(zero).empty()) continue;  // travels inside others only
    Write("messages", type.name + "_zero", zero);
    const auto flown = smallest.find(type.name);
    if (flown != smallest.end()) Write("messages", type.name, flown->second.bytes);
  }
}

/// FLIGHT_STATE as control tells it on HOME.
Bytes AsHome(const Bytes& state) {
  flight_state_t home{};
  home.decode(state.data(), 0, static_cast<int>(state.size()));
  home.sender = "control";
  Bytes bytes(static_cast<size_t>(home.getEncodedSize()));
  home.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// A record of fuzz_mission: five ticks, then the message.
void Append(const Bytes& message, Bytes* records) {
  const size_t size = message.size();
  const Bytes head = {5, static_cast<uint8_t>(size & 0xFF), static_cast<uint8_t>(size >> 8)};
  records->insert(records->end(), head.begin(), head.end());
  records->insert(records->end(), message.begin(), message.end());
}

/// Every command, and a few of what comes between; with `home` where that is, too.
void WriteMission(const std::string& name, const Events& events, bool home) {
  Bytes bytes;
  std::map<std::string, int> since;
  for (const auto& event : events) {
    const bool is_home = home && event.channel == "FLIGHT_STATE";
    if (!is_home && std::count(kMissionHears.begin(), kMissionHears.end(), event.channel) == 0)
      continue;
    if (event.channel != "COMMAND" && since[event.channel]++ % (is_home ? 50 : 1000) != 0) continue;
    Append(is_home ? AsHome(event.bytes) : event.bytes, &bytes);
  }
  Write("mission", name, bytes);
}

void WriteMavlink() {
  world::Random random(1);
  mavlink::FrameWriter writer(1, 1);
  mavlink::testing::ForEachType([&](auto type) {
    Bytes bytes = {0xFF};
    const auto message = mavlink::testing::RandomMessage<decltype(type)>(&random);
    const Bytes frame = writer.Write(1'800'000'000'000'000, message);
    bytes.insert(bytes.end(), frame.begin(), frame.end());
    Write("mavlink", "message_" + std::to_string(decltype(type)::kId), bytes);
  });
}

/// Two packets of each return mode, on either side of the turn's end.
void WriteVlp16() {
  for (const int mode : {0x37, 0x38, 0x39}) {
    Bytes bytes;
    for (const double azimuth : {356.0, 0.8}) {
      lidar::testing::PacketSpec spec;
      spec.azimuth_deg = azimuth;
      spec.mode = static_cast<uint8_t>(mode);
      spec.second_range = 20.0;
      spec.stamp_us = azimuth > 180.0 ? 1000 : 2327;
      const auto packet = lidar::testing::MakePacket(spec);
      bytes.insert(bytes.end(), packet.begin(), packet.end());
    }
    Write("vlp16", "mode_" + std::to_string(mode), bytes);
  }
}

void PutLittle(uint64_t value, int bytes, Bytes* to) {
  for (int i = 0; i < bytes; ++i) to->push_back(static_cast<uint8_t>(value >> 8 * i));
}

/// A classic capture of one datagram of 8 bytes to port 2368.
void WritePcap() {
  Bytes bytes;
  PutLittle(0xA1B2C3D4, 4, &bytes);  // microseconds, little endian
  PutLittle(0x00040002, 4, &bytes);  // version 2.4
  for (const uint64_t word : {0, 0, 65535, 1}) PutLittle(word, 4, &bytes);  // link: Ethernet
  for (const uint64_t word : {1, 2, 50, 50}) PutLittle(word, 4, &bytes);    // stamp, lengths
  const Bytes frame = {1,    2, 3, 4,  5, 6,  1, 2,  3,  4,  5, 6, 8,  0,   // Ethernet, IPv4
                       0x45, 0, 0, 36, 0, 0,  0, 0,  64, 17, 0, 0, 10, 0, 0, 1, 10, 0,
                       0,    2, 9, 64, 9, 64, 0, 16, 0,  0,  1, 2, 3,  4, 5, 6, 7,  8};
  bytes.insert(bytes.end(), frame.begin(), frame.end());
  Write("pcap", "datagram", bytes);
}

void WriteConfigs() {
  fuzz::ForEachConfig([](const char* name, const auto& config) {
    Write("config", name, ToBytes(std::string(name) + "\n" + config::Dump(config)));
  });
}

/// Every key of a scenario file.
void WriteScenario() {
  world::Scenario all;
  all.name = "all";
  all.world.walls.resize(1);
  all.world.boxes.resize(1);
  all.world.cylinders.resize(1);
  all.world.ellipsoids.resize(1);
  all.world.trees.resize(1);
  all.world.forest.count = 5;
  all.world.forest.max = {20.0, 20.0};
  all.movers.resize(2);
  for (auto& mover : all.movers) mover.waypoints = {{0, 0, 1}, {2, 0, 1}};
  all.movers[1].times = {1.0, 3.0};
  all.target.waypoints = {{0, 0}, {4, 0}, {4, 4}};
  all.target.stops.push_back({1, 2.0});
  all.faults.push_back({});
  all.faults.back().name = "gust";
  all.commands.push_back({"takeoff", -7.0});
  all.services.push_back({"planning", "horizon: 2.0"});
  Write("scenario", "all_keys", ToBytes(config::Dump(all)));
}

/// A log of one small message of each type; cut off in its last; with a hole in it.
void WriteLogs(const std::map<std::string, logs::LogEvent>& smallest) {
  const std::string file = out / "log" / "whole";
  std::filesystem::create_directories(out / "log");
  bus::LogWriter writer(file);
  for (const auto& [type, event] : smallest) writer.Write(event.utime, event.channel, event.bytes);
  writer.Close();
  std::ifstream in(file, std::ios::binary);
  Bytes bytes{std::istreambuf_iterator<char>(in), {}};
  Write("log", "cut", {bytes.begin(), bytes.end() - 9});
  std::fill_n(bytes.begin() + static_cast<long>(bytes.size() / 2), 64, uint8_t{0xED});
  Write("log", "damaged", bytes);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 1;
  out = argv[2];
  const Events events = ReadLog(argv[1]);
  const auto smallest = Smallest(events);
  WriteMessages(smallest);
  WriteMission("flight", events, false);
  WriteMission("begun_in_flight",
               {events.begin() + static_cast<long>(events.size() / 2), events.end()}, true);
  WriteMavlink();
  WriteVlp16();
  WritePcap();
  WriteConfigs();
  WriteScenario();
  WriteLogs(smallest);
  return 0;
}
