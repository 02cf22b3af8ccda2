#!/usr/bin/env bash
# Do two revisions dive alike? Every shipped scenario and three seeds of every shipped mission, as
# text (trace_dives.cpp): decisions, states, transitions and each command.
#   bench/compare_dives.sh dive build/release before      in one revision's folder
#   bench/compare_dives.sh dive build/release after       in the other's
#   bench/compare_dives.sh compare before after [NAMES]   lists the files that differ, and where
# NAMES has a line "old new" for each name that was changed between the two.
set -euo pipefail

seeds=(11 12 13)

usage() {
  sed -n '2,7p' "$0" | sed 's/^# \{0,1\}//' >&2
  exit 2
}

# Logs are large: each is traced and deleted before the next dive.
trace() {
  "$build/trace_dives" --output "$traces" "$1"
  rm -f "$1"
}

dive_all() {
  build=$1
  traces=$2
  logs=$(mktemp -d)
  trap 'rm -rf "$logs"' EXIT
  mkdir -p "$traces"
  for scenario in missions/scenarios/*.xml; do
    "$build/dive" test "$scenario" --keep "$logs" --keep-all >/dev/null || true
    for log in "$logs"/*.lcmlog; do
      trace "$log"
    done
    rm -rf "${logs:?}"/*
  done
  for mission in missions/*.xml; do
    for seed in "${seeds[@]}"; do
      log="$logs/$(basename "$mission" .xml)-seed$seed.lcmlog"
      "$build/dive" run "$mission" --seed "$seed" --log "$log" >/dev/null || true
      trace "$log"
      rm -rf "${logs:?}"/*
    done
  done
}

compare() {
  local before=$1 after=$2 names=${3:-/dev/null} different=0 total=0
  local rename
  rename=$(awk 'NF == 2 { printf "s/\\b%s\\b/%s/g\n", $1, $2 }' "$names")
  for file in "$before"/*.txt; do
    total=$((total + 1))
    local other
    other="$after/$(basename "$file" | sed "$rename")"
    if [ ! -f "$other" ]; then
      echo "$(basename "$file"): missing in $after"
      different=$((different + 1))
    elif ! first=$(cmp <(sed "$rename" "$file") "$other" 2>&1); then
      line=${first##* }
      echo "$(basename "$file"): line $line"
      sed "$rename" "$file" | sed -n "${line}p" | sed 's/^/  before: /'
      sed -n "${line}p" "$other" | sed 's/^/  after:  /'
      different=$((different + 1))
    fi
  done
  echo "$total dives, $different different"
  [ "$different" -eq 0 ]
}

case "${1:-}" in
  dive) [ $# -eq 3 ] || usage; dive_all "$2" "$3" ;;
  compare) [ $# -ge 3 ] || usage; compare "$2" "$3" "${4:-}" ;;
  *) usage ;;
esac
