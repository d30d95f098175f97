#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::lidar {

/// A UDP datagram from a capture.
struct PcapDatagram {
  int64_t utime = 0;  ///< arrival, microseconds
  int port = 0;       ///< destination
  std::vector<uint8_t> payload;
};

/// True for classic pcap and pcapng files.
bool IsPcap(const std::vector<uint8_t>& bytes);

/// All unfragmented IPv4 UDP datagrams of a capture that libpcap reads (pcap and pcapng; Ethernet
/// with or without VLAN tag, raw IP, Linux cooked), in order. Throws std::runtime_error naming
/// `file`. A record that the file's end cuts off is left out.
std::vector<PcapDatagram> ReadPcap(const std::vector<uint8_t>& bytes, const std::string& file);

}  // namespace chase::lidar
