#!/bin/sh
# metal_arrays.sh SPIRV_CROSS FOLDER: translate every SPIR-V module of a folder to Metal's language, and name each
# threadgroup array whose length is a function constant, which Metal refuses.
set -eu
count=0 failed=0
for module in $(find "$2" -name '*.spv'); do
    count=$((count + 1))
    text=$("$1" --msl --msl-version 20300 "$module") || { echo "$module: not translated"; failed=1; continue; }
    found=$(printf '%s\n' "$text" | awk '
        function named(part,   word) {  # whether an expression has one of the names
            while (match(part, /[A-Za-z_][A-Za-z_0-9]*/)) {
                word = substr(part, RSTART, RLENGTH)
                if (word in constants) return 1
                part = substr(part, RSTART + RLENGTH)
            }
            return 0
        }
        /^constant / {
            name = $3
            sub(/[^A-Za-z_0-9].*/, "", name)
            if (/\[\[function_constant/ || named(substr($0, index($0, "=") + 1))) constants[name]
        }
        /^ *threadgroup .*\];/ && named(substr($0, index($0, "["))) {
            sub(/^ */, "")
            print "its length is a function constant: " $0
        }')
    [ -z "$found" ] || { echo "$module: $found"; failed=1; }
done
[ "$count" -gt 0 ] || { echo "no module in $2"; exit 1; }
exit $failed
