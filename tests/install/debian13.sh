#!/bin/sh
# debian13.sh SOURCES [--mirror URL] [option of tools/test]...: tools/demo and tools/test work on a bare Debian 13, in a
# folder made by debootstrap. Without --mirror its packages come from where those of this machine do. The files that git
# knows are copied; a folder `shared` beside SOURCES is seen there, read-only. Needs root and 15 GB in TMPDIR. Exit
# status 77: skipped, with the reason.

skip() {
    echo "skipped: $*"
    exit 77
}

fail() {
    echo "debian13: $*" >&2
    exit 1
}

# The first mirror of Debian, not of its security updates, in apt's lists: a line, or a stanza with fields, each.
mirror_here() {
    cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | awk '
        $1 == "deb" || $1 == "URIs:" {
            for (i = 2; i <= NF; ++i)
                if ($i ~ /^https?:.*\/debian\/?$/) {
                    print $i
                    exit
                }
        }'
}

# run COMMAND...: below the root, in the copy
run() {
    echo "== Debian 13: $*"
    env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 TERM=dumb \
        ${http_proxy:+"http_proxy=$http_proxy"} ${https_proxy:+"https_proxy=$https_proxy"} \
        ${no_proxy:+"no_proxy=$no_proxy"} chroot "$root" sh -c 'cd /opt/libsplat && exec "$@"' sh "$@" ||
        fail "$* failed"
}

# inside FOLDER SOURCES MIRROR [option]...: all that mounts or may leave processes
inside() {
    root=$1/root
    sources=$2
    echo "== debootstrap, from $3"
    debootstrap --variant=minbase --include=ca-certificates trixie "$root" "$3" >"$1/log" 2>&1 || {
        tail -n 20 "$1/log"
        fail "debootstrap"
    }
    for file in resolv.conf hosts ssl/certs/ca-certificates.crt; do  # the way to the registries of packages
        [ ! -e "/etc/$file" ] || cp -L "/etc/$file" "$root/etc/$file"
    done
    mkdir -p "$root/opt/libsplat"
    git -c safe.directory='*' -C "$sources" ls-files -z >"$1/files"
    tar --create --directory "$sources" --null --files-from="$1/files" --file "$1/tar"
    tar --extract --directory "$root/opt/libsplat" --no-same-owner --file "$1/tar"
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    mount --rbind /sys "$root/sys"
    if [ -d "$sources/../shared" ]; then
        mkdir "$root/opt/shared"
        mount --bind "$sources/../shared" "$root/opt/shared"
        mount -o remount,bind,ro "$root/opt/shared"
    fi
    shift 3
    run tools/demo
    [ -s "$root/opt/libsplat/out/report.html" ] || fail "tools/demo wrote no report"
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
[ "$(id -u)" = 0 ] || skip "only root can make the folder of another system"
for tool in debootstrap git unshare; do
    command -v "$tool" >/dev/null 2>&1 || skip "there is no $tool"
done
unshare --mount --pid --fork true 2>/dev/null || skip "nothing may be mounted here"

folder=$(mktemp -d)
chmod 755 "$folder"
child=""
# A mount namespace takes its mounts with it, a process namespace its processes, however this script ends.
# shellcheck disable=SC2317  # called by the trap
clean_up() {
    if [ -n "$child" ]; then
        kill -KILL "$child" 2>/dev/null || true  # unshare ignores other signals
        wait "$child" || true
    fi
    for attempt in 1 2 3 4 5; do  # what was killed may take a moment to end
        if rm -rf --one-file-system "$folder"; then break; fi
        sleep "$attempt"
    done
}
trap clean_up EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM
unshare --mount --pid --fork --kill-child \
    sh "$0" inside "$folder" "$sources" "${mirror:-http://deb.debian.org/debian}" "$@" &
child=$!
result=0
wait "$child" || result=$?
child=""
exit "$result"
