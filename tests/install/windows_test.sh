#!/bin/sh
# windows_test.sh SOURCE BUILD: splat.dll and vkrun.exe compile and link for Windows. Exit status 77 where the compiler
# or the libraries are missing. With little optimisation and by one job: what is tested is that they build. Without any,
# an object has ten times as many sections, which GNU ld 2.40 searches from the first on for each symbol: minutes a
# program. A later run compiles what changed.
set -eu
prefix=$1/build/windows-libraries/prefix
if ! command -v x86_64-w64-mingw32-g++-posix >/dev/null; then
    echo "skipped: no compiler for Windows here (g++-mingw-w64-x86-64-posix)"
    exit 77
fi
if [ ! -e "$prefix/lib/libyaml.a" ]; then
    echo "skipped: no libraries for Windows in $prefix; tools/windows/libraries build/windows-libraries builds them"
    exit 77
fi
mkdir -p "$2"
cmake -S "$1" -B "$2" -G Ninja --toolchain "$1/cmake/windows.cmake" -DSPLAT_WINDOWS_PREFIX="$prefix" \
    -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O1 -DCMAKE_C_FLAGS_DEBUG= -DCMAKE_UNITY_BUILD=ON \
    -DCMAKE_UNITY_BUILD_BATCH_SIZE=0 -DSPLAT_BUILD_TESTS=OFF -DSPLAT_BUILD_TOOLS=ON -DSPLAT_INSTALL=OFF \
    -DSPLAT_WERROR=ON >"$2/configure.log" 2>&1 || {
    cat "$2/configure.log"
    exit 1
}
cmake --build "$2" --parallel 1 --target splat --target vkrun
