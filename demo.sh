#!/usr/bin/env bash
# Installs, builds, checks the Window mission on deck, dives it in the simulator and writes a report.
set -euo pipefail
cd "$(dirname "$0")"

.ci/install
[ -f build/release/build.ninja ] || cmake --preset release --log-level=WARNING
cmake --build --preset release -j2 --target dive

dive=build/release/dive
echo
echo "== dive check missions/window.xml"
"$dive" check missions/window.xml
echo
echo "== dive run missions/window.xml"
"$dive" run missions/window.xml --log dive-runs/window.lcmlog --svg dive-runs/window.svg --force
echo "  drawing dive-runs/window.svg"
echo
echo "== dive replay dive-runs/window.lcmlog"
"$dive" replay dive-runs/window.lcmlog
echo
echo "== dive report dive-runs/window.lcmlog"
"$dive" report dive-runs/window.lcmlog --output dive-runs/window.html --force > /dev/null
echo "Open it in a browser (it needs no network):"
echo "$PWD/dive-runs/window.html"
