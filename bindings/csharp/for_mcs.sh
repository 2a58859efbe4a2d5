#!/bin/sh
# Copy src for mcs, mono's compiler, to a folder whose other .cs files go: without the "?" of references that may be
# null, which it does not know. That of numbers and flags stays.
#
#   for_mcs.sh <folder>
set -eu
mkdir -p "$1"
rm -f "$1"/*.cs
for file in "$(dirname "$0")"/src/*.cs; do
    sed -E 's/\b(int|double|[A-Za-z]+Flags)\? /\1?\x01/g; s/([]A-Za-z0-9_>])\?([] ,)>(])/\1\2/g; s/\?\x01/? /g' \
        "$file" >"$1/${file##*/}"
done
