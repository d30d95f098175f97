#include "common/config/config.h"

#include <gtest/gtest.h>

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

TEST(Config, BrokenYamlNamesTheLine) {
  EXPECT_NE(ErrorOf("speed: [1, 2").find("file.yaml:"), std::string::npos);
}

TEST(Config, MissingFileIsNamed) {
  Outer config;
  EXPECT_THROW(Load("/no/such/file.yaml", &config), std::runtime_error);
}

}  // namespace
}  // namespace chase::config
