#!/bin/sh
# Compile the first C program of README.md and draw two scenes with it.
#
#   readme_test.sh <README.md> <include folder> <folder of libsplat.so> <cc>
#
# CFLAGS and LDFLAGS apply to the program.
set -eu
readme=$1
include_dir=$2
lib_dir=$3
cc=$4

die() {
    echo "readme_test: $*" >&2
    exit 1
}

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT

# shellcheck disable=SC2016  # the backquotes are those of Markdown
sed -n '/^```c$/,/^```$/{/^```/d;p;}' "$readme" >"$temp/first.c"
grep -q 'int main' "$temp/first.c" || die "no C program between \`\`\`c and \`\`\` in $readme"
# shellcheck disable=SC2086  # lists of words
"$cc" -std=c99 -pedantic -Wall -Wextra -Wconversion -Werror ${CFLAGS:-} -I"$include_dir" \
    "$temp/first.c" -L"$lib_dir" -lsplat ${LDFLAGS:-} -o "$temp/first"

# Three Gaussians of the given opacity (before the sigmoid) as a .ply file.
scene() {
    echo "ply
format ascii 1.0
element vertex 3"
    for name in x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do
        echo "property float $name"
    done
    echo "end_header
-1 0 0 1 -1 -1 $1 -1 -1 -1 1 0 0 0
1 0 0 -1 1 -1 $1 -1 -1 -1 1 0 0 0
0 0 1 -1 -1 1 $1 -1 -1 -1 1 0 0 0"
}

# The picture that the program makes of a scene, as <name>.png.
draw() {
    mkdir "$temp/$1"
    scene "$2" >"$temp/$1/scene.ply"
    (cd "$temp/$1" && LD_LIBRARY_PATH="$lib_dir" "$temp/first") || die "the program failed on the $1 scene"
    picture="$temp/$1/orbit.png"
    [ "$(head -c 4 "$picture" | tail -c 3)" = PNG ] || die "the $1 scene's orbit.png is not a PNG"
    grep -aq fcTL "$picture" || die "the $1 scene's orbit.png is not animated"
    mv "$picture" "$temp/$1.png"
    echo "$1 scene: $(wc -c <"$temp/$1.png") bytes"
}

draw opaque 4
draw invisible -20
! cmp -s "$temp/opaque.png" "$temp/invisible.png" || die "both scenes give the same picture"
[ "$(wc -c <"$temp/opaque.png")" -gt "$(wc -c <"$temp/invisible.png")" ] || die "opaque.png is empty"

! LD_LIBRARY_PATH="$lib_dir" "$temp/first" "$temp/none.ply" 2>"$temp/message" || die "no error for a missing file"
grep -q none.ply "$temp/message" || die "the error does not name the file: $(cat "$temp/message")"
