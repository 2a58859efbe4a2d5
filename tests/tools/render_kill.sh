#!/bin/sh
# render_kill.sh <vkrun> <folder>: 'vkrun data render', killed repeatedly at random moments, leaves no part of an
# object, and ends with the files of an uninterrupted command.
set -u
vkrun=$1
temp=$2

fail() {
    echo "render_kill: $*" >&2
    exit 1
}

rm -rf "$temp"
mkdir -p "$temp/meshes"
# Pyramids of different heights.
for i in 1 2 3 4 5 6 7 8 9; do
    printf 'v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0.5 %d 0.5\nf 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n' "$i" \
        > "$temp/meshes/pyramid$i.obj"
done
options="$temp/meshes --views 12 --test-views 12 --size 64"
begun=$(date +%s.%N)
# shellcheck disable=SC2086  # a list of words
"$vkrun" data render $options --out "$temp/whole" > "$temp/log" 2>&1 || fail "$(cat "$temp/log")"
longest=$(echo "$begun $(date +%s.%N)" | awk '{ print $2 - $1 }')

killed=0
# shellcheck disable=SC2046  # a list of words
set -- $(awk -v longest="$longest" 'BEGIN { srand(62); for (i = 0; i < 8; ++i) print longest * rand() }')
for seconds in "$@"; do
    # shellcheck disable=SC2086
    "$vkrun" data render $options --out "$temp/killed" > "$temp/log" 2>&1 &
    sleep "$seconds"
    kill -9 $! 2> /dev/null
    wait $! 2> /dev/null
    [ $? = 137 ] && killed=$((killed + 1))
    for object in "$temp"/killed/srn_objects/objects_*/*; do
        [ -e "$object" ] || continue
        diff -r "$object" "$temp/whole${object#"$temp/killed"}" > "$temp/log" || fail "a part: $(cat "$temp/log")"
    done
done
[ "$killed" -gt 0 ] || fail "no command was killed"
# shellcheck disable=SC2086
"$vkrun" data render $options --out "$temp/killed" > "$temp/log" 2>&1 || fail "$(cat "$temp/log")"
diff -r "$temp/whole" "$temp/killed" > "$temp/log" || fail "other files: $(cat "$temp/log")"
echo "$killed commands were killed"
