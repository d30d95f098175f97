#include "logs/src/identified_files.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/config/checksum.h"
#include "logs/src/identify.h"
#include "logs/src/output.h"

namespace chase::logs {
namespace {

namespace fs = std::filesystem;

/// A file of parameters, as it is and as it is to be.
template <class C>
class Parameters {
 public:
  explicit Parameters(const fs::path& file) : file_(file.string()) {
    if (!fs::exists(file)) return;
    config::Load(file_, &now_);
    std::ostringstream text;
    text << std::ifstream(file_, std::ios::binary).rdbuf();
    text_ = text.str();
  }

  const C& now() const { return now_; }
  const std::string& file() const { return file_; }

  /// `wanted` is what it holds with these changes.
  void Set(const C& wanted, const std::vector<config::Change>& changes) {
    if (changes.empty()) return;
    text_ = config::Edited(text_, file_, wanted, changes);
    for (const auto& c : changes) said_ += fmt::format("{}: {}: {}\n", file_, c.key, c.value);
    RequireWritable(file_);
  }
  /// Lines of what has been set.
  std::string Write() const {
    if (!said_.empty()) WriteFile(file_, text_);
    return said_;
  }

 private:
  std::string file_, text_, said_;
  C now_;
};

}  // namespace

std::string UpdateFiles(const Identification& i, const std::string& flown_by,
                        const std::string& folder) {
  if (!fs::is_directory(folder))
    throw std::runtime_error(folder +
                             ": no folder; name that of control.yaml, planning.yaml and fcu.yaml");
  Parameters<control::ControlConfig> control(fs::path(folder) / "control.yaml");
  control::ControlConfig follows = control.now();
  const auto of_control = SetInControl(i, true, &follows);
  control.Set(follows, of_control);

  Parameters<planning::PlanningConfig> planning(fs::path(folder) / "planning.yaml");
  planning::PlanningConfig leans = planning.now();
  const auto of_planning = SetInPlanning(i, &leans);
  planning.Set(leans, of_planning);

  Parameters<fcu::FcuConfig> bridge(fs::path(folder) / "fcu.yaml");
  fcu::FcuConfig curve = bridge.now();
  const auto of_fcu = SetInFcu(i, &curve);
  const std::string now = std::to_string(config::Checksum(config::Dump(bridge.now())));
  if (!flown_by.empty() && !of_fcu.empty()) {
    if (flown_by != now)
      throw std::runtime_error(fmt::format(
          "{}: has cksum {}, the flight was flown by {}; its thrust counts from there, so put back "
          "the file that flew, or fly with this one",
          bridge.file(), now, flown_by));
    bridge.Set(curve, of_fcu);
  }
  const std::string said = control.Write() + planning.Write() + bridge.Write();
  if (said.empty())
    throw std::runtime_error("the flight shows nothing that control, planning or fcu has; " +
                             folder + " stays as it was");
  if (flown_by.empty()) return said + bridge.file() + ": stays, chase-fcu did not fly it\n";
  if (of_fcu.empty())
    return said + bridge.file() + ": stays, the flight does not show the thrust\n";
  return said;
}

}  // namespace chase::logs
