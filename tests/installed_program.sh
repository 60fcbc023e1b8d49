#!/bin/sh
# The installed program finds the parts of it that are loaded on demand: the codecs of images and videos and, where it
# is built with them, other people's detectors.
#   installed_program.sh PREFIX/BIN/dlsd CAMERA WORK [DETECTOR]
set -eu
dlsd=$1 camera=$2 work=$3 detector=${4-}
rm -rf "$work"
"$dlsd" generate --camera "$camera" --count 1 --out "$work/data"
"$dlsd" detect --data "$work/data" --out "$work/lines.jsonl" --overlay "$work/overlay.avi"
test -s "$work/overlay.avi"
if [ -n "$detector" ]; then "$dlsd" evaluate --data "$work/data" --detector "$detector"; fi
