#!/usr/bin/env bash
# Line and branch coverage of cameras, synth, detector and evaluation by their tests and the
# property suites, with a fraction of the quick preset's cases.
#   scripts/coverage.sh [--modules] [CTEST-ARGUMENT...]
# --modules: only the modules' own tests and the program's, without the property suites.
# Prints a table of modules, then the files below 95 % of lines; build/coverage/coverage.json has
# all of it. Branches that only exceptions take are left out.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

need_packages "${build_packages[@]}" "${test_packages[@]}" gcovr
build=build/coverage
folders=(.)
if [[ ${1:-} == --modules ]]; then
  folders=(cameras synth detector evaluation cli)
  shift
fi
if ! configured coverage DLSD_TESTS=ON; then configure coverage DLSD_TESTS=ON; fi
build coverage --target "${folders[@]/%//all}"
find $build -name '*.gcda' -delete
failed=0
# A test that fails (or takes too long: counting makes it some ten times as slow) has run its lines.
for folder in "${folders[@]}"; do
  RC_PARAMS=${RC_PARAMS:-seed=1 max_success=20} ctest --test-dir $build/$folder -L quick \
    -j"$(nproc)" --output-on-failure "$@" | tail -30 || failed=1
done
gcovr --root . --object-directory $build --json-summary $build/coverage.json \
  --exclude-unreachable-branches --exclude-throw-branches -j "$(nproc)" \
  --gcov-ignore-parse-errors \
  --filter 'cameras/' --filter 'synth/' --filter 'detector/' --filter 'evaluation/' \
  --exclude '.*_test\.cpp' --exclude '.*_oracle\.h' --exclude '.*/test_.*\.h' \
  --exclude '.*/hand_made\.h' --exclude '.*_fixture\.h' $build
python3 - $build/coverage.json <<'PYTHON'
import collections, json, sys

files = json.load(open(sys.argv[1]))["files"]
modules = collections.defaultdict(lambda: [0, 0, 0, 0])
for f in files:
    sums = modules[f["filename"].split("/")[0]]
    for i, key in enumerate(("line_covered", "line_total", "branch_covered", "branch_total")):
        sums[i] += f[key]
print(f"{'module':<12}{'lines':>18}{'branches':>20}")
for module, (lines, all_lines, branches, all_branches) in sorted(modules.items()):
    print(f"{module:<12}{100 * lines / all_lines:7.1f} % {lines:>4}/{all_lines:<5}"
          f"{100 * branches / max(1, all_branches):8.1f} % {branches:>5}/{all_branches:<5}")
for f in sorted(files, key=lambda f: f["filename"]):
    if f["line_covered"] < 0.95 * f["line_total"]:
        print(f"  {f['filename']}: {f['line_covered']}/{f['line_total']} lines")
PYTHON
if ((failed)); then
  echo "coverage.sh: tests failed (above); what they did before counts" >&2
  exit 1
fi
