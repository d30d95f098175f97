#pragma once

#include <memory>

#include "services/lidar/packet_source.h"

namespace chase::lidar {

/// Listens on every interface. A packet's arrival is when the kernel took it in, however late it
/// is fetched. Throws std::runtime_error when the port cannot be had.
std::unique_ptr<PacketSource> OpenUdpSource(int port);

}  // namespace chase::lidar
