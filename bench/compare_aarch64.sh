#!/usr/bin/env bash
# Does a log of x86-64 replay on aarch64, the architecture of most vehicle computers? Every mission
# (default: all shipped ones) is dived here, and its log replayed by a cross build under qemu-user.
#   bench/compare_aarch64.sh ARM64_DIVE SYSROOT [MISSION...]
# ARM64_DIVE: the program of a cross build, SYSROOT: the folder with its libraries; the README of
# bench/ says how to make both. A replay must be identical or say that the log was made with other
# mathematics (doc/decisions/pinned-mathematics.md); exit status 1 if one diverges or cannot run.
set -euo pipefail

if [ $# -lt 2 ]; then
  sed -n '2,7p' "$0" | sed 's/^# \{0,1\}//' >&2
  exit 2
fi
arm64_dive=$1
sysroot=$2
shift 2
[ $# -gt 0 ] || set -- missions/*.xml

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
failed=0
for mission in "$@"; do
  build/release/dive run "$mission" --log "$logs/dive.lcmlog" >/dev/null 2>&1 || true
  status=0
  qemu-aarch64 -L "$sysroot" "$arm64_dive" replay "$logs/dive.lcmlog" >"$logs/replay.txt" 2>&1 ||
    status=$?
  [ -s "$logs/replay.txt" ] || echo "no replay, exit status $status" >"$logs/replay.txt"
  if [ $status -ne 0 ] && ! grep -q "OTHER MATHEMATICS" "$logs/replay.txt"; then failed=1; fi
  echo "$(basename "$mission" .xml): $(sed '1s/^.*lcmlog: //;q' "$logs/replay.txt")"
  rm -f "$logs"/*
done
exit $failed
