#include <gtest/gtest.h>

#include <cstdlib>

/// What skips_test.py asks for; none of it runs by itself.
TEST(Ask, DISABLED_Pass) {}
TEST(Ask, DISABLED_Skip) { GTEST_SKIP() << "no camera"; }
TEST(Ask, DISABLED_Fail) { FAIL(); }
TEST(Ask, DISABLED_Die) { std::abort(); }
