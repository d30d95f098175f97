#include "common/config/config.h"

#include <gtest/gtest.h>

#include "common/config/changes.h"
#include "common/config/checksum.h"
#include "common/config/edit.h"

namespace chase::config {
namespace {

struct Inner {
  int count = 3;
  std::string label = "plain";
  template <class V>
  void Visit(V& v) {
    v("count", count, "how many");
    v("label", label, "");
  }
};

struct Outer {
  double speed = 1.5;
  bool on = true;
  Eigen::Vector3d offset = {1.0, 2.0, 3.0};
  std::vector<double> gains = {0.5, 0.25};
  std::vector<Inner> items = {Inner{}, Inner{7, "x: \"y\" \\ #"}};
  Inner inner;
  template <class V>
  void Visit(V& v) {
    v("speed", speed, "m/s");
    v("on", on, "");
    v("offset", offset, "m");
    v("gains", gains, "");
    v("items", items, "");
    v("inner", inner, "");
  }
  std::string Problem() const { return speed > 0.0 ? "" : "speed is not above 0 m/s"; }
};

std::string ErrorOf(const std::string& yaml) {
  Outer config;
  try {
    LoadText(yaml, "file.yaml", &config);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(Config, DumpLoadsBackToTheSameDump) {
  Outer changed;
  changed.speed = 0.1 + 0.2;
  changed.inner.label = "a \"quoted\" \\ text:\n # no comment";
  changed.gains.clear();
  Outer loaded;
  LoadText(Dump(changed), "dump", &loaded);
  EXPECT_EQ(Dump(loaded), Dump(changed));
  EXPECT_EQ(loaded.speed, changed.speed);
  EXPECT_EQ(loaded.inner.label, changed.inner.label);
  EXPECT_EQ(loaded.items.size(), 2u);
}

TEST(Config, OverridesOnlyWhatTheFileNames) {
  Outer config;
  LoadText("inner: {count: 9}", "t", &config);
  EXPECT_EQ(config.inner.count, 9);
  EXPECT_EQ(config.inner.label, "plain");
  EXPECT_EQ(config.speed, 1.5);
}

TEST(Config, EmptyTextKeepsDefaults) {
  Outer config;
  LoadText("", "t", &config);
  EXPECT_EQ(config.speed, 1.5);
}

TEST(Config, UnknownKeyNamesLineKeyAndWhatIsKnown) {
  const std::string error = ErrorOf("speed: 2.0\ninner:\n  cuont: 4\n");
  EXPECT_NE(error.find("file.yaml:3"), std::string::npos) << error;
  EXPECT_NE(error.find("inner.cuont"), std::string::npos) << error;
  EXPECT_NE(error.find("count"), std::string::npos) << error;
}

TEST(Config, WrongTypeNamesFieldValueAndType) {
  const std::string error = ErrorOf("speed: fast");
  EXPECT_NE(error.find("speed: 'fast' is not a number"), std::string::npos) << error;
}

TEST(Config, WrongLengthOfAVectorIsRefused) {
  EXPECT_NE(ErrorOf("offset: [1, 2]").find("list of 3 numbers"), std::string::npos);
}

TEST(Config, ProblemIsAnError) {
  EXPECT_NE(ErrorOf("speed: -1").find("speed is not above 0"), std::string::npos);
}

struct Gate {
  double width = 1.0;
  template <class V>
  void Visit(V& v) {
    v("width", width, "m");
  }
  std::string Problem() const { return width > 0.0 ? "" : "width is not above 0 m"; }
};

struct Course {
  std::vector<Gate> gates;
  Gate start;
  Inner inner;
  template <class V>
  void Visit(V& v) {
    v("gates", gates, "");
    v("start", start, "");
    v("inner", inner, "");
  }
  std::string Problem() const {
    if (inner.count < 0) return "inner.count is below 0";
    return gates.size() < 2 || gates[1].width < 9.0 ? "" : "gates[1]: width is 9 m or more";
  }
};

template <class C>
std::string ErrorOfA(const std::string& yaml) {
  C config;
  try {
    LoadText(yaml, "c.yaml", &config);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(Config, ProblemNamesTheLineOfTheValue) {
  EXPECT_EQ(ErrorOf("on: true\ngains: [1]\nspeed: -1\n"), "file.yaml:3: speed is not above 0 m/s");
  EXPECT_EQ(ErrorOfA<Course>("gates:\n  - width: 1\n  -\n    width: 0\n"),
            "c.yaml:4: gates[1]: width is not above 0 m");
  EXPECT_EQ(ErrorOfA<Course>("inner:\n  label: a\n  count: -1\nstart: {width: 2}\n"),
            "c.yaml:3: inner.count is below 0");
  EXPECT_EQ(ErrorOfA<Course>("start: {width: 2}\ngates:\n  - width: 1\n  - # two\n    width: 9\n"),
            "c.yaml:5: gates[1]: width is 9 m or more");
}

struct Strict : Inner {
  std::string Problem() const { return "label is short for 3: nothing is right"; }
};

TEST(Config, ProblemOfAFieldThatIsNotGivenNamesTheMap) {
  EXPECT_EQ(ErrorOfA<Strict>("\n\ncount: 1\n"), "c.yaml:3: label is short for 3: nothing is right");
}

TEST(Config, KeyGivenTwiceNamesItsSecondLine) {
  EXPECT_EQ(ErrorOf("speed: 2.0\non: true\nspeed: 3.0\n"),
            "file.yaml:3: 'speed' is given twice; keep one of them");
  EXPECT_EQ(ErrorOf("inner: {count: 1, \"count\": 1}\n"),
            "file.yaml:1: 'inner.count' is given twice; keep one of them");
  EXPECT_EQ(ErrorOf("items:\n  - count: 1\n  - label: a\n    count: 2\n    label: b\n"),
            "file.yaml:5: 'items[1].label' is given twice; keep one of them");
}

TEST(Config, KeyThatIsNoWordIsRefused) {
  EXPECT_NE(ErrorOf("? [1, 2]\n: 3\n").find("file.yaml:1"), std::string::npos);
}

TEST(Config, BrokenYamlNamesTheLine) {
  EXPECT_NE(ErrorOf("speed: [1, 2").find("file.yaml:"), std::string::npos);
}

TEST(Config, MissingFileIsNamed) {
  Outer config;
  EXPECT_THROW(Load("/no/such/file.yaml", &config), std::runtime_error);
}

// What `printf TEXT | cksum` prints.
TEST(Checksum, IsThatOfCksum) {
  EXPECT_EQ(Checksum(""), 4294967295u);
  EXPECT_EQ(Checksum("123456789"), 930766865u);
  EXPECT_EQ(Checksum(std::string(300, '\xff')), 1718880618u);
}

TEST(Changes, HoldOnlyWhatDiffersAndLoadBack) {
  EXPECT_EQ(DumpChanges(Outer{}), "");
  Outer changed;
  changed.speed = 0.1 + 0.2;
  changed.inner.label = "two\nlines: \"quoted\"\n";
  changed.gains.assign(60, 0.125);
  changed.items = {Inner{}, Inner{4, std::string(120, 'x')}, Inner{5, "a, [b"}};
  const std::string text = DumpChanges(changed);
  EXPECT_EQ(text.find("offset"), text.npos);
  EXPECT_EQ(text.find("count: 3"), text.npos);
  Outer loaded;
  LoadText(text, "changes", &loaded);
  EXPECT_EQ(Dump(loaded), Dump(changed)) << text;
  Outer base;
  base.speed = 7.0;
  Outer over = base;
  over.on = false;
  EXPECT_EQ(DumpChanges(over, base), "on: false\n");
}

TEST(Config, AFileIsChangedLineByLine) {
  const std::string file =
      "# Ours.\n\nspeed: 2  # m/s, as measured in May\n#on: true\n#offset: [1, 2, 3]  # m\n"
      "inner:\n  count: 4  # speed: and on: too\n";
  Outer wanted;
  LoadText(file, "file.yaml", &wanted);
  wanted.speed = 2.5, wanted.on = false, wanted.gains = {0.1};
  const std::vector<Change> changes = {{"speed", "2.5", "by a test: m/s"},
                                       {"on", "false", "by a test: of May"},
                                       {"gains", "[0.1]", ""}};
  const std::string text = Edited(file, "file.yaml", wanted, changes);
  EXPECT_EQ(
      text,
      "# Ours.\n\nspeed: 2.5  # m/s, as measured in May\n#on: true\non: false  # by a test: of "
      "May\n#offset: [1, 2, 3]  # m\ninner:\n  count: 4  # speed: and on: too\ngains: [0.1]\n");
  wanted.on = true;
  EXPECT_NE(Edited(text, "file.yaml", wanted, {{"on", "true", "by a test: of June"}})
                .find("\non: true  # by a test: of June\n"),
            std::string::npos)
      << "its own comment is written anew";
}

TEST(Config, ALinesCommentStaysUnlessItIsTheChangesOwn) {
  Outer wanted;
  wanted.speed = 2.5;
  const auto edited = [&](const std::string& file, const std::string& comment) {
    return Edited(file, "file.yaml", wanted, {{"speed", "2.5", comment}});
  };
  for (const std::string file : {"speed: 2  #\n", "speed: 2 # \n", "speed: 2  ##\n"}) {
    EXPECT_EQ(edited(file, ""), "speed: 2.5\n") << file;
    EXPECT_EQ(edited(file, "by a test: m/s"), "speed: 2.5  # by a test: m/s\n") << file;
  }
  EXPECT_EQ(edited("speed: 2  # as measured\n", ""), "speed: 2.5  # as measured\n");
}

TEST(Config, AFileThatCannotBeChangedLineByLineIsRefused) {
  Outer wanted;
  wanted.speed = 2.5;
  const std::vector<Change> changes = {{"speed", "2.5", ""}};
  for (const std::string file : {"speed:\n  2\n", "{speed: 2}\n", "'speed': 2\n", "speed : 2\n"})
    EXPECT_THROW(Edited(file, "file.yaml", wanted, changes), std::runtime_error) << file;
  EXPECT_THROW(Edited("on: false\n", "file.yaml", wanted, changes), std::runtime_error)
      << "not what is wanted";
  EXPECT_EQ(Edited("", "file.yaml", wanted, changes), "speed: 2.5\n");
}

}  // namespace
}  // namespace chase::config
