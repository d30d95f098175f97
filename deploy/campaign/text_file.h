#pragma once

#include <string>
#include <vector>

namespace chase::campaign {

/// Writes beside and renames, so that a broken run leaves no half file. Throws std::runtime_error
/// with one line.
void WriteText(const std::string& file, const std::string& text);
std::string ReadText(const std::string& file);

/// The text of a scenario file and of the target's path that it may name: all that a flight reads.
std::string ScenarioText(const std::string& file);

/// FNV-1a over all texts, 64 bits in hexadecimal: equal texts, equal fingerprints.
std::string Fingerprint(const std::vector<std::string>& texts);

/// The file of this very program.
std::string ThisProgram();

}  // namespace chase::campaign
