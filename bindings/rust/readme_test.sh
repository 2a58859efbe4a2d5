#!/bin/sh
# Build and run the program of README.md in an empty folder, as a new user would: against a library that was
# installed from a build, found by pkg-config.
#
#   readme_test.sh <build folder> <cmake> <cargo or NOTFOUND>
#
# Exits with 77 where cargo is missing.
set -eu
build_dir=$1
cmake=$2
cargo=$3
. "$(dirname "$0")/cargo.sh"

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT
"$cmake" --install "$build_dir" --prefix "$temp/prefix" >"$temp/install.log" || die "cmake --install"
pc_dir=$(dirname "$(find "$temp/prefix" -name splat.pc)")
lib_dir=$(dirname "$(find "$temp/prefix" -name libsplat.so)")

sh "$rust/workspace.sh" "$temp/crates" # no registry is asked
mkdir -p "$temp/first/src"
cd "$temp/first"
cat >Cargo.toml <<END
[package]
name = "first"
version = "0.1.0"
edition = "2021"

[dependencies]
libsplat = { path = "$temp/crates/splat" }
END
# shellcheck disable=SC2016  # the backquotes are those of Markdown
sed -n '/^```rust$/,/^```$/{/^```/d;p;}' "$rust/README.md" >src/main.rs
grep -q 'fn main' src/main.rs || die "no program between \`\`\`rust and \`\`\` in README.md"
cp "$rust/../../docs/knot.png" photo.png

unset SPLAT_LIB_DIR LD_LIBRARY_PATH
if CARGO_TARGET_DIR="$temp/target" PKG_CONFIG_PATH="$temp" PKG_CONFIG_LIBDIR="$temp" \
    "$cargo" build --offline >"$temp/missing.log" 2>&1; then
    die "the build found a library where there is none"
fi
grep -q "or set SPLAT_LIB_DIR to the folder of libsplat.so" "$temp/missing.log" ||
    die "the error does not say what to do: $(cat "$temp/missing.log")"

CARGO_TARGET_DIR="$temp/target" PKG_CONFIG_PATH="$pc_dir" "$cargo" build --offline >"$temp/build.log" 2>&1 ||
    die "$(cat "$temp/build.log")"
LD_LIBRARY_PATH="$lib_dir" "$temp/target/debug/first" || die "the program failed"
[ "$(head -c 3 scene.ply)" = ply ] || die "no scene.ply"
[ "$(head -c 4 side.png | tail -c 3)" = PNG ] || die "no side.png"
echo "scene.ply: $(wc -c <scene.ply) bytes, side.png: $(wc -c <side.png) bytes"
