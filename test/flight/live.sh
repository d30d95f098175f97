#!/usr/bin/env bash
# A live flight over UDP multicast in a network namespace of its own, so that neither another flight on
# this machine nor a firewall takes part. Usage: live.sh SCENARIO SEED
set -euo pipefail
scenario=$1 seed=$2
exec unshare --net --map-root-user sh -c "
  ip link set lo up
  ip link set lo multicast on
  ip route add 239.255.76.67/32 dev lo
  exec deploy/fly $scenario --seed $seed"
