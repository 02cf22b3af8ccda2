#!/usr/bin/env bash
# Installs, checks the format of the sources and their words, builds and runs the tests in the
# release preset.
#   ./check.sh           what one runs before a commit
#   ./check.sh --ci      and the tests that take minutes each, a build of the benchmarks, and under
#                        the address and undefined-behaviour sanitizers the tests of what runs on
#                        board or reads what others wrote
#   ./check.sh --tidy    clang-tidy 19 (package clang-tidy-19) on what flies
#   ./check.sh --asan    and all of them under these sanitizers (once before a release: half an hour)
set -euo pipefail
cd "$(dirname "$0")"

sanitize=
only_tidy=
for argument in "$@"; do
  case "$argument" in
    --ci) sanitize=sanitized ;;
    --tidy) only_tidy=yes ;;
    --asan) sanitize=all ;;
    *)
      sed -n '2,10p' "$0" | sed 's/^# \{0,1\}//' >&2
      exit 2
      ;;
  esac
done

.ci/install
echo "== format"
find behaviors bench common estimation mission planning test vehicle \
  \( -name '*.h' -o -name '*.cpp' -o -name '*.js' \) -print0 | xargs -0 clang-format --dry-run -Werror
echo "== words"
# Words of doc/unused-words.txt have no right use here: doc/glossary.md has the plain ones.
if grep -rnwiIE "$(paste -sd'|' doc/unused-words.txt)" --exclude={name-changes.md,unused-words.txt} \
  README.md behaviors bench cmake common doc estimation mission missions planning test vehicle; then
  echo "These words are listed in doc/unused-words.txt: say it in plain words." >&2
  exit 1
fi
# What flies: behaviours, executive, the loop on board and its link, estimation and vehicle.
tidy() {
  echo "== clang-tidy"
  command -v run-clang-tidy-19 > /dev/null || { echo "install clang-tidy-19" >&2; exit 2; }
  cmake --preset tidy --log-level=WARNING > /dev/null
  cmake --build --preset tidy --target dive_messages_generated > /dev/null
  run-clang-tidy-19 -quiet -j2 -p build/tidy -warnings-as-errors='*' -extra-arg=-Wno-unknown-warning-option \
    "$PWD/(behaviors|mission/executive|mission/onboard|mission/link|estimation|vehicle|vehicle/link)/[^/]*\\.cpp\$" \
    2> /dev/null
}
if [ -n "$only_tidy" ]; then
  tidy
  exit
fi
# check PRESET TARGET CTEST_ARGUMENTS...
check() {
  echo "== $1"
  [ -f "build/$1/build.ninja" ] || cmake --preset "$1" --log-level=WARNING
  cmake --build --preset "$1" -j2 --target "$2"
  ctest --preset "$1" -j2 "${@:3}"
}
[ -z "$sanitize" ] || export DIVE_LONG_TESTS=1
check release "$([ -z "$sanitize" ] && echo tests || echo all)"
case "$sanitize" in
  sanitized) check asan sanitized_tests -L sanitized ;;
  all) check asan all ;;
esac
