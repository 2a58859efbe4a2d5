#!/bin/sh
# weight_difference.sh <program> <sources' tools/weights> <build folder's tools/weights> <folder>: differences give the
# weights again to the byte; damaged ones, other bases and other files are refused, and what was there stays.
set -u
program=$1
sources=$2
built=$3
temp=$4

fail() {
    echo "weight_difference: $*" >&2
    exit 1
}

rm -rf "$temp"
mkdir -p "$temp/missing"
cd "$temp" || fail "no folder $temp"

# refused PATTERN ARGUMENTS...: fails with a sentence, and the file out stays as it was.
refused() {
    pattern=$1
    shift
    echo old >out
    "$program" "$@" out 2>message && fail "$* was accepted"
    grep -q "^weight_difference: .*$pattern" message || fail "$*: '$(cat message)' has no '$pattern'"
    [ "$(cat out)" = old ] || fail "$*: the file was written"
}

# safetensors FILE HEADER DATA: the data in octal escapes.
safetensors() {
    # shellcheck disable=SC2059  # the format holds the bytes
    printf "\\$(printf %o $((${#2} % 256)))\\$(printf %o $((${#2} / 256)))\0\0\0\0\0\0$2$3" >"$1"
}

# The weights that ship.
base=$sources/cars64/weights.safetensors
weights=$built/cars64-depth-normal/weights.safetensors
"$program" apply "$base" "$sources/cars64-depth-normal/weights.difference" out || fail "apply of the shipped difference"
cmp "$weights" out || fail "the build folder has other weights"
"$program" make "$base" "$weights" difference || fail "make"
"$program" apply "$base" difference out || fail "apply"
cmp "$weights" out || fail "other weights than those of which the difference was made"
[ "$(wc -c <difference)" -lt 2700000 ] || fail "the difference has $(wc -c <difference) bytes"
refused "chairs.safetensors: expected CRC-32 [0-9]*, got [0-9]*; name the base" \
    apply "$sources/cars64/chairs.safetensors" difference

# Small ones: a tensor as in the base with numbers next to each other, far away, NaN and -0, one of another shape, one
# that the base has not, one without numbers; blanks behind the header. All without metadata and with them.
safetensors base '{"a":{"dtype":"F16","shape":[4],"data_offsets":[0,8]},
"b":{"dtype":"F16","shape":[1],"data_offsets":[8,10]}}' '\0\074\0\274\0\0\377\377\1\2'
safetensors target '{"__metadata__":{"x":"y"},"c":{"dtype":"F16","shape":[1],"data_offsets":[12,14]},
"a":{"dtype":"F16","shape":[4],"data_offsets":[4,12]},"b":{"dtype":"F16","shape":[2],"data_offsets":[0,4]},
"d":{"dtype":"F16","shape":[0],"data_offsets":[4,4]}}   ' '\1\2\3\4\1\074\0\74\0\200\377\176\5\6'
safetensors nothing '{}' ''
for file in target base nothing; do
    for from in base target nothing; do
        "$program" make $from $file difference || fail "make of $file from $from"
        "$program" apply $from difference out || fail "apply of $file from $from"
        cmp $file out || fail "$file is another when it comes from $from"
    done
done

# Any damage is found, or does not matter: the last bits of a stream do not count.
"$program" make base target difference || fail "make"
size=$(wc -c <difference)
place=0
while [ "$place" -lt "$size" ]; do
    head -c "$place" difference >damaged
    refused "damaged: " apply base damaged
    cp difference damaged
    printf U | dd of=damaged bs=1 seek="$place" conv=notrunc 2>dd.log || fail "dd: $(cat dd.log)"
    if "$program" apply base damaged out 2>message; then cmp target out || fail "byte $place: other weights"; fi
    place=$((place + (place < 44 ? 4 : 13)))
done
# change OFFSET BYTES: damaged is the difference with these bytes, in octal escapes.
change() {
    cp difference damaged
    # shellcheck disable=SC2059
    printf "$2" | dd of=damaged bs=1 seek="$1" conv=notrunc 2>dd.log || fail "dd: $(cat dd.log)"
}
change 0 x && refused "damaged: expected 'splatdif' in front" apply base damaged
change 8 '\2' && refused "damaged: expected version 1, got 2" apply base damaged
change 12 '\0\0\0\0' && refused "base: expected CRC-32 0, got" apply base damaged
change 16 '\0\0\0\0' && refused "damaged: expected CRC-32 0, got .*; restore the file" apply base damaged
change 27 '\377' && refused "damaged: bytes of the header at byte 20: expected at most" apply base damaged
change 28 '\0\0\0\100' && refused "damaged: the low bytes: expected a zlib stream" apply base damaged
change 36 '\377\377' && refused "damaged: header at byte 44: expected 65535 bytes, got" apply base damaged
change "$size" x && refused "damaged: 1 bytes behind the end" apply base damaged
refused "target: expected 'splatdif'" apply base target
refused "gone: cannot be read: No such file" apply gone difference
refused "gone: cannot be read: No such file" apply base gone
rmdir missing
"$program" apply base difference missing/out 2>message && fail "a folder that is not there was written"
grep -q "missing/out: [0-9]* bytes cannot be written" message || fail "$(cat message)"
"$program" apply base difference 2>message
[ $? = 2 ] || fail "too few arguments: $(cat message)"
grep -q "^usage: " message || fail "$(cat message)"

# Targets that a difference cannot hold.
one='"shape":[2],"data_offsets"'
safetensors other "{\"a\":{\"dtype\":\"F32\",$one:[0,8]}}" '\0\0\0\0\0\0\0\0'
refused "other: tensor 'a': expected F16" make base other
safetensors other "{\"a\":{\"dtype\":\"F16\",$one:[0,4]},\"b\":{\"dtype\":\"F16\",$one:[2,6]}}" '\0\0\0\0\0\0'
refused "other: tensor 'b' begins at byte 2 of the data, expected 4" make base other
safetensors other "{\"a\":{\"dtype\":\"F16\",$one:[0,4]}}" '\0\0'
refused "other: tensor 'a': expected data_offsets within the 2 bytes" make base other
safetensors other "{\"a\":{\"dtype\":\"F16\",$one:[0,-4]}}" '\0\0'
refused "other: tensor 'a': expected data_offsets" make base other
safetensors other '{"a":7}' '\0\0'
refused "other: tensor 'a': expected data_offsets" make base other
safetensors other "{\"a\":{\"dtype\":\"F16\",$one:[0,4]}}" '\0\0\0\0\0\0'
refused "other: the tensors have 4 bytes of data, the file 6" make base other
safetensors other "{\"a\":" ''
refused "other: the header of 5 bytes is no JSON object" make base other
printf '\377\0\0\0\0\0\0\0{}' >other
refused "other: header at byte 8: expected 255 bytes, got 2" make base other
refused "other: header at byte 8" make other base

for file in ./*.tmp; do
    [ ! -e "$file" ] || fail "the temporary $file is left"
done
