#pragma once

#include <string>

namespace chase::config {

/// "0.1.0 (commit 1a2b3c4d5e)"; behind the commit "-dirty" when the sources held changes, and
/// "unknown" where they are no git work tree.
std::string Version();

/// `--version` of a program; `App` is CLI::App.
template <class App>
void AddVersion(App* app) {
  app->set_version_flag("--version", Version());
}

}  // namespace chase::config
