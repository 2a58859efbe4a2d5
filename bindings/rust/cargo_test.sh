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
. "$(dirname "$0")/cargo.sh"
"$cargo" "$command" --help >/dev/null 2>&1 || skip "no cargo $command beside $cargo"
sh "$rust/workspace.sh" "$CARGO_TARGET_DIR/crates"
cd "$CARGO_TARGET_DIR/crates"
"$cargo" "$command" --offline "$@"
