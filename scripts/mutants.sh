#!/usr/bin/env bash
# Shows that the tests notice deliberate defects: builds once with all of them (DLSD_MUTANTS), then
# switches on one after the other (properties/mutants.tsv) and demands that its test fails, with the
# number of cases of the quick preset, while it passes without.
#   scripts/mutants.sh [NAME...]      all, or the named ones
# Prints a table; exits with 1 if a defect goes unnoticed.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

list=properties/mutants.tsv
build=build/mutants
export RC_PARAMS=${RC_PARAMS:-seed=1 max_success=200}

# Every defect in the sources is in the list, and the other way round.
in_sources=$(grep -rhoE 'DLSD_MUTANT\("[a-z0-9-]+"\)' --include='*.h' --include='*.cpp' \
  cameras synth detector evaluation | grep -oE '"[^"]+"' | tr -d '"' | sort -u)
in_list=$(grep -v '^#' $list | cut -f1 | sort)
if ! diff <(echo "$in_sources") <(echo "$in_list") >&2; then
  echo "mutants.sh: the defects in the sources (<) and in $list (>) differ" >&2
  exit 2
fi

need_packages "${build_packages[@]}" "${test_packages[@]}"
cmake -S . -B $build -G Ninja -DCMAKE_BUILD_TYPE=Release -DDLSD_TESTS=ON -DDLSD_MUTANTS=ON
programs=$(grep -v '^#' $list | cut -f3 | sort -u)
# shellcheck disable=SC2086
cmake --build $build --target $programs

declare -A passes  # Whether a test passes without a defect.
caught=0 subtle=0 missed=()
while IFS=$'\t' read -r name size program filter what; do
  if [[ $# -gt 0 && " $* " != *" $name "* ]]; then continue; fi
  path=$(find $build -name "$program" -type f -perm -u+x | head -1)
  run() { DLSD_MUTANT=$1 timeout 600 "$path" --gtest_filter="$filter" 2>&1 || true; }
  key=$program:$filter
  if [[ -z ${passes[$key]:-} ]]; then
    out=$(run "")
    if grep -q '\[  PASSED  \] [1-9]' <<<"$out" && ! grep -q '\[  FAILED  \]' <<<"$out"; then
      passes[$key]=yes
    else
      passes[$key]=no
    fi
  fi
  if [[ ${passes[$key]} == no ]]; then
    verdict="NO VERDICT, $filter does not pass without a defect"
    missed+=("$name")
  elif grep -q '\[  FAILED  \]' <<<"$(run "$name")"; then
    verdict=caught
    caught=$((caught + 1))
    if [[ $size == subtle ]]; then subtle=$((subtle + 1)); fi
  else
    verdict=MISSED
    missed+=("$name")
  fi
  printf '%-26s %-7s %-10s %s: %s\n' "$name" "$size" "$verdict" "$program $filter" "$what"
done < <(grep -v '^#' $list)

echo "$caught caught ($subtle of them subtle), ${#missed[@]} missed${missed[*]:+: ${missed[*]}}"
[[ ${#missed[@]} -eq 0 && $caught -gt 0 ]]
