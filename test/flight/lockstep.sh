#!/usr/bin/env bash
# The first seconds of a flight from raw sensors, flown twice: the two logs must be the same bytes.
# Usage: lockstep.sh BIN_DIR SCENARIO OUT.lcm
set -euo pipefail
case ${1:-} in
  -h | --help) sed -n '2,/^set/s/^# //p' "$0"; exit ;;
  --version) exec python3 -B "$(dirname "${BASH_SOURCE[0]}")/../../deploy/launcher/version.py" ;;
esac
[ $# = 3 ] || { echo "lockstep.sh: takes 3 arguments, not $#; see lockstep.sh --help" >&2; exit 1; }
bin=$1 scenario=$2 out=$3
"$bin/chase-flight" "$scenario" --sensors raw --seed 1 --until 8 --log "$out.second"
"$bin/chase-flight" "$scenario" --sensors raw --seed 1 --until 8 --log "$out"
cmp "$out" "$out.second"
rm "$out.second"
echo "two flights, the same $(stat -c %s "$out") bytes"
