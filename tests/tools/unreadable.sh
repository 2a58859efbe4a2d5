#!/bin/sh
# unreadable.sh <vkrun> <folder>: takes each folder and each file of a data set away, in three ways, and runs what reads
# it. No command ends with exit status 0 and fewer objects, or maps, than there are.
# Root reads files of mode 000: the commands then run as nobody, by setpriv. Exit status: 77 skipped.
set -u
vkrun=$1
work=$2
data=$work/data
commands=0 places=0 silent=0

if [ "$(id -u)" -eq 0 ]; then
    command -v setpriv >/dev/null || exit 77
    as_nobody="setpriv --reuid=65534 --regid=65534 --clear-groups"
else
    as_nobody=
fi
run() {
    # shellcheck disable=SC2086
    $as_nobody "$vkrun" "$@"
}

chmod -R u+rwX "$work" 2>/dev/null
rm -rf "$work"
mkdir -p "$work"
chmod 777 "$work"
run --version >/dev/null 2>&1 || exit 77 # nobody may not go to the program
export HOME="$work" XDG_CACHE_HOME="$work/cache"

run data synth "$data" --objects 3 --val 2 --test 2 --views 2 --test-views 2 --size 16 >/dev/null || exit 1
small="--set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1 --set model.channel_mult=[1,2]
       --set model.attention_resolutions=[8] --set opt.batch_size=1 --set opt.imgs_per_obj=2 --set opt.iterations=1"
# shellcheck disable=SC2086
run train --data "$data" --out "$work/run" $small >/dev/null 2>&1 || exit 1

# count <key> <JSON file>: the first number of the key
count() {
    sed -n 's/.*"'"$1"'": *\([0-9]*\).*/\1/p' "$2" | head -n 1
}

# expect <what> <number that is whole> <command...>: a failure, or the whole number, which `measure` prints
expect() {
    what=$1 whole=$2
    shift 2
    commands=$((commands + 1))
    rm -rf "$work/out"
    if "$@" >"$work/log" 2>&1; then
        found=$(measure)
        [ "$found" = "$whole" ] && return
        echo "$place, $way: $what ended with exit status 0 and '$found', expected '$whole'"
        cat "$work/log"
        silent=$((silent + 1))
    fi
}

try_all() {
    places=$((places + 1))
    measure() { echo none; } # a check finds it in any case
    expect "data check" problems run data check "$data"
    measure() { count objects "$work/out/results.json"; }
    expect eval 2 run eval "$work/run/weights_last.safetensors" --data "$data" --out "$work/out"
    measure() { count objects "$work/out/run.json"; }
    # shellcheck disable=SC2086
    expect train 3 run train --data "$data" --out "$work/out" $small
    measure() { cat "$work"/out/*/store.json | grep -c '"intrinsics"'; }
    expect "data import" 7 run data import "$data" "$work/out"
    measure() { find "$work/out" -name mask | wc -l; } # by object
    expect "priors mask" 7 run priors mask "$data" --out "$work/out"
}

for path in $(cd "$data" && find srn_cars -mindepth 2 | grep -v '/depth/\|/normal/\|/mask/\|000000\.' | sort); do
    place=$path
    way="mode 000"
    mode=$(stat -c %a "$data/$path")
    chmod 000 "$data/$path"
    try_all
    chmod "$mode" "$data/$path"
    way="a link that leads nowhere"
    mv "$data/$path" "$work/away"
    ln -s /nonexistent/place "$data/$path"
    try_all
    rm "$data/$path"
    way="gone"
    case $path in
    */cars_*/*/*) try_all ;; # an object that is gone as a whole was never there
    esac
    mv "$work/away" "$data/$path"
done
echo "$places places, $commands commands, $silent silent"
[ "$silent" -eq 0 ] && [ "$places" -gt 30 ]
