#!/bin/sh
# Run a command of cargo without a registry, against the library of SPLAT_LIB_DIR. Exits with 77 where cargo or
# its command is missing.
#
#   cargo_test.sh <cargo or NOTFOUND> <folder for what it builds> <command> <arguments>...
set -eu
cargo=$1
export CARGO_TARGET_DIR="$2"
command=$3
shift 3
case $cargo in
*NOTFOUND)
    echo "no cargo: install the packages rustc and cargo"
    exit 77
    ;;
esac
# The compiler beside this cargo, not one of another version.
PATH=$(dirname "$cargo"):$PATH
export PATH
if ! "$cargo" "$command" --help >/dev/null 2>&1; then
    echo "no cargo $command beside $cargo"
    exit 77
fi
sh "$(dirname "$0")/workspace.sh" "$CARGO_TARGET_DIR/crates"
cd "$CARGO_TARGET_DIR/crates"
"$cargo" "$command" --offline "$@"
