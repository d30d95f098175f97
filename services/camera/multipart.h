#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace chase::camera {

/// One part of a stream.
struct Part {
  std::map<std::string, std::string> headers;  ///< names in small letters
  std::vector<uint8_t> body;
};

/// The parts of an HTTP answer of type multipart/x-mixed-replace (RFC 2046, section 5.1), as
/// cameras send MJPEG. Bytes may come in pieces of any size.
class MultipartReader {
 public:
  /// Parts that these bytes complete, oldest first.
  std::vector<Part> Add(const uint8_t* data, std::size_t size);
  /// Why it is no such stream; empty: so far it is one.
  const std::string& problem() const { return problem_; }

 private:
  enum class State { kAnswer, kBoundary, kHeaders, kBody };
  bool Step(std::vector<Part>* parts);
  bool ReadAnswer();
  bool ReadBoundary();
  bool ReadHeaders();
  bool ReadBody(std::vector<Part>* parts);
  bool Finish(std::size_t size, std::vector<Part>* parts);
  bool Line(std::string* line);

  State state_ = State::kAnswer;
  std::vector<uint8_t> buffer_;
  std::string boundary_;  // with its two hyphens
  std::string status_;    // the answer's first line
  Part part_;
  std::string problem_;
};

}  // namespace chase::camera
