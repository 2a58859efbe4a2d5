#!/bin/sh
# Make the packages of both crates: libsplat-sys with the sources that its feature `bundled` builds, and libsplat. Asks
# no registry, and verifies nothing (package_test.sh does). The same sources and cargo give the same bytes.
#
#   package.sh <cargo> <folder for the packages>
set -eu
cargo=$1
mkdir -p "$2"
to=$(cd "$2" && pwd)
rust=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$rust/../.." && pwd)
PATH=$(dirname "$cargo"):$PATH
export PATH

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT
sh "$rust/workspace.sh" "$temp/crates" features
rm "$temp/crates/splat/tests" # they read files of the repository
for crate in splat-sys splat; do
    ln -s "$rust/README.md" "$temp/crates/$crate/"
    sed -i 's|"\.\./README.md"|"README.md"|' "$temp/crates/$crate/Cargo.toml"
done
bundled=$temp/crates/splat-sys/libsplat
mkdir -p "$bundled/tools/weights" "$bundled/tests"
# Rust's registry takes 10 MB: the weights cars64-depth-normal stay out.
for file in CMakeLists.txt LICENSE THIRD-PARTY.md CHANGELOG.md README.md cmake include shaders src tests/ref \
    tools/difference tools/weights/README.md tools/weights/cars64; do
    ln -s "$source/$file" "$bundled/$file"
done
cd "$temp/crates"
# Programs have lock files; that of a library would have the newest versions of the day.
lock=$("$cargo" package --help | grep -o -m 1 -e --exclude-lockfile || true)
export CARGO_TARGET_DIR="$temp/target"
for package in libsplat-sys libsplat; do
    # No page of the project is public, which --no-metadata says.
    # shellcheck disable=SC2086  # no word, or one
    "$cargo" package -p "$package" --offline --no-verify --no-metadata $lock 2>"$temp/log" &&
        ! grep warning "$temp/log" || {
        cat "$temp/log" >&2
        exit 1
    }
done
cp "$CARGO_TARGET_DIR"/package/*.crate "$to"
