#!/usr/bin/env bash
# Installs, checks the format of the sources and their words, builds and runs all tests in the
# release preset.
#   ./check.sh           what one runs before a commit
#   ./check.sh --asan    the same again under the address and undefined-behaviour sanitizers
set -euo pipefail
cd "$(dirname "$0")"

presets=(release)
for argument in "$@"; do
  case "$argument" in
    --asan) presets+=(asan) ;;
    *)
      sed -n '2,5p' "$0" | sed 's/^# \{0,1\}//' >&2
      exit 2
      ;;
  esac
done

.ci/install
echo "== format"
find behaviors bench common estimation mission planning test vehicle \( -name '*.h' -o -name '*.cpp' \) \
  -print0 | xargs -0 clang-format --dry-run -Werror
echo "== words"
# Words of doc/unused-words.txt have no right use here: doc/glossary.md has the plain ones.
if grep -rnwiIE "$(paste -sd'|' doc/unused-words.txt)" --exclude={name-changes.md,unused-words.txt} \
  README.md behaviors bench cmake common doc estimation mission missions planning test vehicle; then
  echo "These words are listed in doc/unused-words.txt: say it in plain words." >&2
  exit 1
fi
for preset in "${presets[@]}"; do
  echo "== $preset"
  [ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" --log-level=WARNING
  cmake --build --preset "$preset" -j2
  ctest --preset "$preset" -j2
done
