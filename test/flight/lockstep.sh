#!/usr/bin/env bash
# The first seconds of a flight from raw sensors, flown twice: the two logs must be the same bytes.
# Usage: lockstep.sh BIN_DIR SCENARIO OUT.lcm
set -euo pipefail
bin=$1 scenario=$2 out=$3
"$bin/chase-flight" "$scenario" --sensors raw --seed 1 --until 8 --log "$out.second"
"$bin/chase-flight" "$scenario" --sensors raw --seed 1 --until 8 --log "$out"
cmp "$out" "$out.second"
rm "$out.second"
echo "two flights, the same $(stat -c %s "$out") bytes"
