#!/bin/sh
# Link crates that depend on `splat`, as their users would: with SPLAT_LIB_DIR and by pkg-config, with and
# without a build script of their own, and where it must be refused.
#
#   link_test.sh <folder of libsplat.so> <cargo or NOTFOUND>
#
# Exits with 77 where cargo is missing.
set -eu
library=$(readlink -f "$1/libsplat.so")
cargo=$2
. "$(dirname "$0")/cargo.sh"

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT
unset SPLAT_LIB_DIR LD_LIBRARY_PATH PKG_CONFIG_PATH PKG_CONFIG_LIBDIR
export CARGO_TARGET_DIR="$temp/target"

sh "$rust/workspace.sh" "$temp/crates" # no registry is asked

# A folder with a comma and a space in its name, and one of another version.
lib="$temp/a, b/lib"
mkdir -p "$lib/pkgconfig" "$temp/other" "$temp/next/pkgconfig"
version=$(basename "$library" | sed 's/.*\.so\.//')
ln -s "$library" "$lib/libsplat.so.$version"
ln -s "$library" "$lib/libsplat.so.0.1"
ln -s "$library" "$lib/libsplat.so"
cp "$library" "$temp/other/libsplat.so.9.1.0"
ln -s libsplat.so.9.1.0 "$temp/other/libsplat.so"
# shellcheck disable=SC2016  # pkg-config's variables
module='prefix=${pcfiledir}/..\nlibdir=${prefix}\nName: splat\nDescription: a test\nLibs: -L${libdir} -lsplat\n'
# shellcheck disable=SC2059  # the format has the lines
{
    printf "${module}Version: $version\n" >"$lib/pkgconfig/splat.pc"
    printf "${module}Version: 9.1.0\n" >"$temp/next/pkgconfig/splat.pc"
}

mkdir -p "$temp/plain/src" "$temp/run_path"
cat >"$temp/plain/Cargo.toml" <<END
[package]
name = "plain"
version = "0.1.0"
edition = "2021"
[dependencies]
libsplat = { path = "$temp/crates/splat" }
END
cat >"$temp/plain/src/main.rs" <<END
fn main() {
    splat::check_library().unwrap();
    println!("starts");
}
END
cp -r "$temp/plain/." "$temp/run_path"
sed -i 's/"plain"/"run_path"/' "$temp/run_path/Cargo.toml"
cp "$rust/programs/build.rs" "$temp/run_path"

refuses() { # refuses <sentence> <command>...
    sentence=$1
    shift
    if "$@" >"$temp/log" 2>&1; then die "not refused: $sentence"; fi
    grep -q "$sentence" "$temp/log" || die "expected '$sentence', got: $(cat "$temp/log")"
}

starts() {
    "$@" >"$temp/log" 2>&1 || die "$*: $(cat "$temp/log")"
    grep -q '^starts$' "$temp/log" || die "$*: $(cat "$temp/log")"
}

cd "$temp/plain"
refuses "SPLAT_LIB_DIR=lib is relative" env SPLAT_LIB_DIR=lib "$cargo" build --offline
refuses "it is version 9.1.0" env SPLAT_LIB_DIR="$temp/other" "$cargo" build --offline
refuses "it is version 9.1.0" env PKG_CONFIG_PATH="$temp/next/pkgconfig" "$cargo" build --offline
starts env SPLAT_LIB_DIR="$lib" "$cargo" run --offline
cd "$temp/run_path"
SPLAT_LIB_DIR="$lib" "$cargo" build --offline 2>"$temp/log" || die "$(cat "$temp/log")"
starts "$CARGO_TARGET_DIR/debug/run_path"
cd "$temp/plain"
starts env PKG_CONFIG_LIBDIR="$lib/pkgconfig" "$cargo" run --offline
refuses "it is version 9.1.0" env PKG_CONFIG_LIBDIR="$temp/next/pkgconfig" "$cargo" build --offline
