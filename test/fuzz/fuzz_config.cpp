// A service's config file. The first line names the service, the rest is the file.
#include <algorithm>

#include "common/config/config.h"
#include "test/fuzz/service_configs.h"
#include "test/fuzz/target.h"

namespace {

using namespace chase;  // NOLINT(google-build-using-namespace)

/// What was accepted is dumped as a file that is accepted again and says the same.
template <class C>
void RequireSameAgain(const C& config) {
  const std::string dumped = config::Dump(config);
  C again;
  fuzz::Require(fuzz::Accepts([&] { config::LoadText(dumped, "fuzz", &again); }) &&
                    config::Dump(again) == dumped,
                "a config that is dumped loads again to the same values");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const uint8_t* end = data + size;
  const uint8_t* line = std::find(data, end, '\n');
  const std::string service(data, line), text(line, end);
  fuzz::ForEachConfig([&](const char* name, auto config) {
    if (service != name) return;
    if (fuzz::Accepts([&] { config::LoadText(text, "fuzz", &config); })) RequireSameAgain(config);
  });
  return 0;
}
