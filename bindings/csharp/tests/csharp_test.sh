#!/bin/sh
# One test of the C# binding.
#
#   csharp_test.sh build                compile Splat.dll, Tests.exe and Smoke.exe, warnings as errors
#   csharp_test.sh run <class>          run the tests of <class>Tests
#   csharp_test.sh load <cc>            libraries that do not fit are refused with both versions
#   csharp_test.sh bare                 machines without a driver or Vulkan: what to install
#   csharp_test.sh lend <cc>            what the library lends is copied before its object goes
#   csharp_test.sh leave                processes end with live objects
#   csharp_test.sh package <python> <cc>  the NuGet package: listing, and its libraries and weights work
#   csharp_test.sh readme               the examples of README.md, in an empty folder
#
# SPLAT_BINDINGS_BUILD is the folder for what is compiled, SPLAT_LIB_DIR that of libsplat.so.
set -eu
here=$(cd "$(dirname "$0")/.." && pwd)
out=$SPLAT_BINDINGS_BUILD
export LD_LIBRARY_PATH="$SPLAT_LIB_DIR${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"

for tool in mcs mono; do
    if ! command -v "$tool" >/dev/null 2>&1; then
        echo "skipped: there is no $tool; install mono-mcs and mono-runtime"
        exit 77
    fi
done

die() {
    echo "csharp_test: $*" >&2
    exit 1
}

# compile <output> <mcs arguments>...
compile() {
    target=$1
    shift
    mcs -langversion:latest -unsafe -warn:4 -warnaserror -out:"$target" "$@"
}

build() {
    mkdir -p "$out"
    rm -rf "$out/src"
    sh "$here/for_mcs.sh" "$out/src"
    compile "$out/Splat.dll" -target:library -r:System.Numerics.dll -doc:"$out/Splat.xml" "$out"/src/*.cs
    compile "$out/Tests.exe" -r:"$out/Splat.dll" -r:System.Numerics.dll "$here"/tests/*.cs
    compile "$out/Smoke.exe" -r:"$out/Splat.dll" "$here/../smoke/Smoke.cs"
}

# refuse <version> <struct> <text>: a library of that version and with that struct cut is refused with the text.
refuse() {
    mkdir -p "$temp/$1-$2"
    mono "$out/Tests.exe" fake-library "$1" "$2" >"$temp/fake.c"
    "$cc" -shared -fPIC -o "$temp/$1-$2/libsplat.so" "$temp/fake.c"
    if LD_LIBRARY_PATH="$temp/$1-$2" mono "$out/Tests.exe" load >"$temp/message"; then
        die "libsplat $1 with $2 cut was loaded"
    fi
    cat "$temp/message"
    grep -q "$3" "$temp/message" || die "the message does not contain: $3"
    grep -q "libsplat 0\.1\.0" "$temp/message" || die "the message does not name version 0.1.0"
}

load() {
    cc=$1
    temp=$(mktemp -d)
    trap 'rm -rf "$temp"' EXIT
    mono "$out/Tests.exe" load
    refuse 0.0.9 none "loaded library is 0\.0\.9"
    refuse 0.2.0 none "loaded library is 0\.2\.0"
    refuse 1.0.0 none "loaded library is 1\.0\.0"
    refuse 0.1.0 splat_camera "struct splat_camera has 160 bytes instead of 168"
    refuse 0.1.1 splat_device_info "loaded library is 0\.1\.1, whose struct splat_device_info"
    mkdir "$temp/other" "$temp/none"
    echo "int splat_other(void) { return 0; }" >"$temp/other.c"
    "$cc" -shared -fPIC -o "$temp/other/libsplat.so" "$temp/other.c"
    if LD_LIBRARY_PATH="$temp/other" mono "$out/Tests.exe" load >"$temp/message"; then
        die "a library without functions was loaded"
    fi
    grep -q "ErrorUnsupported.*not one that this assembly can use" "$temp/message" || die "$(cat "$temp/message")"
    if LD_LIBRARY_PATH="$temp/none" mono "$out/Tests.exe" load >"$temp/message"; then
        echo "an installed libsplat.so was found; the case without one is left out"
    else
        grep -q "DllNotFoundException: libsplat.so was not found" "$temp/message" || die "$(cat "$temp/message")"
    fi
}

# A machine without a driver, and one without Vulkan's loader, are told what to install.
bare() {
    temp=$(mktemp -d)
    trap 'rm -rf "$temp"' EXIT
    mono "$out/Tests.exe" open
    if VK_DRIVER_FILES="$temp/none" VK_ICD_FILENAMES="$temp/none" mono "$out/Tests.exe" open >"$temp/message"; then
        die "a device was opened without a driver"
    fi
    cat "$temp/message"
    grep -q "no usable Vulkan driver; install" "$temp/message" || die "the message does not say what to install"
    for name in libvulkan.so.1 libvulkan.so; do : >"$temp/$name"; done
    if LD_LIBRARY_PATH="$temp:$LD_LIBRARY_PATH" mono "$out/Tests.exe" open >"$temp/message"; then
        die "a device was opened without Vulkan"
    fi
    cat "$temp/message"
    grep -q "install" "$temp/message" || die "the message does not say what to install"
}

lend() {
    temp=$(mktemp -d)
    trap 'rm -rf "$temp"' EXIT
    mono "$out/Tests.exe" fake-library 0.1.0 none >"$temp/fake.c"
    "$1" -shared -fPIC -Wall -Wextra -Werror -I "$SPLAT_HEADER_DIR" -o "$temp/libsplat.so" "$here/tests/lender.c" \
        "$temp/fake.c"
    LD_LIBRARY_PATH="$temp" mono "$out/Tests.exe" lend || die "a text was read when its object was gone"
}

# leave <program> <status>
leave_one() {
    status=0
    mono "$out/Tests.exe" "$1" || status=$?
    [ "$status" = "$2" ] || die "$1 ended with status $status, expected $2"
    echo "$1: status $status"
}

leave() {
    for _ in 1 2 3; do
        leave_one leave-objects 0
        leave_one leave-computing 0
        leave_one leave-by-exit 5
    done
}

# example <folder> <assembly>: compile and run the program of README.md in the empty folder app.
example() {
    cp "$2" "$1/app/Splat.dll"
    # shellcheck disable=SC2016  # the backquotes are those of Markdown
    sed -n '/^```csharp$/,/^```$/{/^```/d;p;}' "$here/README.md" >"$1/app/Program.cs"
    grep -q "static void Main" "$1/app/Program.cs" || die "no program between \`\`\`csharp and \`\`\` in README.md"
    (cd "$1/app" && mcs -langversion:latest -r:Splat.dll Program.cs && mono Program.exe)
    [ "$(head -c 4 "$1/app/object.png" | tail -c 3)" = PNG ] || die "the example made no object.png"
    head -c 3 "$1/app/object.ply" | grep -q ply || die "the example made no object.ply"
}

readme() {
    temp=$(mktemp -d)
    trap 'rm -rf "$temp"' EXIT
    mkdir "$temp/app"
    example "$temp" "$out/Splat.dll"
}

# pack <libsplat.so> <options>...
pack() {
    so=$1
    shift
    "$python" "$here/package/pack.py" --library "$so" --weights "$weights" "$@"
}

package() {
    temp=$(mktemp -d)
    trap 'rm -rf "$temp"' EXIT
    unset LD_LIBRARY_PATH
    python=$1 cc=$2
    set -- --assembly "$out/Splat.dll" --output
    weights=$SPLAT_LIB_DIR/../tools/weights
    pack "$SPLAT_LIB_DIR/libsplat.so" "$@" "$temp"
    "$python" "$here/package/check.py" "$temp"/*.nupkg "$temp/content"
    native=$temp/content/runtimes/linux-x64/native
    if pack "$native/libpng16.so.16" "$@" "$temp" 2>"$temp/message"
    then die "a library without a RUNPATH was packed"; fi
    grep -q "RUNPATH none" "$temp/message" || die "$(cat "$temp/message")"
    small_packages "$@"

    # The library by its path, and what it needs beside it.
    mkdir "$temp/app" "$temp/loads"
    echo "<configuration><dllmap dll=\"libsplat\" target=\"$native/libsplat.so\"/></configuration>" \
        >"$temp/app/Splat.dll.config"
    LD_DEBUG=libs LD_DEBUG_OUTPUT="$temp/loads/of" example "$temp" "$temp/content/lib/netstandard2.0/Splat.dll"
    for library in "$native"/*; do
        # One that mono itself needs is there before (libz.so.1 on Debian 13).
        if ldd "$(command -v mono)" | grep -q "^[[:space:]]*${library##*/} "; then continue; fi
        grep -q "calling init: $library$" "$temp"/loads/* || die "the program did not load $library"
    done

    # Weights beside the program alone, where the package's targets copy them.
    mv "$temp/content/runtimes/share/libsplat" "$temp/app/"
    (cd "$temp/app" && rm object.png && mono Program.exe && [ -e object.png ]) || die "no weights beside the program"
    rm -r "$temp/app/libsplat"
    if (cd "$temp/app" && mono Program.exe 2>"$temp/message"); then die "weights came from nowhere"; fi
    grep -q "no built-in weights 'cars64'" "$temp/message" || die "$(cat "$temp/message")"
}

# small_packages <options of pack>...: packages of a library that is small, and of empty weights.
small_packages() {
    weights=$temp/weights
    (cd "$SPLAT_LIB_DIR/../tools/weights" && find -L . -type f) | while read -r file; do
        mkdir -p "$weights/${file%/*}"
        : >"$weights/$file"
    done
    mkdir "$temp/small" "$temp/again"
    echo "int splat_version(void) { return 1; }" >"$temp/small.c"
    # shellcheck disable=SC2016  # $ORIGIN is the loader's
    "$cc" -shared -fPIC -o "$temp/small/libsplat.so" "$temp/small.c" -Wl,-rpath,'$ORIGIN' -Wl,--no-as-needed \
        "$(ldd "$SPLAT_LIB_DIR/libsplat.so" | awk '/libyaml/ { print $3 }')"
    for folder in small again; do pack "$temp/small/libsplat.so" "$@" "$temp/$folder" 2>/dev/null; done
    cmp "$temp"/small/*.nupkg "$temp"/again/*.nupkg || die "two packages of the same files differ"
    "$python" "$here/package/check.py" "$temp"/small/*.nupkg "$temp/small/content" >/dev/null
    for part in libyaml-0 licenses/libyaml; do
        "$python" -c "import sys, zipfile
with zipfile.ZipFile(sys.argv[1]) as whole, zipfile.ZipFile(sys.argv[2], 'w') as less:
    for name in whole.namelist():
        if sys.argv[3] not in name: less.writestr(name, whole.read(name))" \
            "$temp"/small/*.nupkg "$temp/less.Libsplat.0.1.0.nupkg" "$part"
        if "$python" "$here/package/check.py" "$temp"/less.*.nupkg "$temp/less" >/dev/null 2>"$temp/message"
        then die "a package without $part is passed"; fi
        grep -q "libyaml-0.so.2.* is missing" "$temp/message" || die "$(cat "$temp/message")"
    done
    windows_package "$@"
}

# windows_package <options of pack>...: a library for Windows is packed with licences, as libsplat.dll.
windows_package() {
    if ! command -v x86_64-w64-mingw32-gcc >/dev/null 2>&1; then
        echo "the part for Windows is left out: there is no x86_64-w64-mingw32-gcc"
        return
    fi
    built=$temp/windows/src # a build tree, which says what it links
    mkdir -p "$built"
    echo "int other(void) { return 1; }" >"$temp/other.c"
    echo "int other(void); int splat_version(void) { return other(); }" >"$temp/splat.c"
    x86_64-w64-mingw32-gcc -shared -o "$temp/other.dll" "$temp/other.c"
    x86_64-w64-mingw32-gcc -shared -o "$built/splat.dll" "$temp/splat.c" "$temp/other.c"
    not_packed() {
        if pack "$temp/small/libsplat.so" --windows "$built/splat.dll" "$@" "$temp/windows" 2>"$temp/message"
        then die "packed: a splat.dll $what"; fi
        grep -q "$sentence" "$temp/message" || die "$(cat "$temp/message")"
    }
    what="of which nothing is known" sentence="what .* has inside is unknown" not_packed "$@"
    printf "build src/splat.dll : link\n  LINK_LIBRARIES =" >"$temp/windows/build.ninja"
    for name in gif jpeg png webp yaml z zstd; do
        printf " %s" "$temp/libraries/prefix/lib/lib$name.a" >>"$temp/windows/build.ninja"
    done
    what="without licences" sentence="the licence of giflib is unknown" not_packed "$@"
    for name in giflib libjpeg-turbo libpng1.6 libwebp libyaml zlib libzstd; do
        mkdir -p "$temp/libraries/source/$name/debian"
        echo "licence of $name" >"$temp/libraries/source/$name/debian/copyright"
    done
    pack "$temp/small/libsplat.so" --windows "$built/splat.dll" "$@" "$temp/windows" 2>/dev/null
    "$python" "$here/package/check.py" "$temp"/windows/*.nupkg "$temp/windows/content" >"$temp/message"
    grep -q "^runtimes/win-x64/native/libsplat.dll$" "$temp/message" || die "$(cat "$temp/message")"
    x86_64-w64-mingw32-gcc -shared -o "$built/splat.dll" "$temp/splat.c" "$temp/other.dll"
    what="that needs another library" sentence="needs other.dll" not_packed "$@"
}

command=$1
shift
case "$command" in
build) build ;;
run) mono "$out/Tests.exe" "$1" ;;
load) load "$1" ;;
bare) bare ;;
lend) lend "$1" ;;
leave) leave ;;
package) package "$1" "$2" ;;
readme) readme ;;
*) die "unknown command $command" ;;
esac
