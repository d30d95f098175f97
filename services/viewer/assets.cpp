#include "services/viewer/assets.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace chase::viewer {
namespace {

std::string TypeOf(const std::string& extension) {
  if (extension == ".html") return "text/html; charset=utf-8";
  if (extension == ".js") return "text/javascript; charset=utf-8";
  if (extension == ".css") return "text/css; charset=utf-8";
  if (extension == ".json") return "application/json";
  return "application/octet-stream";
}

}  // namespace

Assets LoadAssets(const std::string& folder) {
  Assets assets;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    std::ifstream file(entry.path(), std::ios::binary);
    Asset asset;
    asset.bytes.assign(std::istreambuf_iterator<char>(file), {});
    std::filesystem::path name = entry.path().filename();
    asset.gzip = name.extension() == ".gz";
    if (asset.gzip) name = name.stem();
    asset.type = TypeOf(name.extension());
    assets["/" + name.string()] = std::move(asset);
  }
  if (assets.count("/index.html") == 0)
    throw std::runtime_error(folder + ": holds no page; build chase-viewer again");
  if (assets.count("/three.module.min.js") == 0)
    throw std::runtime_error(
        folder + ": holds no three.module.min.js; run deploy/setup and build chase-viewer again");
  assets["/"] = assets["/index.html"];
  return assets;
}

std::string AssetFolder() {
  const auto program = std::filesystem::read_symlink("/proc/self/exe");
  return (program.parent_path().parent_path() / "share/chase/viewer").string();
}

}  // namespace chase::viewer
