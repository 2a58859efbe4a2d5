#!/bin/sh
# Installs a build tree into an empty prefix, moves the prefix, and builds and runs a consumer of each kind
# there: C through pkg-config, C++ through find_package.
#
#   install_test.sh <source folder> <build folder> <cmake> <cc> <c++> <expected version>
#
# CFLAGS, CXXFLAGS and LDFLAGS apply to the consumers.
set -eu
source_dir=$1
build_dir=$2
cmake=$3
cc=$4
cxx=$5
version=$6

die() {
    echo "install_test: $*" >&2
    exit 1
}

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT

"$cmake" --install "$build_dir" --prefix "$temp/first" >"$temp/install.log" || die "cmake --install"
mv "$temp/first" "$temp/prefix"
prefix="$temp/prefix"

# What was installed, as <path below the prefix>.
one_of() {
    found=$(find "$prefix" -path "$prefix/$1")
    [ -n "$found" ] || die "not installed: $1; there is: $(find "$prefix" | tr '\n' ' ')"
    printf '%s\n' "$found"
}
one_of include/splat.h >"$temp/found"
for name in core scene render model train; do one_of "include/splat/$name.h" >>"$temp/found"; done
one_of "lib*/libsplat.so" >>"$temp/found"
one_of "lib*/libsplat.so.$version" >>"$temp/found"
library=$(one_of "lib*/libsplat.so.0")
lib_dir=$(dirname "$library")
one_of "lib*/cmake/Splat/SplatConfigVersion.cmake" >>"$temp/found"
pc_dir=$(dirname "$(one_of "lib*/pkgconfig/splat.pc")")

[ ! -x "$prefix/bin/vkrun" ] || one_of share/libsplat/weights/cars64/weights.safetensors >>"$temp/found"

# No installed file may name the build tree.
if grep -rlF "$build_dir" "$prefix" --include='*.pc' --include='*.cmake' --include='*.h'; then
    die "these installed files name the build folder"
fi

check_run() {
    printed=$(LD_LIBRARY_PATH="$lib_dir" "$2") || die "$1: the program failed"
    [ "$printed" = "$version" ] || die "$1: printed '$printed', expected '$version'"
    echo "$1: version $printed"
}

export PKG_CONFIG_PATH="$pc_dir"
[ "$(pkg-config --modversion splat)" = "$version" ] || die "pkg-config --modversion"
# shellcheck disable=SC2046,SC2086  # lists of words
"$cc" -std=c99 -Wall -Wextra -Werror ${CFLAGS:-} "$source_dir/tests/install/pkg_config/version.c" \
    $(pkg-config --cflags --libs splat) ${LDFLAGS:-} -o "$temp/version_c"
check_run pkg-config "$temp/version_c"

"$cmake" -S "$source_dir/tests/install/find_package" -B "$temp/build" -DCMAKE_CXX_COMPILER="$cxx" \
    -DCMAKE_PREFIX_PATH="$prefix" >"$temp/configure.log" || die "configure of find_package"
"$cmake" --build "$temp/build" >"$temp/build.log" || { cat "$temp/build.log"; die "find_package"; }
check_run find_package "$temp/build/version"

vkrun="$prefix/bin/vkrun"
if [ -x "$vkrun" ]; then
    "$vkrun" --version >"$temp/vkrun.log" || die "the installed vkrun does not find its library"
    echo "vkrun: $(head -n 1 "$temp/vkrun.log")"
fi
