# Sourced by run.sh and test.sh: names the Debian packages that dlsd needs and installs what is missing.

build_packages=(
  g++ cmake ninja-build
  libeigen3-dev libembree-dev libtbb-dev
  libyaml-cpp-dev nlohmann-json3-dev libfmt-dev libcli11-dev libssl-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev
)
# libopencv-contrib-dev has cv::omnidir, an independent implementation that the tests compare with.
test_packages=(libgtest-dev libgmock-dev librapidcheck-dev libopencv-calib3d-dev libopencv-contrib-dev)

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
    echo "  sudo apt-get install --no-install-recommends ${missing[*]}" >&2
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

# configure_once PRESET [OPTION...]: a configured build folder is left as it is, so that run.sh and
# test.sh share one build. Options given must hold already, else it is configured again.
configure_once() {
  local preset=$1 cache option
  shift
  cache=build/$preset/CMakeCache.txt
  local fresh=1
  [[ -f $cache && -f build/$preset/build.ninja ]] || fresh=0
  for option in "$@"; do
    [[ $fresh -eq 1 ]] && grep -q "^${option%%=*}:[A-Z]*=${option#*=}$" "$cache" || fresh=0
  done
  [[ $fresh -eq 1 ]] && return
  cmake --preset "$preset" "${@/#/-D}" >/dev/null
}
