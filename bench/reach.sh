#!/usr/bin/env bash
# The detector against its goals (README.md here): generates labelled frames, then prints every table.
#
#   bench/reach.sh BUILD_FOLDER DATA_FOLDER [FRAMES_PER_CAMERA]
#
# Frames that are in the data folder already are kept, so a second run only measures.
set -euo pipefail
build=$1 data=$2 frames=${3:-12}
root=$(cd "$(dirname "$0")/.." && pwd)
cameras=()
for name in pinhole_90 tum_mono_wide fisheye_180 catadioptric; do
  cameras+=(--camera "$root/fixtures/calibrations/$name.yaml")
done
folders=()
for scene in paper room; do
  for noise in 0 2 8; do
    folder=$data/$scene-noise-$noise
    "$build/cli/dlsd" generate "${cameras[@]}" --scene "$scene" --noise "$noise" --seed 100 \
      --count $((4 * frames)) --out "$folder" >/dev/null
    folders+=("$folder")
  done
done
bench=$build/bench/bench_detector
git -C "$root" log -1 --format='commit %h'
"$bench" quality --peers "${folders[@]}"
"$bench" efficiency
"$bench" alarms
"$bench" time --peers
