#!/usr/bin/env bash
# Installs what is missing, builds the release preset and runs the quick test preset.
#   ./test.sh [CTEST-ARGUMENT...]      e.g. ./test.sh -R camera
set -euo pipefail
cd "$(dirname "$0")"
source scripts/packages.sh

need_packages "${build_packages[@]}" "${test_packages[@]}"
configure_once release DLSD_TESTS=ON
cmake --build --preset release
ctest --preset quick -j"$(nproc)" "$@"
