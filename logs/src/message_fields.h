#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace chase::logs {

using Bytes = std::vector<uint8_t>;

/// One field of a message. A list of structs gives one field per member, with the members' values
/// of all its items one after the other: path "obstacles.id" holds every obstacle's id.
struct Field {
  std::string path;
  std::vector<double> numbers;     ///< integers up to 2^53 are exact
  std::vector<std::string> texts;  ///< of string fields
  bool is_list = false;            ///< its length varies from message to message
};

/// Name of the message type ("pose_t"), or an empty string when it is not ours.
std::string TypeOf(const Bytes& message);

/// All fields in wire order, or nothing when the type is not ours or the bytes do not decode.
std::optional<std::vector<Field>> FieldsOf(const Bytes& message);

/// The paths of all fields that messages of this one's type may have, in wire order: its own lists
/// may be empty. Nothing where FieldsOf has nothing.
std::vector<std::string> PathsOf(const Bytes& message);

}  // namespace chase::logs
