#!/usr/bin/env bash
set -euo pipefail
cd "$(dirname "$0")"

usage() {
  cat << 'TEXT'
Installs, checks the format of the sources and their words, builds and runs the tests in the
release preset.
  ./check.sh           what one runs before a commit
  ./check.sh --ci      and builds the benchmarks, and under the address and undefined-behaviour
                       sanitizers the tests of what reads what others wrote
Before a release, each of which takes another half hour or more:
  ./check.sh --tidy    clang-tidy alone, on what flies
  ./check.sh --long    with the tests that take minutes each
  ./check.sh --asan    and builds the benchmarks, and all tests under the sanitizers
TEXT
}

sanitize=
only_tidy=
unset DIVE_LONG_TESTS
for argument in "$@"; do
  case "$argument" in
    --ci) sanitize=sanitized ;;
    --tidy) only_tidy=yes ;;
    --long) export DIVE_LONG_TESTS=1 ;;
    --asan) sanitize=all ;;
    --help)
      usage
      exit
      ;;
    *)
      usage >&2
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
if grep -rnwiIE "$(paste -sd'|' doc/unused-words.txt)" --exclude=unused-words.txt \
  README.md behaviors bench cmake common doc estimation mission missions planning test vehicle; then
  echo "These words are listed in doc/unused-words.txt: say it in plain words." >&2
  exit 1
fi
# What flies, and what it stands on. Not read: simulator, checks, log, reports and command line, for
# which there is not the time, and planning/world/hull.cpp, whose CGAL clang 19 does not compile. The
# preset joins each library's sources to one file, because the headers that they share take four
# fifths of the time: names in unnamed namespaces must differ within a library.
tidy() {
  echo "== clang-tidy"
  cmake --preset tidy --log-level=WARNING > /dev/null
  cmake --build --preset tidy --target dive_messages_generated > /dev/null
  local library source sources=()
  for library in common world trajopt warm_start certify planner mapping map_matching \
    estimation klt visual_front_end visual_inertial_filter loop_closure tags stereo_range vision \
    vehicle exit_guidance link behaviors statechart executive onboard linked; do
    source=$(find build/tidy -path "*/dive_$library.dir/Unity/unity_0_cxx.cxx")
    [ -n "$source" ] || { echo "there is no library dive_$library" >&2; return 1; }
    sources+=("$source")
  done
  run-clang-tidy-19 -quiet -j2 -p build/tidy -warnings-as-errors='*' "${sources[@]}" 2> /dev/null |
    sed '/warnings generated/d; /^$/d'
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
check release "$([ -n "$sanitize" ] && echo all || echo tests)"
case "$sanitize" in
  sanitized) check asan sanitized_tests -L sanitized ;;
  all) check asan all ;;
esac
