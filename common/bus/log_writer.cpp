#include "common/bus/log_writer.h"

#include <stdexcept>

namespace chase::bus {

LogWriter::LogWriter(const std::string& file)
    : file_(file), part_(file), log_(std::make_unique<lcm::LogFile>(part_.name(), "w")) {
  if (!log_->good())
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
}

void LogWriter::Write(int64_t utime, const std::string& channel,
                      const std::vector<uint8_t>& bytes) {
  lcm::LogEvent event;
  event.eventnum = 0;  // numbered by the file
  event.timestamp = utime;
  event.channel = channel;
  event.datalen = static_cast<int32_t>(bytes.size());
  event.data = const_cast<uint8_t*>(bytes.data());  // read only, though its type does not say so
  failed_ = log_->writeEvent(&event) != 0 || failed_;
}

void LogWriter::Close() {
  log_.reset();
  if (failed_ || !part_.Complete())
    throw std::runtime_error(file_ + ": could not be completed; is the disk full?");
}

}  // namespace chase::bus
