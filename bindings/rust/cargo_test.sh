#!/bin/sh
# Run cargo in the workspace, against the library of SPLAT_LIB_DIR. Exits with 77 where cargo is missing.
#
#   cargo_test.sh <cargo or NOTFOUND> <folder for what it builds> <arguments of cargo>...
set -eu
cargo=$1
export CARGO_TARGET_DIR="$2"
shift 2
case $cargo in
*NOTFOUND)
    echo "no cargo: install the packages rustc and cargo"
    exit 77
    ;;
esac
# The compiler beside this cargo, not one of another version.
PATH=$(dirname "$cargo"):$PATH
export PATH
cd "$(dirname "$0")"
"$cargo" "$@" --offline --locked
