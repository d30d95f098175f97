#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>

#include "chase/pose_t.hpp"
#include "chase/target_t.hpp"
#include "common/logs/log_reader.h"
#include "logs/src/diff.h"
#include "logs/src/export.h"
#include "logs/src/import.h"
#include "logs/src/info.h"
#include "logs/src/message_fields.h"
#include "logs/src/output.h"
#include "test/unit/logs_small_log.h"

namespace chase::logs {
namespace {

namespace fs = std::filesystem;
using testing::Encoded, testing::ErrorOf, testing::Obstacles, testing::ReadText, testing::Temp;
using testing::WriteLog, testing::WriteText;

const Field* Find(const std::vector<Field>& fields, const std::string& path) {
  for (const Field& f : fields)
    if (f.path == path) return &f;
  return nullptr;
}

TEST(MessageFields, NestedListsAreFlattenedInOrder) {
  const Bytes bytes = Encoded(Obstacles(2));
  EXPECT_EQ(TypeOf(bytes), "obstacles_t");
  const auto fields = FieldsOf(bytes);
  ASSERT_TRUE(fields);
  EXPECT_EQ(Find(*fields, "n_obstacles")->numbers, std::vector<double>({2}));
  EXPECT_EQ(Find(*fields, "obstacles.id")->numbers, std::vector<double>({10, 11}));
  EXPECT_EQ(Find(*fields, "obstacles.center.coefficients")->numbers,
            std::vector<double>({0, 2, 3, 1, 2, 3}));
  EXPECT_TRUE(Find(*fields, "obstacles.id")->is_list);
  EXPECT_FALSE(Find(*fields, "utime")->is_list);
}

TEST(MessageFields, PathsAreOfTheTypeNotOfWhatAMessageHolds) {
  const auto fields = FieldsOf(Encoded(Obstacles(2)));
  const auto all = PathsOf(Encoded(Obstacles(0)));
  EXPECT_EQ(PathsOf(Encoded(Obstacles(2))), all);
  for (const Field& f : fields.value())
    EXPECT_EQ(std::count(all.begin(), all.end(), f.path), 1) << f.path;
  EXPECT_EQ(std::count(all.begin(), all.end(), "inputs.seq"), 1);
  EXPECT_TRUE(PathsOf(Bytes(20, 7)).empty());
}

TEST(MessageFields, ForeignTruncatedAndNegativeLengthsAreRefused) {
  EXPECT_EQ(TypeOf({1, 2, 3}), "");
  EXPECT_EQ(TypeOf(Bytes(64, 7)), "");
  Bytes bytes = Encoded(Obstacles(2));
  for (size_t n = 8; n < bytes.size(); n += 7)
    EXPECT_FALSE(FieldsOf({bytes.begin(), bytes.begin() + static_cast<long>(n)}));
  std::fill(bytes.begin() + 20, bytes.begin() + 24, 0xff);  // n_obstacles = -1
  EXPECT_FALSE(FieldsOf(bytes));
}

/// Names of the fields that an .lcm file declares, in order.
std::vector<std::string> Declared(const std::string& lcm) {
  const std::string body =
      std::regex_replace(lcm.substr(lcm.find('{')), std::regex("//[^\n]*"), "");
  const std::regex field("(\\w+)\\s+(\\w+)\\s*(\\[\\w+\\])?\\s*;");
  std::vector<std::string> names;
  for (std::sregex_iterator at(body.begin(), body.end(), field), end; at != end; ++at)
    names.push_back((*at)[2]);
  return names;
}

TEST(FieldTables, ListEveryFieldOfEveryTypeInWireOrder) {
  const std::string tables = ReadText("common/logs/field_tables.h");
  const size_t begin = tables.find("{\n", tables.find("void VisitHead(")) + 2;
  const std::string head = tables.substr(begin, tables.find('}', begin) - begin);
  EXPECT_NE(head.find("n_inputs"), std::string::npos);
  int types = 0;
  for (const auto& entry : fs::directory_iterator("lcmtypes")) {
    if (entry.path().extension() != ".lcm") continue;
    std::string expected =
        "void VisitFields(const " + entry.path().stem().string() + "& m, V& v) {\n";
    std::string fields;
    for (const std::string& name : Declared(ReadText(entry.path().string())))
      fields += "  v(\"" + name + "\", m." + name + ");\n";
    if (fields.rfind(head, 0) == 0) fields = "  VisitHead(m, v);\n" + fields.substr(head.size());
    expected += fields;
    EXPECT_NE(tables.find(expected + "}"), std::string::npos) << entry.path();
    ++types;
  }
  EXPECT_GE(types, 19);
}

TEST(LogDiff, EqualLogsDoNotDiffer) {
  EXPECT_TRUE(Diff(WriteLog("a.lcm"), WriteLog("b.lcm"), {}).channels.empty());
}

TEST(LogDiff, OneChangedFieldIsFoundAndCanBeIgnored) {
  const std::string a = WriteLog("a.lcm");
  const std::string b = WriteLog("b.lcm", [](int k, imu_t* m) {
    if (k == 7) m->gyro[1] += 0.25;
  });
  const auto d = Diff(a, b, {}).channels;
  ASSERT_EQ(d.size(), 1u);
  const auto& field = d.at("IMU").fields.at("gyro");
  EXPECT_EQ(d.at("IMU").fields.size(), 1u);
  EXPECT_EQ(field.messages, 1);
  EXPECT_EQ(field.first, 7);
  EXPECT_DOUBLE_EQ(field.greatest, 0.25);
  EXPECT_NE(Format({d, {}, {}}).find("gyro"), std::string::npos);
  EXPECT_TRUE(Diff(a, b, {"IMU.gyro"}).channels.empty());
  EXPECT_TRUE(Diff(a, b, {"IMU"}).channels.empty());
  EXPECT_TRUE(Diff(a, b, {"I*.g*"}).channels.empty());
  EXPECT_FALSE(Diff(a, b, {"IMU.accel"}).channels.empty());
}

TEST(LogDiff, MissingMessagesAndShiftedStampsAreFound) {
  const auto fewer = Diff(WriteLog("a.lcm"), WriteLog("b.lcm", {}, 18), {}).channels;
  ASSERT_EQ(fewer.size(), 1u);
  EXPECT_EQ(fewer.at("IMU").count_a, 20);
  EXPECT_EQ(fewer.at("IMU").count_b, 18);
  const auto later =
      Diff(WriteLog("a.lcm"), WriteLog("b.lcm", [](int, imu_t* m) { m->utime++; }), {}).channels;
  EXPECT_EQ(later.at("IMU").fields.at("event_time").messages, 20);
  EXPECT_EQ(later.at("IMU").fields.at("utime").messages, 20);
}

TEST(LogDiff, NotANumberEqualsItself) {
  const auto nan = [](int, imu_t* m) { m->gyro[2] = NAN; };
  EXPECT_TRUE(Diff(WriteLog("a.lcm", nan), WriteLog("b.lcm", nan), {}).channels.empty());
  const auto d = Diff(WriteLog("a.lcm", nan), WriteLog("b.lcm"), {}).channels;
  EXPECT_TRUE(std::isinf(d.at("IMU").fields.at("gyro").greatest));
}

TEST(LogExport, TumHasOneLinePerPose) {
  const std::string log = Temp("pose.lcm"), out = Temp("pose.tum");
  OutputLog writer(log);
  pose_t pose{};
  pose.utime = 1'500'000;
  pose.pos[0] = 1.0;
  pose.pos[1] = -2.0;
  pose.orientation[0] = 0.6;
  pose.orientation[3] = 0.8;
  writer.Write(pose.utime, "POSE", pose);
  writer.Close();
  EXPECT_EQ(ExportTum(log, out), 1);
  EXPECT_EQ(ReadText(out),
            "1.500000 1.000000 -2.000000 0.000000 0.000000000 0.000000000 0.800000000 "
            "0.600000000\n");
  EXPECT_NE(ErrorOf([] { ExportTum(WriteLog("n.lcm"), Temp("n.tum")); }).find("no usable POSE"),
            std::string::npos);
}

TEST(LogExport, TumTakesTheVehicleThatTheLogHas) {
  const std::string log = Temp("vehicles.lcm"), out = Temp("vehicles.tum");
  OutputLog writer(log);
  pose_t pose{};
  writer.Write(1, "falcon_POSE", pose);
  writer.Write(2, "falcon_POSE", pose);
  target_t target{};
  target.state = target_t::TRACKING;
  writer.Write(3, "falcon_TARGET", target);
  writer.Write(4, "eagle_TARGET", target);
  writer.Close();
  EXPECT_EQ(ExportTum(log, out), 2);
  EXPECT_EQ(ExportTum(log, out, "falcon_TARGET"), 1);
  EXPECT_EQ(ErrorOf([&] { ExportTum(log, out, "TARGET"); }),
            log + ": holds TARGET of several vehicles; keep one with chase-log filter");
}

TEST(LogExport, CsvRowsLineUpWithTheHeader) {
  const std::string folder = Temp("csv");
  EXPECT_EQ(ExportCsv(WriteLog("c.lcm"), folder, ""), 2);
  for (const char* name : {"IMU.csv", "OBSTACLES.csv"}) {
    std::istringstream text(ReadText((fs::path(folder) / name).string()));
    std::string line;
    std::getline(text, line);
    const auto columns = std::count(line.begin(), line.end(), ',');
    int rows = 0;
    for (; std::getline(text, line); ++rows)
      EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns) << line;
    EXPECT_EQ(rows, std::string(name) == "IMU.csv" ? 20 : 4);
  }
  const std::string obstacles = ReadText((fs::path(folder) / "OBSTACLES.csv").string());
  EXPECT_NE(obstacles.find(",10 11 12,"), std::string::npos);
}

/// Walks the records of an MCAP file; logs_cli_test.py has npm's own reader read one.
TEST(LogExport, McapHoldsEveryMessageBetweenItsMagics) {
  const std::string out = Temp("m.mcap"), magic("\x89MCAP0\r\n", 8);
  EXPECT_EQ(ExportMcap(WriteLog("m.lcm"), out), 24);
  const std::string bytes = ReadText(out);
  ASSERT_EQ(bytes.substr(0, 8), magic);
  ASSERT_EQ(bytes.substr(bytes.size() - 8), magic);
  const auto number = [&](size_t at) {
    uint64_t v = 0;
    for (size_t i = 8; i-- > 0;) v = v << 8 | static_cast<uint8_t>(bytes[at + i]);
    return v;
  };
  std::map<int, int> records;
  uint64_t counted = 0;
  size_t at = 8;
  for (; at + 9 < bytes.size() - 8; at += 9 + number(at + 1)) {
    ++records[bytes[at]];
    if (bytes[at] == 11) counted = number(at + 9);
  }
  EXPECT_EQ(at, bytes.size() - 8);
  EXPECT_EQ(counted, 32u);  // OBSTACLES has a scene beside it, and one of grown shapes
  const std::map<int, int> expected = {{1, 1}, {2, 1}, {3, 4},  {4, 4}, {6, 1},
                                       {7, 4}, {8, 1}, {11, 1}, {15, 1}};
  EXPECT_EQ(records, expected);
}

TEST(LogExport, McapOfNothingLeavesNoFile) {
  const std::string log = Temp("foreign.lcm"), out = Temp("foreign.mcap");
  bus::LogWriter writer(log);
  writer.Write(1, "X", Bytes(20, 7));
  writer.Close();
  EXPECT_NE(ErrorOf([&] { ExportMcap(log, out); }).find("no message of ours"), std::string::npos);
  EXPECT_FALSE(fs::exists(out));
  EXPECT_FALSE(fs::exists(out + ".tmp"));
}

TEST(Output, PlaceIsKnownToBeWritableBeforeThereIsAnythingToWrite) {
  const std::string file = ::testing::TempDir() + "chase_logs_writable.json";
  WriteFile(file, "before");
  RequireWritable(file);
  EXPECT_EQ(fs::file_size(file), 6u);
  EXPECT_FALSE(fs::exists(file + ".tmp"));
  fs::remove(file);
  RequireWritable(file);
  EXPECT_FALSE(fs::exists(file));
  for (const std::string& bad : {std::string("/no/such/folder/m.json"), ::testing::TempDir()})
    EXPECT_NE(ErrorOf([&] { RequireWritable(bad); }).find("cannot be written"), std::string::npos)
        << bad;
}

TEST(Output, Base64OfRfc4648) {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) EXPECT_EQ(Base64(bytes), text);
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
}

TEST(LogImport, KittiTimesFollowTheAzimuthAndRingZeroIsLowest) {
  const auto put = [](std::vector<uint8_t>* out, int x, int y, int ring) {
    for (const int v : {x, y, 0})
      for (const int shift : {0, 8}) out->push_back(static_cast<uint8_t>((v >> shift) & 0xff));
    out->push_back(99);
    out->push_back(static_cast<uint8_t>(ring));
  };
  std::vector<uint8_t> records;
  put(&records, 0, -1000, 0);  // right
  put(&records, 1000, 0, 15);  // forward
  put(&records, -1000, 1, 3);  // behind, on the left: the sweep's start
  put(&records, 0, 1000, 8);   // left
  const lidar_scan_t scan = KittiScan(records.data(), 4, 300000);
  ASSERT_EQ(scan.size, 4);
  EXPECT_EQ(scan.utime, 300000);
  const float expected[] = {0.0f, 0.025f, 0.05f, 0.075f};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(scan.t[i], expected[i], 2e-4);
  EXPECT_NEAR(scan.x[0], -4.0, 1e-6);
  EXPECT_EQ(scan.ring[0], 12);
  EXPECT_EQ(scan.ring[2], 0);
  EXPECT_EQ(scan.ring[3], 15);
  EXPECT_EQ(scan.intensity[1], 99);
}

TEST(LogImport, DamagedKittiFilesLeaveNoOutput) {
  const std::string out = Temp("kitti.lcm");
  const std::string header("\x05\0\0\0", 4);
  EXPECT_NE(
      ErrorOf([&] { ImportKitti16(WriteText("k.bin", header + "abc"), out); }).find("frame 0"),
      std::string::npos);
  EXPECT_NE(ErrorOf([&] { ImportKitti16(WriteText("k.bin.xz", "no xz"), out); }).find("damaged"),
            std::string::npos);
  EXPECT_NE(ErrorOf([&] { ImportKitti16("/nonexistent", out); }).find("no such file"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(out));
  EXPECT_FALSE(fs::exists(out + ".tmp"));
}

TEST(LogImport, RealRecordings) {
  const fs::path data = "../shared/data";
  if (!fs::exists(data / "vlp16") || !fs::exists(data / "kitti"))
    GTEST_SKIP() << "skipped: real recordings not present";
  const std::string out = Temp("real.lcm");
  EXPECT_EQ(ImportVlp16((data / "vlp16/einride_recording.bin").string(), out), 13);
  EXPECT_EQ(Describe(out).channels.at(0).count, 13);
  fs::remove(out);
  const std::string refused =
      ErrorOf([&] { ImportVlp16((data / "vlp16/mrpt_sample_velodyne_hdl32.pcap").string(), out); });
  EXPECT_NE(refused.find("HDL-32E"), std::string::npos) << refused;
  EXPECT_FALSE(fs::exists(out));
  EXPECT_FALSE(fs::exists(out + ".tmp"));
  EXPECT_EQ(ImportKitti16((data / "kitti/raw_2011_09_26_drive_0005_16ring.bin.xz").string(), out),
            154);
  EXPECT_EQ(Describe(out).channels.at(0).count, 154);
}

}  // namespace
}  // namespace chase::logs
