#pragma once

#include <map>
#include <string>

namespace chase::viewer {

/// A file of the page.
struct Asset {
  std::string bytes, type;  ///< type: of its content, for HTTP
  bool gzip = false;        ///< bytes are packed
};

/// All files of the page by the path that a browser asks for, such as "/main.js". They are read
/// once, so that no request ever names a file.
using Assets = std::map<std::string, Asset>;

/// What stands in `folder`, NAME.gz as NAME; "/" is /index.html. Throws std::runtime_error with one
/// line when there is no page.
Assets LoadAssets(const std::string& folder);
/// share/chase/viewer beside the program's bin/.
std::string AssetFolder();

}  // namespace chase::viewer
