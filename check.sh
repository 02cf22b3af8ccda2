#!/usr/bin/env bash
# Installs, builds and runs all tests in the release preset.
#   ./check.sh           what one runs before a commit
#   ./check.sh --asan    the same again under the address and undefined-behaviour sanitizers
set -euo pipefail
cd "$(dirname "$0")"

presets=(release)
for argument in "$@"; do
  case "$argument" in
    --asan) presets+=(asan) ;;
    *)
      sed -n '2,4p' "$0" | sed 's/^# \{0,1\}//' >&2
      exit 2
      ;;
  esac
done

.ci/install
for preset in "${presets[@]}"; do
  echo "== $preset"
  [ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" --log-level=WARNING
  cmake --build --preset "$preset" -j2
  ctest --preset "$preset" -j2
done
