#include <gtest/gtest.h>

#include <filesystem>

#include "common/bus/log_writer.h"
#include "common/logs/log_reader.h"
#include "lcmtypes/lcm_texts.h"
#include "logs/src/message_fields.h"
#include "logs/src/migrate.h"

namespace chase::logs {
namespace {

using Doubles = std::vector<double>;

/// What the first version's messages became next, as far as there are rules.
constexpr char kNext[] = R"(
  struct input_t { string channel; int32_t seq; }
  struct polynomial_t {
    int64_t utime; double duration; int32_t n_coefficients; double coefficients[n_coefficients]; }
  struct imu_t { int64_t utime; int32_t seq; string sender; string vehicle; int64_t sender_start;
    int32_t n_inputs; input_t inputs[n_inputs]; double accel[3]; double gyro[3]; }
  struct status_t { int64_t utime; int32_t seq; string sender; string name; }
  struct obstacle_t { int32_t id; polynomial_t center; double shape[6]; int8_t solid;
    double half[3]; double orientation[4]; double position_covariance[6];
    double velocity_covariance[6]; double existence; }
  struct obstacles_t { int64_t utime; int32_t seq; string sender;
    int32_t n_obstacles; obstacle_t obstacles[n_obstacles]; }
  struct target_t { int64_t utime; int8_t state; double existence; }
  struct prediction_t { int64_t utime; int8_t verdict; double existence;
    double velocity_covariance[9]; }
  struct attitude_setpoint_t { int64_t utime; double orientation[4]; int8_t motors; }
  struct pose_t { int64_t utime; double covariance[81]; double local_covariance[81]; }
  struct proof_t { double from; }
  struct plan_t { int64_t utime; polynomial_t position; double certified_clearance;
    int32_t n_proofs; proof_t proofs[n_proofs]; polynomial_t stop; })";

const std::string& First() {
  static const std::string text = LcmHistory().at(0);
  return text;
}
const Schema& Old() {
  static const Schema schema(First());
  return schema;
}
const Schema& Next() {
  static const Schema schema(kNext);
  return schema;
}

Record Blank(const std::string& type) { return Zero(Old(), *Old().Find(type)); }

Bytes Wire(const std::string& type, const Record& record) {
  const Struct& s = *Old().Find(type);
  const std::string text =
      BigEndian(static_cast<uint64_t>(Old().Fingerprint(s)), 8) + Encode(Old(), s, record);
  return Bytes(text.begin(), text.end());
}

/// The message as the next version has it.
Record Migrated(const std::string& channel, const std::string& type, const Record& old) {
  const Migrator migrator(kNext, {First()});
  Bytes bytes = Wire(type, old);
  EXPECT_EQ(migrator.Migrate(channel, &bytes), Fate::kMigrated);
  return Decode(Next(), *Next().Find(type), std::string(bytes.begin() + 8, bytes.end()));
}

Doubles Numbers(const Record& record, const std::string& member) {
  return record.Find(member)->Numbers();
}

TEST(MigrateRules, TheSenderIsTheChannelsFirstProcess) {
  Record imu = Blank("imu_t");
  imu.Set("gyro", {1.0, 2.0, 3.0});
  const Record out = Migrated("IMU", "imu_t", imu);
  EXPECT_EQ(out.Find("sender")->Text(), "fcu");
  EXPECT_EQ(out.Find("vehicle")->Text(), "");
  EXPECT_EQ(out.Number("sender_start"), 0.0);
  EXPECT_EQ(out.Number("n_inputs"), 0.0);
  EXPECT_EQ(Numbers(out, "gyro"), Doubles({1.0, 2.0, 3.0}));
  EXPECT_EQ(Migrated("MY_IMU", "imu_t", imu).Find("sender")->Text(), "");
  EXPECT_EQ(Migrated("_STATUS", "imu_t", imu).Find("sender")->Text(), "");
  EXPECT_EQ(Migrated("PLANNING_STATUS", "status_t", Blank("status_t")).Find("sender")->Text(),
            "planning");
  EXPECT_EQ(Migrated("OBSTACLES", "obstacles_t", Blank("obstacles_t")).Find("sender")->Text(),
            "mapping");
}

TEST(MigrateRules, AnObstaclesVariancesBecomeCovariances) {
  Record obstacle = Blank("obstacle_t");
  obstacle.Set("id", {12.0});
  obstacle.Set("position_variance", {0.25});
  obstacle.Set("velocity_variance", {4.0});
  Record list = Blank("obstacles_t");
  list.Set("n_obstacles", {1.0});
  list.values.at("obstacles").records = {obstacle};
  const Record out = Migrated("OBSTACLES", "obstacles_t", list);
  ASSERT_EQ(out.Find("obstacles")->records.size(), 1U);
  const Record& now = out.Find("obstacles")->records[0];
  EXPECT_EQ(now.Number("id"), 12.0);
  EXPECT_EQ(Numbers(now, "position_covariance"), Doubles({0.25, 0, 0, 0.25, 0, 0.25}));
  EXPECT_EQ(Numbers(now, "velocity_covariance"), Doubles({4, 0, 0, 4, 0, 4}));
  EXPECT_EQ(Numbers(now, "solid"), Doubles({0}));
  EXPECT_EQ(Numbers(now, "half"), Doubles({0, 0, 0}));
  EXPECT_EQ(Numbers(now, "orientation"), Doubles({1, 0, 0, 0}));
  EXPECT_EQ(now.Number("existence"), 1.0);
}

TEST(MigrateRules, WhatWasSeenOrForecastExists) {
  const Doubles of_state = {0, 1, 1, 0}, of_verdict = {1, 1, 0};
  for (size_t state = 0; state < of_state.size(); ++state) {
    Record target = Blank("target_t");
    target.Set("state", {static_cast<double>(state)});
    EXPECT_EQ(Migrated("TARGET", "target_t", target).Number("existence"), of_state[state]);
  }
  for (size_t verdict = 0; verdict < of_verdict.size(); ++verdict) {
    Record prediction = Blank("prediction_t");
    prediction.Set("verdict", {static_cast<double>(verdict)});
    prediction.Set("velocity_covariance", Doubles(9, 2.0));
    const Record out = Migrated("PREDICTION", "prediction_t", prediction);
    EXPECT_EQ(out.Number("existence"), of_verdict[verdict]);
    EXPECT_EQ(Numbers(out, "velocity_covariance"),
              Doubles(9, 2.0));  // the obstacle's rule is its own
  }
}

TEST(MigrateRules, TheMotorsWereOnAndTheAttitudeStays) {
  Record setpoint = Blank("attitude_setpoint_t");
  setpoint.Set("orientation", {0.6, 0.8, 0.0, 0.0});
  const Record out = Migrated("ATTITUDE_SETPOINT", "attitude_setpoint_t", setpoint);
  EXPECT_EQ(out.Number("motors"), 1.0);
  EXPECT_EQ(Numbers(out, "orientation"), Doubles({0.6, 0.8, 0.0, 0.0}));
}

TEST(MigrateRules, APlanIsNotCertifiedAndHasNoStop) {
  Record plan = Blank("plan_t");
  Record& position = plan.values.at("position").records.at(0);
  position.Set("utime", {1234567890123456.0});
  position.Set("coefficients", {1, 2, 3, 10, 20, 30});
  const Record out = Migrated("PLAN", "plan_t", plan);
  EXPECT_LT(out.Number("certified_clearance"), 0.0);
  EXPECT_EQ(out.Find("stop")->records.at(0).Number("n_coefficients"), 0.0);
  EXPECT_TRUE(out.Find("proofs")->records.empty());
  const Record& now = out.Find("position")->records.at(0);
  EXPECT_EQ(now.Find("utime")->Integer(), 1234567890123456);
  EXPECT_EQ(Numbers(now, "coefficients"), Doubles({1, 2, 3, 10, 20, 30}));
}

TEST(MigrateRules, APosesLocalCovarianceIsTheWhole) {
  Record pose = Blank("pose_t");
  Doubles covariance(81);
  for (size_t i = 0; i < covariance.size(); ++i) covariance[i] = 0.1 * static_cast<double>(i);
  pose.Set("covariance", covariance);
  EXPECT_EQ(Numbers(Migrated("POSE", "pose_t", pose), "local_covariance"), covariance);
}

/// The first version's channels, each with a message of zeros.
const std::vector<std::pair<std::string, std::string>> kChannels = {
    {"LIDAR_SCAN", "lidar_scan_t"},
    {"CAMERA_IMAGE", "camera_image_t"},
    {"IMU", "imu_t"},
    {"POSE", "pose_t"},
    {"SCAN_REGISTERED", "scan_registered_t"},
    {"OBSTACLES", "obstacles_t"},
    {"MAP", "map_t"},
    {"TARGET", "target_t"},
    {"PREDICTION", "prediction_t"},
    {"PLAN", "plan_t"},
    {"ATTITUDE_SETPOINT", "attitude_setpoint_t"},
    {"TRUTH", "truth_t"},
    {"SCENARIO", "scenario_t"},
    {"FAULT", "event_t"},
    {"PLANNING_STATUS", "status_t"},
};

TEST(MigrateLog, TheFirstVersionsMessagesAreReadToday) {
  const auto folder = std::filesystem::path(::testing::TempDir());
  const std::string in = folder / "chase_migrate_in.lcm", out = folder / "chase_migrate_out.lcm";
  bus::LogWriter writer(in);
  int64_t utime = 1000;
  for (const auto& [channel, type] : kChannels)
    writer.Write(utime++, channel, Wire(type, Blank(type)));
  writer.Write(utime++, "THEIRS", Bytes(12, 0x55));
  writer.Write(utime++, "SHORT", Bytes(3, 0x55));
  writer.Close();

  const Migration migration = MigrateLog(in, out);
  LogReader log(out);
  utime = 1000;
  LogEvent e;
  for (const auto& [channel, type] : kChannels) {
    ASSERT_TRUE(log.Next(&e));
    EXPECT_EQ(e.channel, channel);
    EXPECT_EQ(e.utime, utime++);
    EXPECT_EQ(TypeOf(e.bytes), type);
    EXPECT_TRUE(FieldsOf(e.bytes).has_value()) << channel;  // by the generated decoder
  }
  ASSERT_TRUE(log.Next(&e));
  EXPECT_EQ(e.channel, "THEIRS");
  EXPECT_EQ(e.bytes, Bytes(12, 0x55));
  EXPECT_FALSE(log.Next(&e));
  const std::string text = Format(migration);
  EXPECT_NE(text.find("THEIRS               1 of a type that no version had, copied unchanged\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("SHORT                1 malformed, left out\n"), std::string::npos) << text;
  EXPECT_FALSE(std::filesystem::exists(out + ".tmp"));
}

TEST(MigrateLog, FailsWithALineAndLeavesNothing) {
  const auto folder = std::filesystem::path(::testing::TempDir());
  const std::string in = folder / "chase_migrate_none.lcm", out = folder / "chase_migrate_no.lcm";
  std::filesystem::remove(in);
  EXPECT_THROW(MigrateLog(in, out), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_FALSE(std::filesystem::exists(out + ".tmp"));
}

}  // namespace
}  // namespace chase::logs
