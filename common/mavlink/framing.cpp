#include "common/mavlink/framing.h"

#include <algorithm>
#include <iterator>

namespace chase::mavlink {
namespace {

constexpr uint8_t kMagic1 = 0xFE, kMagic2 = 0xFD;
constexpr std::size_t kHeader1 = 6, kHeader2 = 10, kChecksumBytes = 2;
constexpr uint8_t kSigned = 1;  // MAVLINK_IFLAG_SIGNED
// A longer gap is a sender that began anew, or frames that came in another order.
constexpr uint8_t kLongestGap = 127;

bool IsMagic(uint8_t byte) { return byte == kMagic1 || byte == kMagic2; }

uint16_t Accumulate(uint16_t crc, uint8_t byte) {
  const uint8_t x = static_cast<uint8_t>(byte ^ (crc & 0xFF));
  const uint8_t t = static_cast<uint8_t>(x ^ (x << 4));
  return static_cast<uint16_t>((crc >> 8) ^ (t << 8) ^ (t << 3) ^ (t >> 4));
}

/// What the bytes of a frame's header say; `size` is that of the whole frame.
struct Header {
  Frame frame;
  std::size_t header, payload, size;
  bool is_signed = false, understood = true;
};

Header ReadHeader1(const uint8_t* p) {
  Header h{};
  h.frame.version = 1;
  h.frame.sequence = p[2], h.frame.system = p[3], h.frame.component = p[4], h.frame.id = p[5];
  h.header = kHeader1, h.payload = p[1];
  h.size = kHeader1 + h.payload + kChecksumBytes;
  h.understood = true;
  return h;
}

Header ReadHeader2(const uint8_t* p) {
  Header h{};
  h.frame.version = 2;
  h.frame.sequence = p[4], h.frame.system = p[5], h.frame.component = p[6];
  h.frame.id = p[7] | static_cast<uint32_t>(p[8]) << 8 | static_cast<uint32_t>(p[9]) << 16;
  h.header = kHeader2, h.payload = p[1];
  h.is_signed = (p[2] & kSigned) != 0;
  h.understood = (p[2] & ~kSigned) == 0;  // other flags change what follows
  h.size = kHeader2 + h.payload + kChecksumBytes + (h.is_signed ? kSignatureBytes : 0);
  return h;
}

bool ChecksumHolds(const Header& h, const uint8_t* data, uint8_t extra) {
  const std::size_t end = h.header + h.payload;
  return FrameChecksum(data + 1, end - 1, extra) == (data[end] | data[end + 1] << 8);
}

}  // namespace

uint16_t FrameChecksum(const uint8_t* data, std::size_t size, uint8_t extra) {
  uint16_t crc = 0xFFFF;
  for (std::size_t i = 0; i < size; ++i) crc = Accumulate(crc, data[i]);
  return Accumulate(crc, extra);
}

std::optional<uint8_t> ChecksumExtra(uint32_t id) {
  const auto* row =
      std::lower_bound(std::begin(mav::kChecksums), std::end(mav::kChecksums), id,
                       [](const mav::Checksum& c, uint32_t wanted) { return c.id < wanted; });
  if (row == std::end(mav::kChecksums) || row->id != id) return std::nullopt;
  return row->extra;
}

void FrameReader::Add(int64_t utime, const uint8_t* data, std::size_t size, const Taker& take) {
  buffer_.insert(buffer_.end(), data, data + size);
  std::size_t at = 0;
  while (at < buffer_.size()) {
    const std::size_t used = TakeOne(utime, buffer_.data() + at, buffer_.size() - at, take);
    if (used == 0) break;
    at += used;
  }
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at));
}

/// Bytes that are dealt with; 0: the frame goes on in bytes to come.
std::size_t FrameReader::TakeOne(int64_t utime, const uint8_t* data, std::size_t size,
                                 const Taker& take) {
  if (!IsMagic(data[0])) return 1;
  const bool first = data[0] == kMagic1;
  if (size < (first ? kHeader1 : kHeader2)) return 0;
  Header h = first ? ReadHeader1(data) : ReadHeader2(data);
  if (!h.understood) return 1;
  if (size < h.size) return 0;
  const std::optional<uint8_t> extra = ChecksumExtra(h.frame.id);
  if (extra && !ChecksumHolds(h, data, *extra)) {
    ++counters_.bad_checksum;
    return 1;
  }
  // Noise that looks like a frame of no definition: behind a true one another begins.
  if (!extra && size > h.size && !IsMagic(data[h.size])) return 1;
  if (!IsGenuine(utime, h.frame, data, h.is_signed ? h.size : 0)) {
    ++counters_.refused;
    return h.size;
  }
  CountGap(h.frame);
  if (!extra) {
    ++counters_.unknown;
    return h.size;
  }
  std::copy_n(data + h.header, h.payload, h.frame.payload.bytes.begin());
  h.frame.payload.length = h.payload;
  ++counters_.frames;
  take(h.frame);
  return h.size;
}

/// `size` is that of a signed frame, else 0.
bool FrameReader::IsGenuine(int64_t utime, const Frame& frame, const uint8_t* data,
                            std::size_t size) {
  if (signing_ == nullptr) return true;
  if (size == 0) return false;
  const auto verdict = signing_->Judge(utime, frame.system, frame.component, data, size);
  counters_.late += verdict == Signing::Verdict::kLate;
  return verdict == Signing::Verdict::kGenuine;
}

void FrameReader::CountGap(const Frame& frame) {
  const std::pair sender{frame.system, frame.component};
  const auto last = last_.find(sender);
  if (last != last_.end()) {
    const auto gap = static_cast<uint8_t>(frame.sequence - last->second - 1);
    if (gap <= kLongestGap) {
      lost_[sender] += gap;
      counters_.lost += gap;
    }
  }
  last_[sender] = frame.sequence;
}

std::vector<uint8_t> FrameWriter::Write(int64_t utime, uint32_t id, const Payload& payload) {
  std::size_t length = payload.length;
  while (length > 1 && payload.bytes[length - 1] == 0) --length;  // the first byte always stays
  std::vector<uint8_t> frame = {kMagic2,
                                static_cast<uint8_t>(length),
                                static_cast<uint8_t>(signing_ ? kSigned : 0),
                                0,
                                sequence_++,
                                system_,
                                component_,
                                static_cast<uint8_t>(id),
                                static_cast<uint8_t>(id >> 8),
                                static_cast<uint8_t>(id >> 16)};
  frame.insert(frame.end(), payload.bytes.begin(),
               payload.bytes.begin() + static_cast<std::ptrdiff_t>(length));
  const uint16_t crc =
      FrameChecksum(frame.data() + 1, frame.size() - 1, ChecksumExtra(id).value_or(0));
  frame.push_back(static_cast<uint8_t>(crc));
  frame.push_back(static_cast<uint8_t>(crc >> 8));
  if (signing_) signing_->Sign(utime, &frame);
  return frame;
}

}  // namespace chase::mavlink
