# Sourced by run.sh and test.sh: names the Debian packages that dlsd needs and installs what is missing.

build_packages=(
  g++ cmake ninja-build
  libeigen3-dev libembree-dev libtbb-dev
  libyaml-cpp-dev nlohmann-json3-dev libfmt-dev libcli11-dev libssl-dev libhdf5-dev libarchive-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-videoio-dev
)
# python3-numpy and python3-h5py read the exports as the programs do that they are made for.
# libopencv-contrib-dev has cv::omnidir, an independent implementation that the tests compare with.
test_packages=(libgtest-dev libgmock-dev librapidcheck-dev libopencv-calib3d-dev libopencv-contrib-dev
               python3-numpy python3-h5py)

# need_packages PACKAGE...: returns when all are there; else installs them, or says what to do.
need_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "This is not a Debian-like system: please see to these packages (or their like) yourself: $*" >&2
    return
  fi
  local missing=() package
  for package in "$@"; do
    # "hold ok installed" and the like are installed too.
    [[ $(dpkg-query -W -f='${Status}' "$package" 2>/dev/null) == *" ok installed" ]] || missing+=("$package")
  done
  [[ ${#missing[@]} -eq 0 ]] && return
  if [[ $(id -u) -ne 0 ]]; then
    echo "Packages are missing. Please run this once, then start $0 again:" >&2
    echo "  sudo apt-get update && sudo apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 3
  fi
  echo "Installing ${#missing[@]} packages: ${missing[*]}"
  local log
  log=$(mktemp)
  if ! { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"; } \
      >"$log" 2>&1 </dev/null; then
    tail -n 20 "$log" >&2
    echo "The packages could not be installed; the whole log is $log" >&2
    exit 3
  fi
  rm -f "$log"
}

# configured PRESET OPTION=VALUE...: whether the build folder is there and has these options.
configured() {
  local cache=build/$1/CMakeCache.txt option
  [[ -f build/$1/build.ninja ]] || return 1
  for option in "${@:2}"; do
    grep -q "^${option%%=*}:[A-Z]*=${option#*=}$" "$cache" || return 1
  done
}

# quietly COMMAND...: runs it; where nobody watches, its output is shown only if it fails.
quietly() {
  if [[ -t 1 ]]; then
    "$@"
    return
  fi
  local log
  log=$(mktemp)
  if ! "$@" >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    return 1
  fi
  rm -f "$log"
}

# configure PRESET OPTION=VALUE...
configure() {
  local options=("${@:2}")
  quietly cmake --preset "$1" "${options[@]/#/-D}"
}

# build PRESET ARGUMENT...
build() { quietly cmake --build --preset "$@"; }
