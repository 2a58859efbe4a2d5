#!/bin/sh
# Write a workspace of the crates to a folder; sources are links. Without `features` they have no optional
# dependencies and none for tests, whose names take a registry, or its index, even where they are not used.
#
#   workspace.sh <folder> [features]
set -eu
rust=$(cd "$(dirname "$0")" && pwd)
if [ "${2:-}" = features ]; then leave=; else leave='/optional = true/d; /^\[dev-dependencies\]/,/^$/d'; fi

# put <file>: its new text, in one move, and only if it differs: tests run beside each other.
put() {
    cat >"$1.$$"
    if cmp -s "$1.$$" "$1"; then rm "$1.$$"; else mv "$1.$$" "$1"; fi
}

for crate in splat-sys splat programs; do
    mkdir -p "$1/$crate"
    for file in "$rust/$crate"/*; do
        case $file in
        */Cargo.toml) ;;
        *) ln -sfn "$file" "$1/$crate/" ;;
        esac
    done
    { # the last section is that of the features
        sed "s|\"\.\./\.\./|\"$rust/../|; $leave" "$rust/$crate/Cargo.toml"
        if [ "$leave" ]; then sed -n 's/ = .*optional = true.*/ = []/p' "$rust/$crate/Cargo.toml"; fi
    } | put "$1/$crate/Cargo.toml"
done
put "$1/Cargo.toml" <"$rust/Cargo.toml"
ln -sfn "$rust/README.md" "$1/README.md"
