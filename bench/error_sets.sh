#!/usr/bin/env bash
# Dives every mission with a known map under each set of errors, and under all of them at once:
#   bench/error_sets.sh FIRST_SEED [DIVES [FOLDER]]     draw the first seed: od -An -N3 -tu4 /dev/urandom
# Writes the output of mission_dives to FOLDER/SET.MISSION.txt and prints a line for each.
set -euo pipefail
cd "$(dirname "$0")/.."
first=$1
dives=${2:-24}
folder=${3:-$(mktemp -d)}
mkdir -p "$folder"
missions="window cluttered pool1 pool2 pool3 pool4 maze orbit wreck penetration transect survey blocks"
# One standard deviation each; shifts per axis.
declare -A errors=(
  [shipped]=""
  [current]="current_x=0.03 current_y=0.04"
  [heading]="speed_scale_sigma=0.03 heading_bias_sigma_deg=2"
  [map]="map_shift_sigma_m=0.21 map_turn_sigma_deg=1"
  [objects]="object_shift_sigma_m=0.07"
)
errors[all]="${errors[current]} ${errors[heading]} ${errors[map]} ${errors[objects]} hull_scatter=0.2
  buoyancy_sigma_n=0.1 start_sigma_m=0.2 tilt_bias_sigma_deg=0.3 gyro_bias_sigma=0.003
  depth_bias_sigma_m=0.03 heading_variation_deg=0.5"
for name in all current heading map objects shipped; do
  settings=()
  for setting in ${errors[$name]}; do settings+=(--set "$setting"); done
  for mission in $missions; do
    result="$folder/$name.$mission.txt"
    build/release/mission_dives "missions/$mission.xml" --first "$first" --dives "$dives" \
      "${settings[@]}" > "$result"
    echo "$name: $(grep -E '^missions/.* dives, ' "$result" | sed 's/.*xml: //')" \
      "($mission)$(grep -oE 'p05 [0-9.]+' "$result" | head -1 | sed 's/^/, clearance /') m" \
      "$(grep -oE 'NEES [0-9.]+' "$result" | head -1)"
  done
done
echo "$folder"
