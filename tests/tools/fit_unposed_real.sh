#!/bin/sh
# fit_unposed_real.sh Photographs|Video <vkrun> <folder> <real data>: poses made anew by COLMAP, of photographs, or of
# a video of renders by ffmpeg. Its label is long: ctest --preset dev -L long -R Unposed
set -u
kind=$1
vkrun=$2
temp=$3
real=${SPLAT_REAL_DIR:-$4}

fail() {
    echo "fit_unposed_real: $*" >&2
    exit 1
}
skip() {
    echo "skipped: $*"
    exit 77
}
if [ "$kind" = Photographs ]; then
    programs=colmap
    packages=colmap
    input=images/fox/images
else
    programs="colmap ffmpeg ffprobe"
    packages="colmap ffmpeg"
    input=derived/guitar_inria_sh0.ply
fi
for needed in $programs; do
    command -v "$needed" > /dev/null ||
        skip "$needed is not installed: apt install $packages, then ctest --preset dev -L long -R Unposed$kind"
done
[ -e "$real/$input" ] || skip "there is no $input in SPLAT_REAL_DIR"

rm -rf "$temp"
mkdir -p "$temp"
if [ "$kind" = Photographs ]; then
    cp -r "$real/images/fox/images" "$temp/my photos"
    data="$temp/my photos"
    least_psnr=26
else
    "$vkrun" render "$real/derived/guitar_inria_sh0.ply" --orbit 90 --size 640x960 --elevation 15 \
        --background 0.6,0.7,0.5 --out "$temp/frames" > "$temp/log" 2>&1 || fail "$(cat "$temp/log")"
    data="$temp/film.mp4"
    ffmpeg -v error -framerate 15 -i "$temp/frames/%03d.png" -c:v libx264 -crf 16 -pix_fmt yuv420p "$data" ||
        fail "ffmpeg makes no video"
    least_psnr=28
fi
"$vkrun" fit "$data" --out "$temp/run" --seconds 15 --downscale 2 --json > "$temp/result.json" 2> "$temp/log" ||
    fail "status $?: $(tail -n 5 "$temp/log")"
grep 'have a place' "$temp/log" || fail "no count: $(tail -n 5 "$temp/log")"
cat "$temp/result.json"
psnr=$(sed -n 's/.*"held_out_psnr": \([0-9.]*\).*/\1/p' "$temp/result.json")
awk "BEGIN { exit !($psnr >= $least_psnr) }" || fail "held-out PSNR $psnr dB, expected $least_psnr or more"
