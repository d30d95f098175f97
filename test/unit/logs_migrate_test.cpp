#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "all_types.h"
#include "lcmtypes/lcm_texts.h"
#include "logs/src/migrate.h"

namespace chase::logs {
namespace {

using Bytes = std::vector<uint8_t>;
using Doubles = std::vector<double>;

Bytes Wire(const Schema& schema, const std::string& type, const Record& record) {
  const Struct& s = *schema.Find(type);
  const std::string text = BigEndian(static_cast<uint64_t>(schema.Fingerprint(s)), 8);
  const std::string body = Encode(schema, s, record);
  Bytes bytes(text.begin(), text.end());
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

Record Read(const Schema& schema, const std::string& type, const Bytes& bytes) {
  return Decode(schema, *schema.Find(type), std::string(bytes.begin() + 8, bytes.end()));
}

std::vector<double> Numbers(const Record& record, const std::string& member) {
  const Value* value = record.Find(member);
  return value ? value->Numbers() : std::vector<double>{-999.0};
}

// One of each form that changes: renamed length, added and removed members, another type, another
// size, a changed nested struct, a nested struct that is new, strings and two dimensions.
constexpr char kOld[] = R"(package chase;
  struct point_t { double at[2]; string label; }
  struct path_t {
    int64_t utime; string name; int8_t gone; float kind; double pair[2];
    int32_t n; int32_t m; point_t points[n]; double grid[n][m]; string tags[m]; byte raw[n];
  })";
constexpr char kNew[] = R"(package chase;
  struct path_t {
    string sender; int64_t utime; double kind; string name; double pair[3];
    int16_t count; int32_t m; int32_t n_extra; point_t points[count]; double weight[count];
    double grid[count][m]; string tags[m]; byte raw[count]; point_t extra[n_extra]; point_t one;
  }
  struct point_t { int8_t flag; string label; double at[2]; string notes[2]; })";

Record OldPath(const Schema& schema) {
  Record path = Zero(schema, *schema.Find("path_t"));
  path.Set("utime", {1234567890123456.0});
  path.values.at("name").SetText("of three");
  path.Set("kind", {4.0});
  path.Set("pair", {5.0, 6.0});
  path.Set("raw", {7.0, 8.0, 255.0});  // and n
  path.Set("m", {2.0});
  path.values.at("grid") = Zero(schema, *schema.Find("path_t")->Find("grid"), {{"n", 3}, {"m", 2}});
  path.values.at("grid").SetNumbers({1.0, 2.0, 3.0, 4.0, 5.0, 6.0});
  path.values.at("tags") = Zero(schema, *schema.Find("path_t")->Find("tags"), {{"m", 2}});
  path.values.at("tags").bytes = BigEndian(3, 4) + "ab" + '\0' + BigEndian(1, 4) + '\0';
  for (int k = 0; k < 3; ++k) {
    Record point = Zero(schema, *schema.Find("point_t"));
    point.Set("at", {k + 0.25, k + 0.5});
    point.values.at("label").SetText("point " + std::to_string(k));
    path.values.at("points").records.push_back(point);
  }
  return path;
}

TEST(Schema, FingerprintsAreLcmGens) {
  const std::vector<std::pair<std::string, int64_t>> generated = {
#include "fingerprints.inc"
  };
  const Schema schema(LcmToday());
  EXPECT_EQ(schema.structs().size(), generated.size());
  for (const auto& [name, fingerprint] : generated) {
    const Struct* type = schema.Find(name);
    ASSERT_NE(type, nullptr) << name;
    EXPECT_EQ(schema.Fingerprint(*type), fingerprint) << name;
  }
}

TEST(Schema, ReadsWhatLcmGenReads) {
  const Schema schema(R"(package chase; // struct not_t { }
    /* nor struct
       this_t */
    struct m_t { const int32_t A = 3, B = -0x10; int32_t n; int32_t m; double a[3][n]; /**/
      double b[n][2]; string s[n]; const double C = 1e-3; boolean f; q_t p[ 2 ][m];
      double c[n][m]; }
    struct q_t { int32_t n; double a[n]; int8_t x, y; })");
  ASSERT_EQ(schema.structs().size(), 2U);
  // The sums in the headers of lcm-gen 1.5.1: own sum plus the nested hash, turned by a bit.
  const auto turned = [](uint64_t sum) { return static_cast<int64_t>(sum << 1 | sum >> 63); };
  const int64_t q = turned(0x54dfc1bd4b67e901U);
  EXPECT_EQ(schema.Fingerprint(*schema.Find("q_t")), q);
  EXPECT_EQ(schema.Fingerprint(*schema.Find("m_t")),
            turned(0xdb8db43a6c7305d1U + static_cast<uint64_t>(q)));
}

TEST(Schema, NamesWhatIsWrong) {
  const std::vector<std::pair<std::string, std::string>> faults = {
      {"struct a_t { double x; ", "line 1: expected a member's type, the text ends"},
      {"struct a_t {\n double x\n int8_t y; }", "line 3: expected ';', found 'int8_t'"},
      {"struct a_t { double; }", "line 1: expected a member's name"},
      {"struct a_t { double x[n]; int32_t n; }", "'n' is no integer member before it"},
      {"struct a_t { float n; double x[n]; }", "'n' is no integer member before it"},
      {"struct a_t { int32_t n[2]; double x[n]; }", "'n' is no integer member before it"},
      {"struct a_t { double x[]; }", "expected an array's size"},
      {"struct a_t { double x[0]; }", "'0' is no size"},
      {"struct a_t { double x[3; }", "expected ']'"},
      {"struct a_t { double x[99999999999]; }", "'99999999999' is no size"},
      {"struct a_t { double x; int8_t x; }", "a second member 'x'"},
      {"struct a_t { double x; } struct a_t { }", "a second struct 'a_t'"},
      {"struct a_t { b_t x; }", "a_t.x: there is no type 'b_t'"},
      {"struct a_t { b_t x; } struct b_t { a_t x; }", "a_t holds itself"},
      {"struct a_t { const int32_t A = 3 }", "expected ';'"},
      {"class a_t { }", "expected 'struct', found 'class'"},
      {"struct a_t { } ?", "expected 'struct', found '?'"},
  };
  for (const auto& [text, problem] : faults) {
    try {
      const Schema schema(text);
      ADD_FAILURE() << "taken: " << text;
    } catch (const std::runtime_error& e) {
      EXPECT_NE(std::string(e.what()).find(problem), std::string::npos) << text << ": " << e.what();
    }
  }
}

TEST(Schema, FingerprintsOfAVersionAreDistinct) {
  std::vector<std::string> texts = LcmHistory();
  texts.push_back(LcmToday());
  for (const std::string& text : texts) {
    const Schema schema(text);
    std::set<int64_t> fingerprints;
    for (const Struct& s : schema.structs()) fingerprints.insert(schema.Fingerprint(s));
    EXPECT_EQ(fingerprints.size(), schema.structs().size());
  }
}

TEST(Record, IsWhatLcmWrites) {
  status_t status{};
  status.utime = 1234567890123456;
  status.name = "planning";
  status.n_channels = 2;
  status.channels.resize(2);
  status.channels[1].channel = "PLAN";
  status.channels[1].rate_hz = 2.5;
  Bytes bytes(static_cast<size_t>(status.getEncodedSize()));
  status.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  const Schema schema(LcmToday());
  const Record record = Read(schema, "status_t", bytes);
  EXPECT_EQ(record.Find("utime")->Integer(), status.utime);
  EXPECT_EQ(record.Find("name")->Text(), "planning");
  EXPECT_EQ(record.Find("channels")->records.at(1).Number("rate_hz"), 2.5);
  EXPECT_EQ(Wire(schema, "status_t", record), bytes);
}

TEST(Migrate, CarriesOverWhatIsTheSame) {
  const Schema old(kOld), today(kNew);
  const Migrator migrator(kNew, {kOld});
  Bytes bytes = Wire(old, "path_t", OldPath(old));
  ASSERT_EQ(migrator.Migrate("PATH", &bytes), Fate::kMigrated);
  const Bytes once = bytes;
  EXPECT_EQ(migrator.Migrate("PATH", &bytes), Fate::kKept);
  EXPECT_EQ(bytes, once);
  const Record path = Read(today, "path_t", bytes);
  EXPECT_EQ(path.Find("sender")->Text(), "");
  EXPECT_EQ(path.Find("utime")->Integer(), 1234567890123456);
  EXPECT_EQ(path.Find("name")->Text(), "of three");
  EXPECT_EQ(path.Number("kind"), 0.0);  // was a float
  EXPECT_EQ(Numbers(path, "pair"), Doubles(3, 0.0));
  EXPECT_EQ(path.Number("count"), 3.0);
  EXPECT_EQ(path.Number("m"), 2.0);
  EXPECT_EQ(path.Number("n_extra"), 0.0);
  EXPECT_EQ(Numbers(path, "weight"), Doubles(3, 0.0));  // as long as its neighbours
  EXPECT_EQ(Numbers(path, "grid"), Doubles({1.0, 2.0, 3.0, 4.0, 5.0, 6.0}));
  EXPECT_EQ(path.Find("tags")->bytes, OldPath(old).Find("tags")->bytes);
  EXPECT_EQ(Numbers(path, "raw"), Doubles({7.0, 8.0, 255.0}));
  EXPECT_TRUE(path.Find("extra")->records.empty());
  ASSERT_EQ(path.Find("points")->records.size(), 3U);
  const Record& point = path.Find("points")->records[2];
  EXPECT_EQ(Numbers(point, "at"), Doubles({2.25, 2.5}));
  EXPECT_EQ(point.Find("label")->Text(), "point 2");
  EXPECT_EQ(point.Number("flag"), 0.0);
  ASSERT_EQ(path.Find("one")->records.size(), 1U);
}

TEST(Migrate, APlainNumberBecomesTheLengthOfANewList) {
  const char* was = "struct a_t { int32_t n; }";
  const char* now = "struct a_t { int32_t n; double x[n]; }";
  const Schema old(was), today(now);
  Record record = Zero(old, *old.Find("a_t"));
  record.Set("n", {2e9});
  Bytes bytes = Wire(old, "a_t", record);
  ASSERT_EQ(Migrator(now, {was}).Migrate("A", &bytes), Fate::kMigrated);
  EXPECT_EQ(Read(today, "a_t", bytes).Number("n"), 0.0);
}

TEST(Migrate, LengthsThatContradictOrDoNotFit) {
  const char* was = "struct a_t { int32_t n; int32_t m; byte x[n]; byte y[m]; }";
  const char* now = "struct a_t { int8_t n; byte x[n]; byte y[n]; }";
  const Schema old(was), today(now);
  const auto migrate = [&](size_t n) {
    Record record = Zero(old, *old.Find("a_t"));
    record.Set("x", Doubles(n, 1.0));
    record.Set("y", Doubles(2, 1.0));
    Bytes bytes = Wire(old, "a_t", record);
    const Fate fate = Migrator(now, {was}).Migrate("A", &bytes);
    return std::make_pair(fate, bytes);
  };
  const auto [fate, bytes] = migrate(3);
  ASSERT_EQ(fate, Fate::kMigrated);
  EXPECT_EQ(Numbers(Read(today, "a_t", bytes), "x"), Doubles(3, 1.0));
  EXPECT_EQ(Numbers(Read(today, "a_t", bytes), "y"), Doubles(3, 0.0));
  EXPECT_EQ(migrate(200).first, Fate::kMalformed);  // no int8_t can tell it
}

TEST(Migrate, KnowsEachVersion) {
  const char* first = "struct a_t { int8_t x; } struct gone_t { int8_t g; }";
  const char* second = "struct a_t { int8_t x; int8_t y; } struct gone_t { int8_t g; }";
  const char* now = "struct a_t { int8_t z; int8_t y; int8_t x; }";
  const Migrator migrator(now, {first, second});
  const Schema today(now);
  for (const char* was : {first, second}) {
    const Schema old(was);
    Record record = Zero(old, *old.Find("a_t"));
    record.Set("x", {-3.0});
    record.Set("y", {4.0});
    Bytes bytes = Wire(old, "a_t", record);
    ASSERT_EQ(migrator.Migrate("A", &bytes), Fate::kMigrated);
    EXPECT_EQ(Read(today, "a_t", bytes).Number("x"), -3.0);
    EXPECT_EQ(Read(today, "a_t", bytes).Number("y"), was == second ? 4.0 : 0.0);
    Bytes gone = Wire(old, "gone_t", Zero(old, *old.Find("gone_t")));
    EXPECT_EQ(migrator.Migrate("A", &gone), Fate::kUnknown);  // nothing of today's to become
  }
}

TEST(Migrate, RefusesEveryPrefixAndAByteTooMany) {
  const Schema old(kOld);
  const Migrator migrator(kNew, {kOld});
  const Bytes whole = Wire(old, "path_t", OldPath(old));
  for (size_t size = 0; size <= whole.size() + 1; ++size) {
    Bytes bytes = whole;
    bytes.resize(size);
    const Bytes before = bytes;
    const Fate fate = migrator.Migrate("PATH", &bytes);
    EXPECT_EQ(fate, size == whole.size() ? Fate::kMigrated : Fate::kMalformed) << size;
    EXPECT_EQ(bytes == before, fate == Fate::kMalformed) << size;
  }
}

TEST(Migrate, RefusesLengthsThatCannotBe) {
  const char* was = "struct in_t { byte b; } struct a_t { int32_t n; in_t in[n]; string s; }";
  const char* now =
      "struct in_t { byte b; } struct a_t { int32_t n; in_t in[n]; byte x[n]; string s; }";
  const Schema old(was);
  const auto fate_of = [&](int64_t n, const std::string& string) {
    Record record = Zero(old, *old.Find("a_t"));
    record.Set("n", {static_cast<double>(n)});
    record.values.at("s").bytes = string;
    Bytes bytes = Wire(old, "a_t", record);
    return Migrator(now, {was}).Migrate("A", &bytes);
  };
  const std::string ok = BigEndian(2, 4) + "a" + '\0';
  EXPECT_EQ(fate_of(0, ok), Fate::kMigrated);
  EXPECT_EQ(fate_of(-1, ok), Fate::kMalformed);
  EXPECT_EQ(fate_of(INT32_MIN, ok), Fate::kMalformed);
  EXPECT_EQ(fate_of(INT32_MAX, ok), Fate::kMalformed);
  EXPECT_EQ(fate_of(0, BigEndian(0, 4)), Fate::kMalformed);
  EXPECT_EQ(fate_of(0, BigEndian(0xFFFFFFFF, 4)), Fate::kMalformed);
  EXPECT_EQ(fate_of(0, BigEndian(2, 4) + "ab"), Fate::kMalformed);  // no zero at the end
}

TEST(Migrate, WhateverBytesComeTheResultIsWhole) {
  const Schema old(kOld), today(kNew);
  const Migrator migrator(kNew, {kOld});
  const Bytes whole = Wire(old, "path_t", OldPath(old));
  std::mt19937 random(7);
  std::map<Fate, int> fates;
  for (int k = 0; k < 20000; ++k) {
    Bytes bytes = whole;
    for (unsigned changes = random() % 4 + 1; changes > 0; --changes)
      bytes[8 + random() % (bytes.size() - 8)] = static_cast<uint8_t>(random() >> 7);
    if (k % 3 == 0) {
      bytes.resize(8 + random() % 200);
      for (size_t i = 8; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>(random() >> 7);
    }
    const Fate fate = migrator.Migrate("PATH", &bytes);
    ++fates[fate];
    if (fate != Fate::kMigrated) continue;
    EXPECT_NO_THROW(Read(today, "path_t", bytes)) << k;
  }
  EXPECT_GT(fates[Fate::kMigrated], 1000);
  EXPECT_GT(fates[Fate::kMalformed], 1000);
  EXPECT_EQ(fates.size(), 2U);
}

}  // namespace
}  // namespace chase::logs
