#!/usr/bin/env bash
# Shows that the tests notice deliberate defects: builds once with all of them (DLSD_MUTANTS), then
# switches on one after the other (properties/mutants.tsv) and demands that its test fails, with the
# number of cases of the quick preset, while it passes without.
#   scripts/mutants.sh [NAME...]      all, or the named ones
# Prints a table, with the seconds that each took; exits with 1 if a defect goes unnoticed, by any of
# the tests that the list names for it.
# DLSD_JOBS is the number of processes (all cores by default).
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' scripts/mutants.sh
  exit 0
fi
list=properties/mutants.tsv
jobs=${DLSD_JOBS:-$(nproc)}
export build=${DLSD_MUTANTS_BUILD:-build/mutants}
# What fails need not be shrunk.
export RC_PARAMS="${RC_PARAMS:-seed=1 max_success=200} noshrink=1" DLSD_SHRINK_SECONDS=0

# Every defect in the sources is in the list, and the other way round.
in_sources=$(grep -rhoE 'DLSD_MUTANT\("[a-z0-9-]+"\)' --include='*.h' --include='*.cpp' \
  cameras synth detector evaluation | grep -oE '"[^"]+"' | tr -d '"' | sort -u)
in_list=$(grep -v '^#' $list | cut -f1 | sort -u)
if ! diff <(echo "$in_sources") <(echo "$in_list") >&2; then
  echo "mutants.sh: the defects in the sources (<) and in $list (>) differ" >&2
  exit 2
fi
for name in "$@"; do
  if ! grep -qx -- "$name" <<<"$in_list"; then
    echo "mutants.sh: no defect is called \"$name\"; $list has their names" >&2
    exit 2
  fi
done
wanted=$(mktemp)
scratch=$(mktemp -d)
trap 'rm -rf "$wanted" "$scratch"' EXIT
export scratch
while IFS= read -r line; do
  if [[ $# -eq 0 || " $* " == *" ${line%%$'\t'*} "* ]]; then printf '%s\n' "$line"; fi
done < <(grep -v '^#' $list) >"$wanted"

need_packages "${build_packages[@]}" "${test_packages[@]}"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DDLSD_TESTS=ON -DDLSD_MUTANTS=ON
# shellcheck disable=SC2046
cmake --build "$build" -j "$jobs" --target $(cut -f3 "$wanted" | sort -u)

# verdict MUTANT PROGRAM FILTER: prints passed, failed, or none where no test ran to its end. In a
# folder of its own, for the counterexamples.
verdict() {
  local path out folder
  path=$(realpath "$(find "$build" -name "$2" -type f -perm -u+x | head -1)")
  folder=$(mktemp -d "$scratch/run.XXXXXX")
  out=$(cd "$folder" && DLSD_MUTANT=$1 timeout 600 "$path" --gtest_filter="$3" 2>&1) || true
  rm -rf "$folder"
  if grep -q '\[  FAILED  \]' <<<"$out"; then
    echo failed
  elif grep -q '\[  PASSED  \] [1-9]' <<<"$out"; then
    echo passed
  else
    echo none
  fi
}

# judge "NAME<tab>SIZE<tab>PROGRAM<tab>FILTER<tab>WHAT": a line of the table.
judge() {
  local name size program filter what without with result start=$SECONDS
  IFS=$'\t' read -r name size program filter what <<<"$1"
  local known="$scratch/$(sha256sum <<<"$program $filter" | cut -c1-16)"
  without=$(flock "$known.lock" bash -c '[[ -s $0 ]] || verdict "" "$1" "$2" >"$0"; cat "$0"' \
    "$known" "$program" "$filter")
  if [[ $without != passed ]]; then
    result="NO VERDICT"
  else
    with=$(verdict "$name" "$program" "$filter")
    result=$([[ $with == failed ]] && echo caught || echo MISSED)
  fi
  printf '%-26s %-7s %-10s %4d s  %s: %s\n' "$name" "$size" "$result" $((SECONDS - start)) \
    "$program $filter" "$what"
}
export -f verdict judge

tr '\n' '\0' <"$wanted" | xargs -0 -P "$jobs" -I{} bash -c 'judge "$0"' {} | tee "$scratch/table" >&2
table=$(<"$scratch/table")
caught=$(grep -cE '^[^ ]+ +[a-z]+ +caught ' <<<"$table" || true)
subtle=$(grep -cE '^[^ ]+ +subtle +caught ' <<<"$table" || true)
others=$(grep -vE '^[^ ]+ +[a-z]+ +caught ' <<<"$table" | cut -d' ' -f1 | tr '\n' ' ' || true)
echo "$SECONDS s with the build"
echo "$(cut -f1 "$wanted" | sort -u | wc -l) defects: $caught of $(wc -l <"$wanted") tests notice theirs" \
  "($subtle of them subtle)${others:+; not noticed: $others}"
[[ -z $others && $caught -gt 0 ]]
