#!/bin/sh
# Build the examples and the program of README.md, run them in an empty folder, and check what they write.
#
#   examples_test.sh <source folder> <cc> build                        with the headers and library of this build
#   examples_test.sh <source folder> <cc> installed <cmake> <folder>   after `cmake --install` of a build folder
#
# The library of `build` is in SPLAT_LIB_DIR. CXX, CFLAGS, CXXFLAGS and LDFLAGS apply to the programs.
set -eu
source_dir=$1
cc=$2
mode=$3

die() {
    echo "examples_test: $*" >&2
    exit 1
}

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT

case $mode in
build)
    flags="-I$source_dir/include -L$SPLAT_LIB_DIR -lsplat"
    lib_dir=$SPLAT_LIB_DIR
    ;;
installed)
    "$4" --install "$5" --prefix "$temp/prefix" >"$temp/install.log" || die "cmake --install"
    PKG_CONFIG_PATH=$(dirname "$(find "$temp/prefix" -name splat.pc)")
    export PKG_CONFIG_PATH
    flags=$(pkg-config --cflags --libs splat)
    lib_dir=$(pkg-config --variable=libdir splat)
    ;;
*) die "unknown mode $mode" ;;
esac

libs=
# build <name> <file> <compiler and flags>...
build() {
    name=$1
    file=$2
    shift 2
    # shellcheck disable=SC2086  # lists of words
    "$@" -pedantic -Wall -Wextra -Wconversion -Wshadow -Werror "$file" $flags $libs -lm ${LDFLAGS:-} -o "$temp/$name" ||
        die "$name does not compile"
}
# shellcheck disable=SC2086
for name in render predict fit fit_photos ranks; do
    build "$name" "$source_dir/bindings/c/$name.c" "$cc" -std=c11 ${CFLAGS:-}
done
libs=-lvulkan
# shellcheck disable=SC2086
build engine "$source_dir/bindings/c/engine.c" "$cc" -std=c11 ${CFLAGS:-}
libs=
# shellcheck disable=SC2086
build first "$source_dir/bindings/c/first.cpp" "$CXX" -std=c++11 -Wold-style-cast ${CXXFLAGS:-}
# shellcheck disable=SC2016  # the backquotes are those of Markdown
sed -n '/^```c$/,/^```$/{/^```/d;p;}' "$source_dir/bindings/c/README.md" >"$temp/readme.c"
# shellcheck disable=SC2086
build readme "$temp/readme.c" "$cc" -std=c11 ${CFLAGS:-}

export LD_LIBRARY_PATH="$lib_dir"
mkdir "$temp/work"
cd "$temp/work"

"$temp/predict" "$source_dir/docs/knot.png" scene.ply || die "predict"
[ "$(head -c 3 scene.ply)" = ply ] || die "predict wrote no .ply file"
"$temp/render" scene.ply view_ || die "render"
for i in 0 1 2 3 4 5 6 7; do
    [ "$(head -c 4 view_$i.png | tail -c 3)" = PNG ] || die "view_$i.png is no PNG"
done
! cmp -s view_0.png view_2.png || die "two views are the same picture"
# The same views as of `render`, from a device of the program, under the validation layer, which prints what it finds.
VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation \
    VK_LAYER_ENABLES=VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT \
    "$temp/engine" scene.ply turn_ >turn.log 2>&1 || die "engine: $(cat turn.log)"
[ "$(cat turn.log)" = "4 frames, 1 of them waited for" ] || die "engine: $(cat turn.log)"
for i in 0 1 2 3; do
    cmp turn_$i.png view_$((2 * i)).png || die "engine draws another picture"
done
rm turn_?.png
"$temp/readme" || die "the program of README.md"
[ "$(head -c 4 first.png | tail -c 3)" = PNG ] || die "first.png is no PNG"
mv first.png first_c.png
"$temp/first" || die "first"
cmp first.png first_c.png || die "C++ draws another picture"

# fit_at_least <dB> <arguments>...
fit_at_least() {
    least=$1
    shift
    printed=$("$temp/fit" "$@") || die "fit $*"
    echo "fit: $printed"
    echo "$printed" | awk -v least="$least" '{ exit !($1 >= least && $1 < 100) }' || die "expected $least dB or more"
}
fit_at_least 30 - fit.png
fit_at_least 30 fit.png again.png # fit the first result, read from a file

# The views of render as photographs, with their cameras but for the scale.
mkdir photos
mv view_*.png photos
awk 'BEGIN {
    printf "{\"camera_angle_x\": 0.7, \"w\": 320, \"h\": 240, \"frames\": ["
    for (i = 0; i < 8; ++i) {
        s = sin(i * atan2(0, -1) / 4); c = cos(i * atan2(0, -1) / 4); t = sin(0.3); r = cos(0.3)
        printf "%s{\"file_path\": \"view_%d.png\", \"transform_matrix\": [", i ? ", " : "", i
        printf "[%f, %f, %f, %f], [0, %f, %f, %f], ", c, -t * s, r * s, 4 * r * s, -r, -t, -4 * t
        printf "[%f, %f, %f, %f], [0, 0, 0, 1]]}", s, t * c, -r * c, -4 * r * c
    }
    print "]}"
}' >photos/transforms.json
"$temp/fit_photos" photos run 1 >printed || die "fit_photos"
tail -n 1 printed
tail -n 1 printed | awk '{ exit !($3 > 10 && $3 < 60 && $4 == "dB") }' || die "no score"
[ "$(head -c 3 run/scene.ply)" = ply ] || die "fit_photos wrote no .ply file"

# The same losses and weights for any number of ranks.
for count in 1 2 4; do
    "$temp/ranks" ranks_$count $count >losses_$count || die "ranks $count"
    [ "$(wc -l <losses_$count)" = 5 ] || die "ranks $count: $(cat losses_$count)"
    cmp losses_1 losses_$count || die "$count ranks have other losses than one"
    cmp ranks_1/run/weights_last.safetensors ranks_$count/run/weights_last.safetensors ||
        die "$count ranks have other weights than one"
done

# refuse <text> <program> <arguments>...: exit status 1 and a sentence with the text.
refuse() {
    text=$1
    shift
    status=0
    "$@" 2>message || status=$?
    [ "$status" = 1 ] || die "$* exits with $status, expected 1"
    grep -q "$text" message || die "$*: the message has no '$text': $(cat message)"
}
echo "not a picture" >broken.png
refuse none.ply "$temp/render" none.ply view_
refuse broken.png "$temp/predict" broken.png other.ply
refuse view_0.png "$temp/fit" photos/view_0.png other.png
refuse nowhere "$temp/fit_photos" nowhere other
refuse "1, 2, 4" "$temp/ranks" ranks_3 3
[ ! -e other.ply ] || die "a failed prediction wrote a file"
