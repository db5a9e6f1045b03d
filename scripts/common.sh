# What the scripts share: the packages they need, and the build. Sourced, not run.
# shellcheck shell=bash
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

packages_build=(g++ cmake make liblcm-dev liblcm-bin libeigen3-dev libsundials-dev coinor-libipopt-dev libpagmo-dev
  libtomlplusplus-dev libcli11-dev libfmt-dev nlohmann-json3-dev libcsv-dev libgeographiclib-dev)
# Any gnuplot will do; its packages exclude each other.
packages_run=()
command -v gnuplot >/dev/null || packages_run+=(gnuplot-nox)
packages_test=(libgtest-dev libbenchmark-dev iproute2 util-linux libopenmpi-dev openmpi-bin)

say() { printf '%s\n' "$*"; }
die() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; exit 1; }

# install PACKAGE...: what is missing of them, by apt, after saying so. Nothing when nothing is missing.
install() {
  command -v dpkg-query >/dev/null || die "this script knows Debian 12 and Ubuntu 24.04; elsewhere install: $*"
  local missing=() package
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "these packages are missing and there is no sudo: ${missing[*]}"
    sudo=(sudo)
  fi
  say "Installing with apt: ${missing[*]}"
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -q >/dev/null || die "apt-get update failed"
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-remove --no-install-recommends "${missing[@]}" >/dev/null ||
    die "apt-get could not install: ${missing[*]}"
}

# build DIR CMAKE-ARGUMENT...: configures and builds, quietly while all goes well.
build() {
  local dir=$1 log
  shift
  mkdir -p "$dir"
  log=$dir/build.log
  say "Building in ${dir#"$PWD"/} (log: ${log#"$PWD"/})"
  if ! { cmake -S "$root" -B "$dir" "$@" && cmake --build "$dir" --parallel "$(nproc)"; } >"$log" 2>&1; then
    grep -E -A5 'error|Error' "$log" | head -n 40 >&2 || true
    die "the build failed; see $log"
  fi
}
