#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "logs/src/output.h"

namespace chase::logs {

/// Writes an MCAP file (mcap.dev, version 0): chunks compressed by zstd, with message indexes and
/// a summary, messages as protobuf. The file appears under its name when closed and not before.
class McapWriter {
 public:
  /// Throws std::runtime_error with one line when the file cannot be written.
  explicit McapWriter(const std::string& file);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  bool HasChannel(const std::string& topic) const { return channels_.count(topic) > 0; }
  /// `schema` is a FileDescriptorSet.
  void AddChannel(const std::string& topic, const std::string& schema_name,
                  const std::string& schema);
  /// `topic` must have been added; `utime` in microseconds.
  void Write(const std::string& topic, int64_t utime, const std::string& message);
  void Close();

 private:
  struct Channel {
    uint16_t id = 0;
    uint32_t sequence = 0;
  };
  struct ChunkIndex {
    uint64_t first_ns, last_ns, offset, length, size, packed_size;
    std::map<uint16_t, uint64_t> index_offsets;
    uint64_t index_length;
  };
  using Index = std::vector<std::pair<uint64_t, uint64_t>>;  // time in ns, offset in the chunk

  void Put(const std::string& bytes);
  void FlushChunk();
  std::string Statistics() const;
  std::string SummaryRecords() const;

  OutputFile out_;
  uint64_t written_ = 0;
  std::map<std::string, Channel> channels_;
  std::string definitions_;  // schema and channel records, repeated in the summary
  std::string chunk_;
  std::map<uint16_t, Index> chunk_index_;
  uint64_t chunk_first_ns_ = 0, chunk_last_ns_ = 0;
  std::vector<ChunkIndex> chunks_;
  std::map<uint16_t, uint64_t> counts_;
  uint64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace chase::logs
