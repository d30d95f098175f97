#include <gtest/gtest.h>

/// GoogleTest's main, whose exit code tells CTest of skipped tests too: 77 where some were, and
/// none failed. A failure is never hidden by a skip.
int main(int argc, char** argv) {
  constexpr int kSkipped = 77;
  testing::InitGoogleTest(&argc, argv);
  const int code = RUN_ALL_TESTS();
  if (code != 0) return code;
  return testing::UnitTest::GetInstance()->skipped_test_count() > 0 ? kSkipped : 0;
}
