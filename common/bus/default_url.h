#pragma once

#include <filesystem>
#include <string>

namespace chase::bus {

/// UDP multicast that stays on this host, with room for a few sweeps and frames.
inline constexpr char kDefaultUrl[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152";

/// The URL that a file of KEY=VALUE lines for systemd's EnvironmentFile sets as LCM_DEFAULT_URL,
/// the last one if there are several; empty where there is none, or no such file.
std::string UrlOf(const std::filesystem::path& environment);

/// Where everything speaks: what the environment says in LCM_DEFAULT_URL; else, for an installed
/// program, what the vehicle's units are told in /etc/chase/environment; else kDefaultUrl.
std::string DefaultUrl();

}  // namespace chase::bus
