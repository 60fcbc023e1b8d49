#!/usr/bin/env bash
# Installs what is missing, builds the release preset and runs the quick test preset.
#   ./test.sh [CTEST-ARGUMENT...]      e.g. ./test.sh -R camera
set -euo pipefail
cd "$(dirname "$0")"
source scripts/packages.sh

need_packages "${build_packages[@]}" "${test_packages[@]}"
if ! configured release DLSD_TESTS=ON; then configure release DLSD_TESTS=ON; fi
echo "Building (first time: a few minutes) ..."
build release
ctest --preset quick --no-tests=error -j"$(nproc)" "$@"
