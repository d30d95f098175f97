#pragma once

#include <functional>
#include <string>

namespace chase::logs {

/// A string for gnuplot, quotes doubled.
std::string GnuplotString(const std::string& text);

/// Draws one PNG. `script` is asked for gnuplot's commands and gets the name to `set output` to: a
/// temporary file, so that a broken run leaves no half picture. Throws std::runtime_error with one
/// line.
void DrawPng(const std::string& file, const std::function<std::string(const std::string&)>& script);

}  // namespace chase::logs
