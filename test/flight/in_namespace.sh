#!/usr/bin/env bash
# Runs a command in a network namespace of its own with multicast on the loopback interface, so that
# neither a flight on this machine nor a firewall takes part. Usage: in_namespace.sh COMMAND...
set -euo pipefail
exec unshare --net --map-root-user bash -c '
  ip link set lo up
  ip link set lo multicast on
  ip route add 239.255.76.67/32 dev lo
  exec "$@"' bash "$@"
