#include "logs/src/mcap_writer.h"

#include <zstd.h>

#include <algorithm>
#include <stdexcept>
#include <type_traits>

namespace chase::logs {
namespace {

const std::string kMagic("\x89MCAP0\r\n", 8);
constexpr size_t kChunkBytes = 4 * 1024 * 1024;

// Opcodes.
constexpr char kHeader = 1, kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6,
               kMessageIndex = 7, kChunkIndex = 8, kStatistics = 11, kDataEnd = 15;

/// Builds the content of a record; all numbers little endian.
class Content {
 public:
  template <class T>
  Content& Number(T value) {
    auto v = static_cast<std::make_unsigned_t<T>>(value);
    for (size_t i = 0; i < sizeof(T); ++i) {
      bytes_ += static_cast<char>(v & 0xff);
      v = static_cast<decltype(v)>(static_cast<uint64_t>(v) >> 8);
    }
    return *this;
  }
  Content& Text(const std::string& s) {
    Number(static_cast<uint32_t>(s.size()));
    return Raw(s);
  }
  Content& Raw(const std::string& s) {
    bytes_ += s;
    return *this;
  }
  template <class Pairs>
  Content& Map(const Pairs& pairs) {
    Content inner;
    for (const auto& [key, value] : pairs) inner.Number(key).Number(value);
    return Text(inner.bytes_);
  }
  std::string Record(char opcode) const {
    Content head;
    head.bytes_ += opcode;
    return head.Number(static_cast<uint64_t>(bytes_.size())).bytes_ + bytes_;
  }

 private:
  std::string bytes_;
};

/// At zstd's quickest ordinary level: what little the noise of clouds and images leaves to gain,
/// the higher ones do not find either.
std::string Packed(const std::string& bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1);
  if (ZSTD_isError(size) != 0)
    throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}

}  // namespace

McapWriter::McapWriter(const std::string& file) : out_(file) {
  Put(kMagic + Content().Text("").Text("chase-log").Record(kHeader));
}

void McapWriter::Put(const std::string& bytes) {
  out_.Write(bytes);
  written_ += bytes.size();
}

void McapWriter::AddChannel(const std::string& topic, const std::string& schema_name,
                            const std::string& schema) {
  const auto id = static_cast<uint16_t>(channels_.size() + 1);
  channels_[topic].id = id;
  const std::string records =
      Content().Number(id).Text(schema_name).Text("protobuf").Text(schema).Record(kSchema) +
      Content().Number(id).Number(id).Text(topic).Text("protobuf").Text("").Record(kChannel);
  definitions_ += records;
  chunk_ += records;
}

void McapWriter::Write(const std::string& topic, int64_t utime, const std::string& message) {
  Channel& channel = channels_.at(topic);
  const auto ns = static_cast<uint64_t>(std::max<int64_t>(utime, 0)) * 1000;
  const bool first_in_chunk = chunk_index_.empty(), first = counts_.empty();
  chunk_first_ns_ = first_in_chunk ? ns : std::min(chunk_first_ns_, ns);
  chunk_last_ns_ = first_in_chunk ? ns : std::max(chunk_last_ns_, ns);
  first_ns_ = first ? ns : std::min(first_ns_, ns);
  last_ns_ = first ? ns : std::max(last_ns_, ns);
  chunk_index_[channel.id].emplace_back(ns, chunk_.size());
  chunk_ += Content()
                .Number(channel.id)
                .Number(channel.sequence++)
                .Number(ns)
                .Number(ns)
                .Raw(message)
                .Record(kMessage);
  ++counts_[channel.id];
  if (chunk_.size() >= kChunkBytes) FlushChunk();
}

void McapWriter::FlushChunk() {
  if (chunk_.empty()) return;
  const std::string packed = Packed(chunk_);
  const uint64_t size = chunk_.size(), start = written_;
  Put(Content()
          .Number(chunk_first_ns_)
          .Number(chunk_last_ns_)
          .Number(size)
          .Number(uint32_t{0})  // no checksum
          .Text("zstd")
          .Number(uint64_t{packed.size()})
          .Raw(packed)
          .Record(kChunk));
  ChunkIndex index{
      chunk_first_ns_, chunk_last_ns_, start, written_ - start, size, packed.size(), {}, 0};
  const uint64_t indexes_start = written_;
  for (const auto& [id, entries] : chunk_index_) {
    index.index_offsets[id] = written_;
    Put(Content().Number(id).Map(entries).Record(kMessageIndex));
  }
  index.index_length = written_ - indexes_start;
  chunks_.push_back(index);
  chunk_.clear();
  chunk_index_.clear();
}

std::string McapWriter::Statistics() const {
  uint64_t messages = 0;
  for (const auto& [id, count] : counts_) messages += count;
  return Content()
      .Number(messages)
      .Number(static_cast<uint16_t>(channels_.size()))
      .Number(static_cast<uint32_t>(channels_.size()))
      .Number(uint32_t{0})  // attachments
      .Number(uint32_t{0})  // metadata
      .Number(static_cast<uint32_t>(chunks_.size()))
      .Number(first_ns_)
      .Number(last_ns_)
      .Map(counts_)
      .Record(kStatistics);
}

std::string McapWriter::SummaryRecords() const {
  std::string records = definitions_ + Statistics();
  for (const ChunkIndex& c : chunks_)
    records += Content()
                   .Number(c.first_ns)
                   .Number(c.last_ns)
                   .Number(c.offset)
                   .Number(c.length)
                   .Map(c.index_offsets)
                   .Number(c.index_length)
                   .Text("zstd")
                   .Number(c.packed_size)
                   .Number(c.size)
                   .Record(kChunkIndex);
  return records;
}

void McapWriter::Close() {
  FlushChunk();
  Put(Content().Number(uint32_t{0}).Record(kDataEnd));
  const uint64_t summary = written_;
  Put(SummaryRecords());
  Put(Content().Number(summary).Number(uint64_t{0}).Number(uint32_t{0}).Record(kFooter) + kMagic);
  out_.Close();
}

}  // namespace chase::logs
