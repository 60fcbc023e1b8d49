#!/usr/bin/env bash
# Installs what is missing, builds, generates a small labelled data set through four camera models,
# detects lines in it, evaluates them, and writes a page with all of it.
#   ./run.sh [OUT]      OUT: where the results go (default out/demo)
set -euo pipefail
cd "$(dirname "$0")"
out=${1:-out/demo}
source scripts/packages.sh

need_packages "${build_packages[@]}"
# Without tests on a first run; a build folder that test.sh has configured stays as it is.
if [[ ! -f build/release/build.ninja ]]; then configure release DLSD_TESTS=OFF; fi
if [[ ! -x build/release/cli/dlsd ]]; then echo "Building (once; five to ten minutes on two cores) ..."; fi
build release --target dlsd_cli
dlsd=build/release/cli/dlsd

cameras=()
for name in pinhole_90 tum_mono_wide tum_vi_cam0 catadioptric; do
  cameras+=(--camera "fixtures/calibrations/$name.yaml")
done
mkdir -p "$out"
"$dlsd" generate "${cameras[@]}" --scene room --count 8 --seed 0 --out "$out/data"
"$dlsd" detect --data "$out/data" --out "$out/detections.jsonl" --overlay "$out/overlays"
"$dlsd" evaluate --data "$out/data" --detections "$out/detections.jsonl" --rho 2
"$dlsd" report --data "$out/data" --detections "$out/detections.jsonl" --out "$out/gallery" >/dev/null
echo
echo "Images, labels and cameras:  $out/data"
echo "Page with all overlays:      $(realpath "$out/gallery/index.html")"
