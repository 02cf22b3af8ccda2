#!/usr/bin/env bash
# Does a dive depend on the CPU? Every mission (default: all shipped ones) is dived as this CPU does
# and as one without AVX2 and FMA; the logs must agree byte for byte, and each must replay
# identically in the other setting and on two emulated CPUs (qemu-user, where it is installed).
#   bench/compare_cpus.sh [--build build/release] [MISSION...]
# A mission with cameras may give two different logs, because OpenCV chooses code by the CPU, but each
# must replay. Exit status 1 if anything else differs.
set -euo pipefail

build=build/release
if [ "${1:-}" = --build ]; then
  build=$2
  shift 2
fi
case "${1:-}" in
  -*)
    sed -n '2,8p' "$0" | sed 's/^# \{0,1\}//' >&2
    exit 2
    ;;
esac
[ $# -gt 0 ] || set -- missions/*.xml

old_cpu=(env GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F)
settings=("env" "${old_cpu[*]}")
if command -v qemu-x86_64 >/dev/null; then
  settings+=("qemu-x86_64 -cpu Nehalem" "qemu-x86_64 -cpu max")
else
  echo "qemu-user is not installed: no emulated CPUs"
fi

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
failed=0
for mission in "$@"; do
  name=$(basename "$mission" .xml)
  "$build/dive" run "$mission" --log "$logs/a.lcmlog" >/dev/null 2>&1 || true
  "${old_cpu[@]}" "$build/dive" run "$mission" --log "$logs/b.lcmlog" >/dev/null 2>&1 || true
  result="same log"
  if ! cmp -s "$logs/a.lcmlog" "$logs/b.lcmlog"; then
    result="logs differ"
    grep -q 'estimator="visual_inertial"' "$mission" || failed=1
  fi
  for log in a b; do
    for setting in "${settings[@]}"; do
      # The words of a setting are a command.
      # shellcheck disable=SC2086
      if ! $setting "$build/dive" replay "$logs/$log.lcmlog" >"$logs/replay.txt" 2>&1; then
        result="$result; $setting: $(tr '\n' ' ' <"$logs/replay.txt")"
        failed=1
      fi
    done
  done
  echo "$name: $result"
  rm -f "$logs"/*
done
exit "$failed"
