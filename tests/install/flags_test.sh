#!/bin/sh
# flags_test.sh SOURCES FOLDER [quick]: the library builds under a distribution's flags, with and without a build type,
# and with clang, as a part of projects in C and C++ that have it by FetchContent and add_subdirectory (consumer/) and
# run with it. quick: what CMake decides, the projects' own sources, and the layers that call the system most.
set -eu
sources=$1
folder=$2
extent=${3-all}
rm -rf "$folder"
mkdir -p "$folder"

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

# configure <name> <way> <languages> <option>...: what CMake finds wrong with the library as a guest fails here.
configure() {
    name=$1
    way=$2
    languages=$3
    shift 3
    run "$name" cmake -S "$sources/tests/install/consumer" -B "$folder/$name" -G Ninja -DSPLAT="$sources" \
        -DWAY="$way" -DLANGUAGES="$languages" "$@"
    if grep -E -- "-Werror( |$)" "$folder/$name/build.ninja"; then die "$name: warnings are errors"; fi
}

# compile <name> <target> <flag>: the project's own source with its own flags, without the library.
compile() {
    ninja -C "$folder/$1" -t commands "$2" | grep "$2.dir/.* -c " >"$folder/$1/compile"
    grep -q -- "$3" "$folder/$1/compile" || die "$1: $2 lacks $3: $(cat "$folder/$1/compile")"
    (cd "$folder/$1" && run "$1" sh ./compile)
}

# build <name> <target>...: without a warning of gcc, for which the sources are written.
build() {
    name=$1
    shift
    run "$name" cmake --build "$folder/$name" --target "$@"
    if [ "$name" != clang ] && grep "warning:" "$folder/$name.log"; then die "$name: warnings"; fi
}

# Nothing of ours lies in the project's folders, unless it asks for that.
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

# The check of guests can fail: it names each fault of a bad one.
refuse_guest() {
    ! cmake -S "$sources/tests/install/consumer" -B "$folder/guest" -G Ninja -DWAY=add_subdirectory -DLANGUAGES=NONE \
        -DSPLAT="$sources/tests/install/consumer/refused" >"$folder/guest.log" 2>&1 || die "a bad guest is welcome"
    for fault in CMAKE_CXX_STANDARD COMPILE_OPTIONS WITH_EXTRAS "prefix: extras"; do
        grep -q "$fault" "$folder/guest.log" || die "not found in $folder/guest.log: $fault"
    done
}

if [ "$extent" = quick ]; then
    refuse -DBUILD_SHARED_LIBS=OFF "is a shared library only"
    refuse -DCMAKE_INSTALL_INCLUDEDIR=/opt/include "CMAKE_INSTALL_INCLUDEDIR is /opt/include, expected a folder below"
    refuse_guest
    faster="-O1 -g0"
fi
flags="$(dpkg-buildflags --get CXXFLAGS | sed 's/-D_FORTIFY_SOURCE=[0-9]//') ${faster-}"
unity="-DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12"
export CXXFLAGS="$flags -D_FORTIFY_SOURCE=3" LDFLAGS="$(dpkg-buildflags --get LDFLAGS)"
# shellcheck disable=SC2086  # a list of words
configure None FetchContent C -DCMAKE_BUILD_TYPE=None $unity
compile None core_test -std=gnu11
# shellcheck disable=SC2086
configure RelWithDebInfo add_subdirectory CXX -DCMAKE_BUILD_TYPE=RelWithDebInfo $unity
compile RelWithDebInfo io_test -std=gnu++14
for type in None RelWithDebInfo; do check_parent "$type"; done
if [ "$extent" = quick ]; then
    build None splat_core splat_io
    exit
fi

# start <name> <program>: built with the library, it runs.
start() {
    build "$1" "$2"
    run "$1" "$folder/$1/$2"
}
start None core_test
start RelWithDebInfo io_test
unset CXXFLAGS LDFLAGS
# shellcheck disable=SC2086
CC=clang CXX=clang++ configure clang FetchContent "C;CXX" -DCMAKE_BUILD_TYPE=Release $unity
start clang core_test
start clang io_test
echo "built with: $flags -D_FORTIFY_SOURCE=3; clang"
