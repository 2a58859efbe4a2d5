#!/bin/sh
# Write a workspace of the crates to a folder; sources are links. Without `features` they have no optional
# dependencies and none for tests, whose names take a registry, or its index, even where they are not used.
#
#   workspace.sh <folder> [features]
set -eu
rust=$(cd "$(dirname "$0")" && pwd)
if [ "${2:-}" = features ]; then leave=; else leave='/optional = true/d; /^\[dev-dependencies\]/,$d'; fi
for crate in splat-sys splat programs; do
    mkdir -p "$1/$crate"
    for file in "$rust/$crate"/*; do
        case $file in
        */Cargo.toml) ;;
        *) ln -sfn "$file" "$1/$crate/" ;;
        esac
    done
    {
        sed "s|\"\.\./\.\./|\"$rust/../|; $leave" "$rust/$crate/Cargo.toml"
        if [ "$leave" ]; then sed -n '1i[features]
            s/ = .*optional = true.*/ = []/p' "$rust/$crate/Cargo.toml"; fi
    } >"$1/$crate/Cargo.toml"
done
cp "$rust/Cargo.toml" "$1"
ln -sfn "$rust/README.md" "$1/README.md"
