// A scene file of chase-plan and chase-predict.
#include "common/world/scene.h"
#include "test/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chase;  // NOLINT(google-build-using-namespace)
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::Accepts([&] { world::ParseScene(text, "fuzz"); });
  return 0;
}
