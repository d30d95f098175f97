#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/bus/default_url.h"

namespace chase::bus {
namespace {

std::string UrlOfText(const std::string& text) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "environment";
  std::ofstream(file) << text;
  return UrlOf(file);
}

TEST(DefaultUrl, OfAnEnvironmentFileIsTheLastThatIsSet) {
  EXPECT_EQ(UrlOfText(""), "");
  EXPECT_EQ(UrlOfText("# LCM_DEFAULT_URL=udpm://239.0.0.1:1\nCHASE_OPTIONS=\n"), "");
  EXPECT_EQ(UrlOfText("LCM_DEFAULT_URL=\n"), "");
  EXPECT_EQ(UrlOfText("A=b\nLCM_DEFAULT_URL=udpm://239.0.0.1:1?ttl=1\n"),
            "udpm://239.0.0.1:1?ttl=1");
  EXPECT_EQ(UrlOfText("LCM_DEFAULT_URL=one\nLCM_DEFAULT_URL=\"two\" \r\n"), "two");
  EXPECT_EQ(UrlOf("/nowhere/environment"), "");
}

// A program of the build tree is no vehicle's, whatever is installed beside it.
TEST(DefaultUrl, IsTheEnvironmentsElseBuiltIn) {
  const char* before = std::getenv("LCM_DEFAULT_URL");
  const std::string kept = before ? before : "";
  setenv("LCM_DEFAULT_URL", "udpm://239.0.0.2:2", 1);
  EXPECT_EQ(DefaultUrl(), "udpm://239.0.0.2:2");
  setenv("LCM_DEFAULT_URL", "", 1);
  EXPECT_EQ(DefaultUrl(), kDefaultUrl);
  unsetenv("LCM_DEFAULT_URL");
  EXPECT_EQ(DefaultUrl(), kDefaultUrl);
  if (before) setenv("LCM_DEFAULT_URL", kept.c_str(), 1);
}

}  // namespace
}  // namespace chase::bus
