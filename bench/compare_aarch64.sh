#!/usr/bin/env bash
# Do logs of this machine replay on aarch64? Builds replay_logs for aarch64 from Debian's arm64
# packages, dives every mission (default: all shipped ones) with build/release/dive, and replays each
# log by qemu-aarch64.
#   bench/compare_aarch64.sh [MISSION...]
# Needs g++-aarch64-linux-gnu and qemu-user. The arm64 packages (600 MB) are unpacked in
# build/aarch64-root: none is installed, and no package of this machine is changed. Exit status 1 if
# a replay is not identical.
set -euo pipefail

case "${1:-}" in
  -*)
    sed -n '2,9p' "$0" | sed 's/^# \{0,1\}//' >&2
    exit 2
    ;;
esac
[ $# -gt 0 ] || set -- missions/*.xml
root=$PWD/build/aarch64-root
apt=$PWD/build/aarch64-apt
triplet=aarch64-linux-gnu

# Only what a C++ library needs to be compiled against and loaded: no programs, no other languages.
names() {
  grep -E '^(lib.*-dev|zlib1g-dev)$' packages.txt |
    xargs apt-get -s install nlohmann-json3-dev libc6-dev libstdc++-12-dev |
    awk '/^Inst/ {print $2}' |
    grep -vE '^(openjdk|libqt5|libgtk|lib.*(java|perl|python|webkit|clang)|python|perl|gcc-12$|g\+\+|cpp|gfortran|binutils|iso-codes|adwaita)'
}

fetch_packages() {
  mkdir -p "$apt"/{lists/partial,archives/partial,debs} "$root"
  : >"$apt/status"
  cat >"$apt/apt.conf" <<EOF
APT::Architecture "arm64";
APT::Architectures { "arm64"; };
APT::Install-Recommends "false";
Dir::State "$apt";
Dir::State::status "$apt/status";
Dir::Cache "$apt";
EOF
  (
    export APT_CONFIG=$apt/apt.conf # in here only: apt would install arm64 packages
    apt-get -q update
    cd "$apt/debs"
    # The names are words.
    # shellcheck disable=SC2046
    apt-get -q download $(cd - >/dev/null && names)
  )
  for package in "$apt"/debs/*.deb; do dpkg-deb -x "$package" "$root"; done
}

# Absolute paths in the packages lead to the root that they are unpacked in, and what the report
# contains is the same for every architecture.
adapt_packages() {
  find "$root/usr/lib" "$root/lib" -lname '/*' | while read -r link; do
    target=$root$(readlink "$link")
    if [ -e "$target" ]; then ln -sfn "$target" "$link"; fi
  done
  find "$root/usr/lib" "$root/usr/share" -name '*.cmake' -exec \
    sed -i -E "s,(^|[^A-Za-z0-9_.-])/usr/(lib|include|share),\1$root/usr/\2,g" {} +
  mkdir -p "$root"/usr/share/{javascript,nodejs}
  ln -sfn /usr/share/javascript/three "$root/usr/share/javascript/three"
  ln -sfn /usr/share/nodejs/d3 "$root/usr/share/nodejs/d3"
}

if [ ! -e "$root/complete" ]; then
  fetch_packages
  adapt_packages
  : >"$root/complete"
fi
export PKG_CONFIG_LIBDIR=$root/usr/lib/$triplet/pkgconfig:$root/usr/share/pkgconfig
export PKG_CONFIG_SYSROOT_DIR=$root
cmake -S . -B build/aarch64 -G Ninja -DCMAKE_BUILD_TYPE=Release -DDIVE_TESTS=OFF \
  -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 -DCMAKE_SYSROOT="$root" \
  -DCMAKE_C_COMPILER=$triplet-gcc -DCMAKE_CXX_COMPILER=$triplet-g++ \
  -DCMAKE_FIND_ROOT_PATH_MODE_{LIBRARY,INCLUDE,PACKAGE}=ONLY \
  -DCMAKE_FIND_ROOT_PATH_MODE_PROGRAM=NEVER >/dev/null
cmake --build build/aarch64 --target replay_logs

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
for mission in "$@"; do
  build/release/dive run "$mission" --log "$logs/$(basename "$mission" .xml).lcmlog" \
    >/dev/null 2>&1 || true
done
LD_LIBRARY_PATH='' qemu-aarch64 -L "$root" -E LD_LIBRARY_PATH="$root/usr/lib/$triplet/blas:$root/usr/lib/$triplet/lapack" \
  build/aarch64/replay_logs "$logs"/*.lcmlog
