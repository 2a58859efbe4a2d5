#!/bin/sh
# flags_test.sh SOURCES FOLDER: the library builds under a distribution's flags, as a part of another project that has
# warnings of its own, and with clang.
set -eu
sources=$1
folder=$2
rm -rf "$folder"
mkdir -p "$folder/parent"
cat >"$folder/parent/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(parent C CXX)
add_compile_options(-Wall -Wextra)
add_subdirectory($sources splat)
END

# build <name> <option>...: the library alone, which is what a project that adds this one gets
build() {
    name=$1
    shift
    cmake -S "$folder/parent" -B "$folder/$name" -G Ninja "$@" >"$folder/$name.log" 2>&1 &&
        cmake --build "$folder/$name" --target splat >>"$folder/$name.log" 2>&1 || {  # shellcheck disable=SC2015
        grep -E "error|Error" "$folder/$name.log" | head -n 20
        echo "$name: the build failed; the output is in $folder/$name.log"
        exit 1
    }
    if ninja -C "$folder/$name" -t targets all | grep -qE "(vkrun|_test): "; then
        echo "$name: a project that adds this one gets its tools or tests, too"
        exit 1
    fi
}

# Nothing of ours lies in the parent's folders, unless it asks for that.
check_parent() {
    cmake --install "$folder/$1" --prefix "$folder/prefix" >>"$folder/$1.log"
    if [ -e "$folder/$1/layers" ] || [ -e "$folder/prefix" ]; then
        echo "$1: a project that adds this one gets layers/ in its build, or installs our files:"
        find "$folder/prefix" -type f | head -n 5
        exit 1
    fi
}

# What cannot be is refused with a sentence.
refuse() {
    if cmake -S "$sources" -B "$folder/refused" -G Ninja "$1" >"$folder/refused.log" 2>&1 ||
        ! tr -s '\n ' ' ' <"$folder/refused.log" | grep -q "$2"; then
        echo "$1: expected a refusal with '$2'; the output is in $folder/refused.log"
        exit 1
    fi
    rm -rf "$folder/refused"
}
refuse -DBUILD_SHARED_LIBS=OFF "is a shared library only"
refuse -DCMAKE_INSTALL_INCLUDEDIR=/opt/include "CMAKE_INSTALL_INCLUDEDIR is /opt/include, expected a folder below"

flags=$(dpkg-buildflags --get CXXFLAGS | sed 's/-D_FORTIFY_SOURCE=[0-9]//')
CXXFLAGS="$flags -D_FORTIFY_SOURCE=3" LDFLAGS=$(dpkg-buildflags --get LDFLAGS) build distribution
check_parent distribution
CC=clang CXX=clang++ build clang -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12
echo "built with: $flags -D_FORTIFY_SOURCE=3; clang"
