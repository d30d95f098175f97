#include "services/lidar/pcap_reader.h"

#include <pcap/pcap.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>

namespace chase::lidar {
namespace {

// The first four bytes of a file: classic pcap in either byte order, in micro- and nanoseconds, and
// pcapng.
constexpr uint8_t kMagics[][4] = {{0xd4, 0xc3, 0xb2, 0xa1},
                                  {0xa1, 0xb2, 0xc3, 0xd4},
                                  {0x4d, 0x3c, 0xb2, 0xa1},
                                  {0xa1, 0xb2, 0x3c, 0x4d},
                                  {0x0a, 0x0d, 0x0d, 0x0a}};

using Bytes = std::vector<uint8_t>;

struct Closer {
  void operator()(pcap_t* capture) const { pcap_close(capture); }
};
using Capture = std::unique_ptr<pcap_t, Closer>;

int Big16(const uint8_t* p) { return p[0] << 8 | p[1]; }

Capture Open(const Bytes& bytes, const std::string& file) {
  char error[PCAP_ERRBUF_SIZE] = "out of memory";
  FILE* stream = fmemopen(const_cast<uint8_t*>(bytes.data()), bytes.size(), "rb");
  pcap_t* capture = stream != nullptr ? pcap_fopen_offline(stream, error) : nullptr;
  if (capture != nullptr) return Capture(capture);
  if (stream != nullptr) std::fclose(stream);
  throw std::runtime_error(file + ": no capture that libpcap reads (" + error +
                           "); record it again, with tcpdump -w");
}

/// Offset of the IPv4 header in a frame, or nothing.
std::optional<size_t> IpOffset(int link_type, const uint8_t* frame, size_t size) {
  const auto at = [&](size_t type) -> std::optional<size_t> {
    if (size < type + 2) return std::nullopt;
    if (Big16(frame + type) == 0x8100) type += 4;  // VLAN tag
    if (size < type + 2 || Big16(frame + type) != 0x0800) return std::nullopt;
    return type + 2;
  };
  switch (link_type) {
    case DLT_EN10MB:
      return at(12);
    case DLT_RAW:
      return size_t{0};
    case DLT_LINUX_SLL:
      return at(14);
    case DLT_LINUX_SLL2:
      return size >= 20 && Big16(frame) == 0x0800 ? std::optional<size_t>(20) : std::nullopt;
    default:
      return std::nullopt;
  }
}

bool IsRead(int link_type) {
  return link_type == DLT_EN10MB || link_type == DLT_RAW || link_type == DLT_LINUX_SLL ||
         link_type == DLT_LINUX_SLL2;
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
  return bytes.size() >= 4 && std::any_of(std::begin(kMagics), std::end(kMagics), [&](auto& magic) {
           return std::memcmp(bytes.data(), magic, sizeof magic) == 0;
         });
}

std::vector<PcapDatagram> ReadPcap(const Bytes& bytes, const std::string& file) {
  const Capture capture = Open(bytes, file);
  const int link_type = pcap_datalink(capture.get());
  if (!IsRead(link_type))
    throw std::runtime_error(file + ": link type " + std::to_string(link_type) +
                             " is not read; capture on Ethernet");
  std::vector<PcapDatagram> out;
  pcap_pkthdr* header = nullptr;
  const uint8_t* frame = nullptr;
  while (pcap_next_ex(capture.get(), &header, &frame) == 1) {
    const auto ip = IpOffset(link_type, frame, header->caplen);
    auto datagram = ip ? ParseUdp(frame + *ip, header->caplen - *ip) : std::nullopt;
    if (!datagram) continue;
    datagram->utime = int64_t{header->ts.tv_sec} * 1'000'000 + header->ts.tv_usec;
    out.push_back(std::move(*datagram));
  }
  return out;
}

}  // namespace chase::lidar
