#!/bin/sh
# Installs a build tree into an empty prefix, moves the prefix to a path with a blank, and builds and runs a consumer of
# each kind there: in C and C++, through pkg-config and CMake. The components together are the whole.
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
prefix="$temp/moved prefix"
mv "$temp/first" "$prefix"

for component in Runtime Development Tools; do
    "$cmake" --install "$build_dir" --prefix "$temp/parts" --component "Splat_$component" >>"$temp/install.log"
    [ "$component" != Runtime ] || [ ! -e "$temp/parts/include" ] || die "the runtime has headers"
done
for folder in "$prefix" "$temp/parts"; do (cd "$folder" && find . ! -type d | LC_ALL=C sort); done |
    LC_ALL=C sort | uniq -u >"$temp/odd"
[ ! -s "$temp/odd" ] || die "of no component: $(cat "$temp/odd")"
rm -r "$temp/parts"

# Only outside of the system's folders do library and programs need a search path of their own.
DESTDIR="$temp/root" "$cmake" --install "$build_dir" --prefix /usr >"$temp/install.log" || die "cmake --install: /usr"
search_path() { readelf -d "$1" | grep -E 'RPATH|RUNPATH'; }
mv "$temp/root/usr" "$temp/usr"
for folder in "moved prefix" usr; do
    cd "$temp/$folder" # whose path has a blank
    for file in $(find . -name 'libsplat.so.*' -o -path '*/bin/*'); do
        if search_path "$file" >"$temp/path"; then has=yes; else has=no; fi
        case "$folder,$has" in
        moved*,yes | usr,no) ;;
        *) die "$folder: search path of $file: $(cat "$temp/path")" ;;
        esac
    done
done
cd "$temp"
rm -r usr root

# What was installed, as <path below the prefix>.
one_of() {
    found=$(find "$prefix" -path "$prefix/$1")
    [ -n "$found" ] || die "not installed: $1; there is: $(find "$prefix" | tr '\n' ' ')"
    printf '%s\n' "$found"
}
one_of include/splat.h >"$temp/found"
for name in core scene render model predict train evaluate; do one_of "include/splat/$name.h" >>"$temp/found"; done
one_of "lib*/libsplat.so" >>"$temp/found"
one_of "lib*/libsplat.so.$version" >>"$temp/found"
library=$(one_of "lib*/libsplat.so.0.1")
lib_dir=$(dirname "$library")
one_of "lib*/cmake/Splat/SplatConfigVersion.cmake" >>"$temp/found"
pc_dir=$(dirname "$(one_of "lib*/pkgconfig/splat.pc")")

for name in LICENSE THIRD-PARTY.md CHANGELOG.md README.md; do one_of "share/doc/*/$name" >>"$temp/found"; done
one_of share/libsplat/weights/cars64/weights.safetensors >>"$temp/found"
printf './%s\n' README.md cars64/README.md cars64/cars64.yaml cars64/chairs.json cars64/chairs.md \
    cars64/chairs.safetensors cars64/config.json cars64/weights.safetensors cars64-depth-normal/README.md \
    cars64-depth-normal/config.json cars64-depth-normal/weights.safetensors | LC_ALL=C sort >"$temp/weights"
(cd "$prefix/share/libsplat/weights" && find . ! -type d) | LC_ALL=C sort | diff "$temp/weights" - ||
    die "the weights (<: expected, >: installed)"
for file in "$prefix"/share/libsplat/weights/*/*.safetensors; do
    head -c 300 "$file" | grep -aq '"license":"SPDX-License-Identifier: MIT"' || die "$file names no licence"
done

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
# compile SOURCE PROGRAM: a C program against the installed package. pkg-config's words are quoted for a shell.
compile() {
    program=$2
    eval "set -- '$1' $(pkg-config --cflags --libs splat)"
    # shellcheck disable=SC2086  # lists of words
    "$cc" -std=c99 -Wall -Wextra -Werror ${CFLAGS:-} "$@" ${LDFLAGS:-} -o "$program"
}
compile "$source_dir/tests/install/consumer/version.c" "$temp/version_c"
check_run pkg-config "$temp/version_c"

# consume WAY LANGUAGES: a project of CMake. FetchContent and add_subdirectory: flags_test.sh.
consume() {
    build="$temp/$1"
    "$cmake" -S "$source_dir/tests/install/consumer" -B "$build" -DWAY="$1" -DLANGUAGES="$2" -DCMAKE_C_COMPILER="$cc" \
        -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_PREFIX_PATH="$prefix" >"$build.log" 2>&1 &&
        "$cmake" --build "$build" >>"$build.log" 2>&1 || die "$1: $(cat "$build.log")"
}
consume find_package "C;CXX"
check_run find_package "$temp/find_package/core_test"
check_run "find_package in C++" "$temp/find_package/io_test"
consume pkg_config C
check_run "pkg_config.cmake" "$temp/pkg_config/core_test"

# build_program NAME: a C program of tests/install/programs against the installed package.
build_program() {
    compile "$source_dir/tests/install/programs/$1.c" "$temp/$1"
}
build_program predict
LD_LIBRARY_PATH="$lib_dir" "$temp/predict" "$temp/scene.ply" >"$temp/predict.log" ||
    die "predict: the program failed"
[ "$(head -c 3 "$temp/scene.ply")" = ply ] || die "predict: no scene.ply"
echo "predict: $(cat "$temp/predict.log")"
build_program loop
LD_LIBRARY_PATH="$lib_dir" "$temp/loop" >"$temp/loop.log" || die "loop: $(cat "$temp/loop.log")"
echo "loop: $(cat "$temp/loop.log")"

vkrun="$prefix/bin/vkrun"
if [ -x "$vkrun" ]; then
    grep -q '^vkrun .- ' "$(one_of share/man/man1/vkrun.1)" || die "the manual page has no name"
    for name in man/man1/vkrun-fit.1 bash-completion/completions/vkrun zsh/site-functions/_vkrun \
        fish/vendor_completions.d/vkrun.fish; do one_of "share/$name" >>"$temp/found"; done
    "$vkrun" --version >"$temp/vkrun.log" || die "the installed vkrun does not find its library"
    echo "vkrun: $(head -n 1 "$temp/vkrun.log")"

    # A session stopped in the middle and resumed by vkrun, against a whole run of vkrun.
    build_program train
    "$vkrun" data synth "$temp/data" --objects 2 --val 0 --test 0 --views 3 --size 16 >"$temp/synth.log" ||
        die "train: no data"
    LD_LIBRARY_PATH="$lib_dir" "$temp/train" "$temp/data" "$temp/parts" >"$temp/train.log" ||
        die "train: the program failed"
    "$vkrun" train "$temp/parts/config.json" --out "$temp/whole" 2>"$temp/whole.log" ||
        die "train: $(tail -n 1 "$temp/whole.log")"
    "$vkrun" train --out "$temp/parts" --resume 2>"$temp/parts.log" ||
        die "train: $(tail -n 1 "$temp/parts.log")"
    grep -q "resumed from step_0000000002" "$temp/parts.log" || die "train: resumed from elsewhere"
    cmp "$temp/whole/weights_last.safetensors" "$temp/parts/weights_last.safetensors" ||
        die "train: the weights differ"
    echo "train: the same weights after an interruption"
    # An evaluation in C gives the numbers of vkrun eval; only times differ.
    build_program evaluate
    weights="$prefix/share/libsplat/weights/cars64/weights.safetensors"
    "$vkrun" data synth "$temp/cars" --objects 1 --test 3 --size 64 >"$temp/synth.log" || die "data synth"
    LD_LIBRARY_PATH="$lib_dir" "$temp/evaluate" "$temp/cars" "$temp/eval_c" >"$temp/evaluate.log" ||
        die "evaluate: the program failed"
    "$vkrun" eval "$weights" --data "$temp/cars" --out "$temp/eval_tool" >"$temp/eval.log" || die "vkrun eval"
    for name in results.json scores.txt; do
        for method in c tool; do grep -v _per_second "$temp/eval_$method/$name" >"$temp/$method.$name"; done
        cmp "$temp/c.$name" "$temp/tool.$name" || die "evaluate: another $name than vkrun eval's"
    done
    echo "evaluate: $(cat "$temp/evaluate.log")"
fi
