#include "services/lidar/pcap_reader.h"

#include <optional>
#include <stdexcept>

namespace chase::lidar {
namespace {

constexpr uint32_t kMicros = 0xa1b2c3d4, kNanos = 0xa1b23c4d, kNextGeneration = 0x0a0d0d0a;
constexpr size_t kFileHeader = 24, kRecordHeader = 16;

using Bytes = std::vector<uint8_t>;

uint32_t Little(const uint8_t* p) {
  return static_cast<uint32_t>(p[0]) | static_cast<uint32_t>(p[1]) << 8 |
         static_cast<uint32_t>(p[2]) << 16 | static_cast<uint32_t>(p[3]) << 24;
}
uint32_t Swapped(uint32_t v) {
  return (v >> 24) | ((v >> 8) & 0xff00u) | ((v << 8) & 0xff0000u) | (v << 24);
}
int Big16(const uint8_t* p) { return p[0] << 8 | p[1]; }

struct Format {
  bool swapped = false, nanos = false;
  uint32_t Word(const uint8_t* p) const { return swapped ? Swapped(Little(p)) : Little(p); }
};

std::optional<Format> FormatOf(const Bytes& bytes) {
  if (bytes.size() < kFileHeader) return std::nullopt;
  const uint32_t magic = Little(bytes.data());
  for (const bool swapped : {false, true}) {
    const uint32_t m = swapped ? Swapped(magic) : magic;
    if (m == kMicros || m == kNanos) return Format{swapped, m == kNanos};
  }
  return std::nullopt;
}

/// Offset of the IPv4 header in a frame, or nothing.
std::optional<size_t> IpOffset(uint32_t link_type, const uint8_t* frame, size_t size) {
  const auto at = [&](size_t type) -> std::optional<size_t> {
    if (size < type + 2) return std::nullopt;
    if (Big16(frame + type) == 0x8100) type += 4;  // VLAN tag
    if (size < type + 2 || Big16(frame + type) != 0x0800) return std::nullopt;
    return type + 2;
  };
  switch (link_type) {
    case 1:
      return at(12);
    case 101:
      return size_t{0};
    case 113:
      return at(14);
    default:
      return std::nullopt;
  }
}

std::optional<PcapDatagram> ParseUdp(const uint8_t* ip, size_t size) {
  constexpr uint8_t kUdp = 17;
  if (size < 20 || ip[0] >> 4 != 4 || ip[9] != kUdp) return std::nullopt;
  if ((Big16(ip + 6) & 0x3fff) != 0) return std::nullopt;  // a fragment
  const size_t header = 4u * (ip[0] & 0x0fu);
  if (header < 20 || size < header + 8) return std::nullopt;
  const uint8_t* udp = ip + header;
  const auto length = static_cast<size_t>(Big16(udp + 4));
  if (length < 8 || size < header + length) return std::nullopt;
  return PcapDatagram{0, Big16(udp + 2), Bytes(udp + 8, udp + length)};
}

}  // namespace

bool IsPcap(const Bytes& bytes) {
  return FormatOf(bytes) || (bytes.size() >= 4 && Little(bytes.data()) == kNextGeneration);
}

std::vector<PcapDatagram> ReadPcap(const Bytes& bytes, const std::string& file) {
  const auto format = FormatOf(bytes);
  if (!format)
    throw std::runtime_error(file + ": pcapng is not read; convert it with editcap -F pcap");
  const uint32_t link_type = format->Word(bytes.data() + 20) & 0xffffu;
  if (link_type != 1 && link_type != 101 && link_type != 113)
    throw std::runtime_error(file + ": link type " + std::to_string(link_type) +
                             " is not read; capture on Ethernet");
  std::vector<PcapDatagram> out;
  for (size_t at = kFileHeader; at + kRecordHeader <= bytes.size();) {
    const uint8_t* record = bytes.data() + at;
    const size_t size = format->Word(record + 8);
    at += kRecordHeader;
    if (size > bytes.size() - at) break;
    const auto ip = IpOffset(link_type, bytes.data() + at, size);
    auto datagram =
        ip ? ParseUdp(bytes.data() + at + *ip, size - *ip) : std::optional<PcapDatagram>();
    if (datagram) {
      const uint32_t fraction = format->Word(record + 4);
      datagram->utime =
          int64_t{format->Word(record)} * 1000000 + (format->nanos ? fraction / 1000 : fraction);
      out.push_back(std::move(*datagram));
    }
    at += size;
  }
  return out;
}

}  // namespace chase::lidar
