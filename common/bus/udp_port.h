#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace chase::bus {

/// A socket that never blocks, bound to a UDP port (0: any) of one address of this host; the caller
/// closes it. `receive_bytes`: of its buffer, 0: the system's. Throws std::runtime_error, one line
/// with the cure.
int OpenUdpPort(int port, in_addr_t address = INADDR_ANY, int receive_bytes = 0);

/// The next datagram that is there and who sent it.
std::optional<std::vector<uint8_t>> NextDatagram(int fd, sockaddr_in* from);

}  // namespace chase::bus
