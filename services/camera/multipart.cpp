#include "services/camera/multipart.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>

namespace chase::camera {
namespace {

constexpr std::size_t kMostBytes = 32 << 20;  // of a part that does not end

std::string Small(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string Trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\"");
  const auto last = text.find_last_not_of(" \t\"");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

void ReadHeader(const std::string& line, std::map<std::string, std::string>* headers) {
  const auto colon = line.find(':');
  if (colon != std::string::npos)
    (*headers)[Small(Trimmed(line.substr(0, colon)))] = Trimmed(line.substr(colon + 1));
}

}  // namespace

std::vector<Part> MultipartReader::Add(const uint8_t* data, std::size_t size) {
  std::vector<Part> parts;
  if (!problem_.empty()) return parts;
  buffer_.insert(buffer_.end(), data, data + size);
  while (problem_.empty() && Step(&parts)) continue;
  if (buffer_.size() > kMostBytes) problem_ = "a part of the stream does not end";
  return parts;
}

bool MultipartReader::Step(std::vector<Part>* parts) {
  switch (state_) {
    case State::kAnswer:
      return ReadAnswer();
    case State::kBoundary:
      return ReadBoundary();
    case State::kHeaders:
      return ReadHeaders();
    case State::kBody:
      return ReadBody(parts);
  }
  return false;
}

/// The next line without its end; false: it has not all come.
bool MultipartReader::Line(std::string* line) {
  const auto end = std::find(buffer_.begin(), buffer_.end(), '\n');
  if (end == buffer_.end()) return false;
  line->assign(buffer_.begin(), end);
  if (!line->empty() && line->back() == '\r') line->pop_back();
  buffer_.erase(buffer_.begin(), end + 1);
  return true;
}

bool MultipartReader::ReadAnswer() {
  std::string line;
  if (!Line(&line)) return false;
  if (status_.empty()) {
    status_ = line;
    if (line.compare(0, 5, "HTTP/") != 0 || line.find(" 200") == std::string::npos)
      problem_ = "the server answers '" + line.substr(0, 60) + "'";
    return problem_.empty();
  }
  if (!line.empty()) {
    ReadHeader(line, &part_.headers);
    return true;
  }
  const std::string& type = part_.headers["content-type"];
  const auto at = Small(type).find("boundary=");
  if (Small(type).compare(0, 10, "multipart/") != 0 || at == std::string::npos) {
    problem_ = "the server sends '" + type.substr(0, 60) + "', no multipart stream of JPEGs";
    return false;
  }
  boundary_ = Trimmed(type.substr(at + 9, type.find(';', at) - at - 9));
  // Some servers put the hyphens into the header as well.
  if (boundary_.compare(0, 2, "--") != 0) boundary_ = "--" + boundary_;
  state_ = State::kBoundary;
  return true;
}

bool MultipartReader::ReadBoundary() {
  std::string line;
  if (!Line(&line)) return false;
  if (line.compare(0, boundary_.size(), boundary_) != 0) return true;
  part_ = {};
  state_ = State::kHeaders;
  return true;
}

bool MultipartReader::ReadHeaders() {
  std::string line;
  if (!Line(&line)) return false;
  if (line.empty())
    state_ = State::kBody;
  else
    ReadHeader(line, &part_.headers);
  return true;
}

bool MultipartReader::ReadBody(std::vector<Part>* parts) {
  const auto length = part_.headers.find("content-length");
  if (length != part_.headers.end()) {
    const auto size = static_cast<std::size_t>(std::strtoull(length->second.c_str(), nullptr, 10));
    if (size > kMostBytes)
      problem_ = "a part of the stream says it has " + length->second + " bytes";
    return problem_.empty() && buffer_.size() >= size && Finish(size, parts);
  }
  const std::string end = "\r\n" + boundary_;
  const auto at = std::search(buffer_.begin(), buffer_.end(), end.begin(), end.end());
  return at != buffer_.end() &&
         Finish(static_cast<std::size_t>(std::distance(buffer_.begin(), at)), parts);
}

bool MultipartReader::Finish(std::size_t size, std::vector<Part>* parts) {
  const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(size);
  part_.body.assign(buffer_.begin(), end);
  buffer_.erase(buffer_.begin(), end);
  parts->push_back(std::move(part_));
  state_ = State::kBoundary;
  return true;
}

}  // namespace chase::camera
