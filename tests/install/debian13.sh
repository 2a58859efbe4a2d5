#!/bin/sh
# debian13.sh SOURCES [--mirror URL] [option of tools/test]...: tools/demo and tools/test work on a bare Debian 13, in a
# folder made by debootstrap. Without --mirror its packages come from where those of this machine do. The files that git
# knows are copied; a folder `shared` beside SOURCES is seen there, read-only. Needs root and 15 GB in TMPDIR. Exit
# status 77: skipped, with the reason.
. "$(dirname "$0")/debian.sh"

# run COMMAND...: below the root, in the copy
run() {
    in_root "$system" sh -c 'cd /opt/libsplat && exec "$@"' sh "$@"
}

# inside FOLDER SOURCES MIRROR [option]...: all that mounts or may leave processes
inside() {
    system=$1/root
    sources=$2
    bootstrap trixie "$system" "$3"
    mkdir -p "$system/opt/libsplat"
    git -c safe.directory='*' -C "$sources" ls-files -z >"$1/files"
    tar --create --directory "$sources" --null --files-from="$1/files" --file "$1/tar"
    tar --extract --directory "$system/opt/libsplat" --no-same-owner --file "$1/tar"
    mount -t proc proc "$system/proc"
    mount --rbind /dev "$system/dev"
    mount --rbind /sys "$system/sys"
    if [ -d "$sources/../shared" ]; then
        mkdir "$system/opt/shared"
        mount --bind "$sources/../shared" "$system/opt/shared"
        mount -o remount,bind,ro "$system/opt/shared"
    fi
    shift 3
    run tools/demo
    [ -s "$system/opt/libsplat/out/report.html" ] || fail "tools/demo wrote no report"
    run tools/test "$@"
}

if [ "$1" = inside ]; then
    shift
    inside "$@"
    exit
fi

sources=$(cd "$1" && pwd)
shift
mirror=$(mirror_here)
if [ "${1-}" = --mirror ]; then
    mirror=$2
    shift 2
fi
need git
private "$0" "$sources" "$mirror" "$@"
