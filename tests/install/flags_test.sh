#!/bin/sh
# flags_test.sh SOURCES FOLDER [quick]: the library builds under a distribution's flags, with and without a build type,
# as a part of another project that has a target core_test, and with clang. quick: what CMake decides, and
# the layers that call the system most.
set -eu
sources=$1
folder=$2
extent=${3-all}
rm -rf "$folder"
mkdir -p "$folder/parent"
echo 'int main(void) { return 0; }' >"$folder/parent/main.c"
cat >"$folder/parent/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(parent C CXX)
set(BUILD_TESTING OFF)
add_compile_options(-Wall -Wextra)
add_executable(core_test main.c)
add_subdirectory($sources splat)
END

die() {
    echo "flags_test: $*"
    exit 1
}

# run <name> <command>...: with its output in <folder>/<name>.log
run() {
    name=$1
    shift
    "$@" >>"$folder/$name.log" 2>&1 || {
        grep -E "error|Error" "$folder/$name.log" | head -n 20
        die "$name: '$*' failed; the output is in $folder/$name.log"
    }
}

# configure <name> <option>...: the parent gets the library alone, and warnings are its own affair.
configure() {
    name=$1
    shift
    run "$name" cmake -S "$folder/parent" -B "$folder/$name" -G Ninja "$@"
    ninja -C "$folder/$name" -t targets all >"$folder/targets"
    if grep -E "(^|/)(vkrun|[a-z_]*_test): .*_LINKER" "$folder/targets" | grep -v "^core_test: "; then
        die "$name: a project that adds this one gets its tools or tests, too"
    fi
    if grep -E -- "-Werror( |$)" "$folder/$name/build.ninja"; then die "$name: warnings are errors"; fi
}

# build <name> <target>...: without a warning of gcc, for which the sources are written.
build() {
    name=$1
    shift
    run "$name" cmake --build "$folder/$name" --target "$@"
    if [ "$name" != clang ] && grep "warning:" "$folder/$name.log"; then die "$name: warnings"; fi
}

# Nothing of ours lies in the parent's folders, unless it asks for that.
check_parent() {
    run "$1" cmake --install "$folder/$1" --prefix "$folder/prefix"
    if [ -e "$folder/$1/layers" ] || [ -e "$folder/prefix" ]; then
        find "$folder/prefix" -type f | head -n 5
        die "$1: a project that adds this one gets layers/ in its build, or installs our files"
    fi
}

# What cannot be is refused with a sentence.
refuse() {
    if cmake -S "$sources" -B "$folder/refused" -G Ninja "$1" >"$folder/refused.log" 2>&1 ||
        ! tr -s '\n ' ' ' <"$folder/refused.log" | grep -q "$2"; then
        die "$1: expected a refusal with '$2'; the output is in $folder/refused.log"
    fi
    rm -rf "$folder/refused"
}

if [ "$extent" = quick ]; then
    refuse -DBUILD_SHARED_LIBS=OFF "is a shared library only"
    refuse -DCMAKE_INSTALL_INCLUDEDIR=/opt/include "CMAKE_INSTALL_INCLUDEDIR is /opt/include, expected a folder below"
    faster="-O1 -g0"
fi
flags="$(dpkg-buildflags --get CXXFLAGS | sed 's/-D_FORTIFY_SOURCE=[0-9]//') ${faster-}"
unity="-DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12"
for type in None RelWithDebInfo; do
    # shellcheck disable=SC2086  # a list of words
    CXXFLAGS="$flags -D_FORTIFY_SOURCE=3" LDFLAGS=$(dpkg-buildflags --get LDFLAGS) \
        configure "$type" -DCMAKE_BUILD_TYPE="$type" $unity
    if [ "$extent" = all ]; then build "$type" splat core_test; fi
    check_parent "$type"
done
if [ "$extent" = quick ]; then
    build None splat_core splat_io
    exit
fi
# shellcheck disable=SC2086
CC=clang CXX=clang++ configure clang -DCMAKE_BUILD_TYPE=Release $unity
build clang splat
echo "built with: $flags -D_FORTIFY_SOURCE=3; clang"
