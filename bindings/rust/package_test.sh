#!/bin/sh
# Make the packages of both crates and use them in an empty project as if published: with an installed library, with
# one of another version, without a Vulkan driver, and with the sources inside. No registry is asked.
#
#   package_test.sh <folder of libsplat.so> <cmake> <cargo or NOTFOUND> [bundled]
#
# bundled: builds the library that the package has inside, which takes minutes; else CMake's part of that is tried.
# Exits with 77 where cargo is missing.
set -eu
lib=$1
cmake=$2
cargo=$3
bundled=${4-}
. "$(dirname "$0")/cargo.sh"

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT
unset SPLAT_LIB_DIR SPLAT_LIBRARY LD_LIBRARY_PATH PKG_CONFIG_PATH PKG_CONFIG_LIBDIR CARGO_TARGET_DIR
export RUSTFLAGS="-D warnings" CARGO_PROFILE_DEV_DEBUG=0

for folder in packages again; do sh "$rust/package.sh" "$cargo" "$temp/$folder" || die "cargo package"; done
cd "$temp/packages"
for crate in libsplat-[0-9]*.crate libsplat-sys-*.crate; do
    cmp "$crate" "../again/$crate" || die "two packages of the same sources differ"
    [ "$(wc -c <"$crate")" -lt 10000000 ] || die "the registry takes 10 MB: $(ls -l "$crate")"
    name=${crate%.crate}
    mkdir -p ../sources
    tar -xf "$crate" -C ../sources
    for file in LICENSE README.md; do [ -s "../sources/$name/$file" ] || die "$crate lacks $file"; done
    printf '{"files": {}, "package": "%s"}' "$(sha256sum "$crate" | cut -d ' ' -f 1)" \
        >"../sources/$name/.cargo-checksum.json"
    echo "$crate: $(wc -c <"$crate") bytes"
done

# What is in the packages has no warnings, of which cargo shows none in crates of a registry: [patch].
mkdir -p "$temp/empty/src" "$temp/empty/.cargo" "$temp/pkgconfig" "$temp/other"
cd "$temp/empty"
cat >Cargo.toml <<END
[package]
name = "empty"
version = "0.1.0"
edition = "2021"
[dependencies]
libsplat = { version = "0.1", default-features = false, features = ["${bundled:-system}"] }
[patch.crates-io]
libsplat = { path = "$(echo "$temp"/sources/libsplat-[0-9]*)" }
libsplat-sys = { path = "$(echo "$temp"/sources/libsplat-sys-*)" }
END
cat >src/main.rs <<END
use splat::prelude::*;

fn main() -> Result<()> {
    splat::check_library()?;
    let weights = splat::builtin_weights(None)?;
    println!("{} beside {}", Device::create(&DeviceDesc::default())?.get_info()?.name, weights.display());
    Ok(())
}
END
cat >.cargo/config.toml <<END
[source.crates-io]
replace-with = "packages"
[source.packages]
directory = "$temp/sources"
END
version=$(readlink -f "$lib/libsplat.so" | sed 's/.*\.so\.//')
cat >"$temp/pkgconfig/splat.pc" <<END
Name: splat
Description: a test
Version: $version
Libs: -L$lib -lsplat
END
[ "$bundled" ] || export PKG_CONFIG_LIBDIR="$temp/pkgconfig"
"$cargo" run --offline >"$temp/log" 2>&1 || die "$(cat "$temp/log")"
grep "beside" "$temp/log" || die "$(cat "$temp/log")"
[ -z "$bundled" ] || exit 0

refuses() { # refuses <what is said> <setting or word of a command>...
    said=$1
    shift
    if env "$@" >"$temp/log" 2>&1; then die "not refused: $said"; fi
    grep -q "$said" "$temp/log" || die "expected '$said', got: $(cat "$temp/log")"
}
refuses "apt-get install mesa-vulkan-drivers" LD_LIBRARY_PATH="$lib" VK_ICD_FILENAMES="$temp/none.json" \
    VK_DRIVER_FILES="$temp/none.json" target/debug/empty
# A library of version 0.2.0 of the same name, in which the loader finds all that the program asks for.
{
    nm -D --undefined-only target/debug/empty | sed -n 's/.* U \(splat_[a-z_0-9]*\).*/\1/p' |
        grep -v -x -e splat_version -e splat_build_info | sed 's/.*/int &(void) { return 0; }/'
    echo 'unsigned splat_version(void) { return 2 << 12; } const char* splat_build_info(void) { return "{}"; }'
} >"$temp/other.c"
soname=$(readelf -d "$lib/libsplat.so" | sed -n 's/.*soname: \[\(.*\)\]/\1/p')
cc -w -shared -fPIC -Wl,--version-script="$rust/../../cmake/exports.map" "$temp/other.c" -o "$temp/other/$soname"
refuses "is version 0.2.0, but this crate was made for $version" LD_LIBRARY_PATH="$temp/other" \
    target/debug/empty

# The sources inside: CMake takes them, and all files of its graph are there. What it would install is linked.
cat >"$temp/cmake" <<END
#!/bin/sh
case \$1 in
--build) exec ninja -n -C "\$2" ;;
--install) mkdir -p "\$2/../prefix/lib" && ln -s "$lib"/libsplat.so* "\$2/../prefix/lib" ;;
*) exec "$cmake" -G Ninja "\$@" ;;
esac
END
chmod +x "$temp/cmake"
cd "$temp"/sources/libsplat-sys-*
# Without a feature there is no library.
unset PKG_CONFIG_LIBDIR
CMAKE="$temp/cmake" "$cargo" build --offline --features bundled >"$temp/log" 2>&1 ||
    die "$(cat "$temp/log")"
refuses "neither the feature .system. nor .bundled." "$cargo" build --offline --no-default-features
