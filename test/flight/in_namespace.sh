#!/usr/bin/env bash
# Runs a command in a network namespace of its own with multicast on the loopback interface, so that
# neither a flight on this machine nor a firewall takes part. Usage: in_namespace.sh COMMAND...
set -euo pipefail
case ${1:-} in
  -h | --help) sed -n '2,/^set/s/^# //p' "$0"; exit ;;
  --version) exec python3 -B "$(dirname "${BASH_SOURCE[0]}")/../../deploy/launcher/version.py" ;;
  "" | -*) echo "in_namespace.sh: needs a command, not '${1:-}'; see in_namespace.sh --help" >&2; exit 1 ;;
esac
exec unshare --net --map-root-user bash -c '
  ip link set lo up
  ip link set lo multicast on
  ip route add 239.255.76.67/32 dev lo
  exec "$@"' bash "$@"
