#include "services/lidar/packet_source.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "services/lidar/pcap_reader.h"
#include "services/lidar/udp_source.h"
#include "services/lidar/vlp16.h"

namespace chase::lidar {
namespace {

std::vector<uint8_t> ReadBytes(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    throw std::runtime_error(file + ": cannot be opened; check the path and its permissions");
  std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  if (bytes.empty()) throw std::runtime_error(file + ": is empty or no file; record it again");
  return bytes;
}

/// Packets in memory, in the file's order.
class RecordingSource : public PacketSource {
 public:
  explicit RecordingSource(std::vector<RawPacket> packets) : packets_(std::move(packets)) {}
  std::optional<RawPacket> Next() override {
    if (next_ == packets_.size()) return std::nullopt;
    return std::move(packets_[next_++]);
  }
  bool IsRecording() const override { return true; }

 private:
  std::vector<RawPacket> packets_;
  size_t next_ = 0;
};

std::vector<RawPacket> SplitRaw(const std::vector<uint8_t>& bytes, const std::string& file) {
  const std::string problem = PacketProblem(bytes.data(), std::min(bytes.size(), kPacketBytes));
  if (!problem.empty())
    throw std::runtime_error(file + ": neither a pcap capture nor raw VLP-16 packets (" + problem +
                             "); give a .pcap or 1206-byte packets back to back");
  if (bytes.size() % kPacketBytes != 0)
    throw std::runtime_error(file + ": " + std::to_string(bytes.size() % kPacketBytes) +
                             " bytes follow the last whole packet; the file is cut off");
  std::vector<RawPacket> packets;
  for (auto at = bytes.begin(); at != bytes.end(); at += kPacketBytes)
    packets.push_back({{at, at + kPacketBytes}, 0});
  return packets;
}

std::vector<RawPacket> ReadCapture(const std::vector<uint8_t>& bytes, const std::string& file,
                                   int port) {
  std::vector<RawPacket> packets;
  for (PcapDatagram& d : ReadPcap(bytes, file))
    if (d.port == port) packets.push_back({std::move(d.payload), d.utime});
  if (packets.empty())
    throw std::runtime_error(file + ": no packet for UDP port " + std::to_string(port) +
                             "; set port to the one the sensor sends to");
  return packets;
}

}  // namespace

std::unique_ptr<PacketSource> OpenPacketSource(const std::string& source, int port) {
  if (source == "udp") return OpenUdpSource(port);
  const auto bytes = ReadBytes(source);
  auto packets = IsPcap(bytes) ? ReadCapture(bytes, source, port) : SplitRaw(bytes, source);
  return std::make_unique<RecordingSource>(std::move(packets));
}

}  // namespace chase::lidar
