#!/bin/sh
# release_test.sh SOURCES FOLDER: two drafts of a release, each of what can be made here, have the same bytes, and their
# checksums are right. Archives and wheel work in empty folders: vkrun draws its demo, and the first programs of
# README.md in C and Python run; the demo of the archive for Windows, by Wine, gives the same scene. Other tests use
# Debian's packages (deb_test.sh), crates, the NuGet package and the wheel for Windows (bindings/).
set -eu
sources=$(cd "$1" && pwd)

fail() {
    echo "release_test: $*" >&2
    exit 1
}

# block LANGUAGE: the first block of it in README.md
block() {
    sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/{/^\`\`\`/d;p;}" "$sources/README.md"
}

rm -rf "$2"
for run in first second; do
    "$sources/tools/release" --draft --no-abi --out "$2/$run" 2>"$2.log" || cat "$2.log"
    (cd "$2/$run" && sha256sum --quiet --check SHA256SUMS)
    [ "$(wc -l <"$2/$run/SHA256SUMS")" -gt 2 ] || fail "nothing was made"
done
diff -r "$2/first" "$2/second"
cat "$2/first/SHA256SUMS"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
release=$(cd "$2/first" && pwd)
cd "$work"
unset LD_LIBRARY_PATH SPLAT_LIBRARY PKG_CONFIG_PATH PYTHONPATH

for archive in "$release"/*-linux-*.tar.xz; do
    [ -e "$archive" ] || fail "there is no archive for Linux"
    tar -xf "$archive"
    prefix=$(echo "$work"/libsplat-*-linux-*)
    "$prefix/bin/vkrun" demo --out out >log || { cat log; fail "vkrun demo of $archive"; }
    cp out/car/input.png photo.png
    block c >orbit.c
    PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name splat.pc)")
    export PKG_CONFIG_PATH
    # shellcheck disable=SC2046  # a list of words
    cc orbit.c $(pkg-config --cflags --libs splat) -o orbit
    LD_LIBRARY_PATH=$(dirname "$(find "$prefix" -name libsplat.so)") ./orbit out/car/scene.ply
    rm orbit.png # there, else this fails
    echo "the archive for Linux works"
done
for wheel in "$release"/*-manylinux*.whl; do
    [ -e "$wheel" ] || fail "there is no wheel for Linux"
    /usr/bin/python3 -m venv environment
    environment/bin/pip --quiet install "$wheel" || { echo "left out: the wheel, as NumPy was not installed"; break; }
    environment/bin/python -m libsplat demo
    block python >first.py
    environment/bin/python first.py
    rm orbit.png scene.ply
    echo "the wheel for Linux works"
done
for archive in "$release"/*-windows-*.zip; do
    [ -e "$archive" ] && command -v xvfb-run >/dev/null && command -v wine >/dev/null ||
        { echo "left out: the archive for Windows"; break; }
    /usr/bin/python3 -m zipfile -e "$archive" .
    WINEPREFIX="$work/wine" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" xvfb-run -a \
        wine libsplat-*-windows-*/bin/vkrun.exe demo --out windows </dev/null >log 2>&1 || { cat log; fail "$archive"; }
    cmp out/car/scene.ply windows/car/scene.ply
    echo "the archive for Windows works"
done
