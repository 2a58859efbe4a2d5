#!/bin/sh
# Test the optional features with the crates that they are of, and their documentation without the library. Exits with
# 77 where cargo is missing, older than those crates, or reaches no registry.
#
#   features_test.sh <cargo or NOTFOUND> <folder for what it builds>
set -eu
cargo=$1
export CARGO_TARGET_DIR="$2" CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=0 CARGO_NET_RETRY=0
. "$(dirname "$0")/cargo.sh"
case $("$cargo" --version) in
"cargo 1."[0-8]?.*) skip "the newest crates need a newer cargo than $("$cargo" --version)" ;;
esac
crates=$CARGO_TARGET_DIR/crates
sh "$rust/workspace.sh" "$crates" features
cd "$crates"
"$cargo" fetch 2>"$crates/log" || skip "no registry: $(tail -n 1 "$crates/log")"

"$cargo" test --offline -p libsplat --all-features --test crates
env -u SPLAT_LIB_DIR DOCS_RS=1 PKG_CONFIG_LIBDIR="$crates" RUSTDOCFLAGS="-D warnings" \
    "$cargo" doc --offline --no-deps -p libsplat-sys -p libsplat --all-features
