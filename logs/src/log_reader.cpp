#include "logs/src/log_reader.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace chase::logs {
namespace {

constexpr int64_t kEventHeaderBytes = 28;  // sync word, number, stamp, two lengths

void RefuseWhatIsNoLog(const std::string& file) {
  if (!std::filesystem::is_regular_file(file))
    throw std::runtime_error(file + ": no such file; check the path");
  std::ifstream in(file, std::ios::binary);
  unsigned char sync[4] = {};
  if (!in) throw std::runtime_error(file + ": cannot be opened; check its permissions");
  in.read(reinterpret_cast<char*>(sync), 4);
  if (in.gcount() == 0) throw std::runtime_error(file + ": is empty; record the log again");
  if (sync[0] != 0xED || sync[1] != 0xA1 || sync[2] != 0xDA || sync[3] != 0x01)
    throw std::runtime_error(file + ": is no LCM log (it does not begin with ED A1 DA 01)");
}

}  // namespace

LogReader::LogReader(const std::string& file) : file_(file) {
  RefuseWhatIsNoLog(file);
  size_ = static_cast<int64_t>(std::filesystem::file_size(file));
  log_ = std::make_unique<lcm::LogFile>(file, "r");
  if (!log_->good()) throw std::runtime_error(file + ": cannot be opened as an LCM log");
}

bool LogReader::Next(Event* event) {
  const lcm::LogEvent* e = log_->readNextEvent();
  if (!e) return false;
  event->utime = e->timestamp;
  event->channel = e->channel;
  const auto* data = static_cast<const uint8_t*>(e->data);
  event->bytes.assign(data, data + e->datalen);
  read_ += kEventHeaderBytes + static_cast<int64_t>(event->channel.size()) + e->datalen;
  return true;
}

}  // namespace chase::logs
