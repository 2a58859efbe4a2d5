# shellcheck shell=sh
# Sourced by scripts that work in a folder with another Debian.
#
#   skip REASON, fail SENTENCE    end the script
#   need TOOL...                  skips unless root may mount, and the tools are there
#   mirror_here                   where packages of this machine come from
#   bootstrap SUITE ROOT MIRROR   a bare Debian with the way to the registries of packages
#   in_root ROOT COMMAND...       runs a command below it, without this environment
#   private SCRIPT ARGUMENT...    runs the script with "inside" FOLDER ARGUMENT..., where its mounts and processes end
#                                 with it, and removes the folder
name=$(basename "$0" .sh)

skip() {
    echo "skipped: $*"
    exit 77
}

fail() {
    echo "$name: $*" >&2
    exit 1
}

need() {
    [ "$(id -u)" = 0 ] || skip "only root can make the folder of another system"
    for tool in debootstrap unshare "$@"; do
        command -v "$tool" >/dev/null 2>&1 || skip "there is no $tool"
    done
    unshare --mount --pid --fork true 2>/dev/null || skip "nothing may be mounted here"
}

# The first mirror of Debian, not of its security updates, in apt's lists: a line, or a stanza with fields, each.
mirror_here() {
    cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | awk '
        $1 == "deb" || $1 == "URIs:" {
            for (i = 2; i <= NF; ++i)
                if ($i ~ /^https?:.*\/debian\/?$/) {
                    print $i
                    found = 1
                    exit
                }
        }
        END { if (!found) print "http://deb.debian.org/debian" }'
}

bootstrap() {
    echo "== debootstrap $1, from $3"
    debootstrap --variant=minbase --include=ca-certificates "$1" "$2" "$3" >"$2.log" 2>&1 || {
        tail -n 20 "$2.log"
        fail "debootstrap"
    }
    for file in resolv.conf hosts ssl/certs/ca-certificates.crt; do  # the way to the registries of packages
        [ ! -e "/etc/$file" ] || cp -L "/etc/$file" "$2/etc/$file"
    done
}

in_root() {
    root=$1
    shift
    echo "== below the root: $*"
    env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 TERM=dumb DEBIAN_FRONTEND=noninteractive \
        ${http_proxy:+"http_proxy=$http_proxy"} ${https_proxy:+"https_proxy=$https_proxy"} \
        ${no_proxy:+"no_proxy=$no_proxy"} chroot "$root" "$@" || fail "$* failed"
}

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

private() {
    script=$1
    shift
    folder=$(mktemp -d)
    chmod 755 "$folder"
    child=""
    trap clean_up EXIT
    trap 'exit 129' HUP
    trap 'exit 130' INT
    trap 'exit 143' TERM
    unshare --mount --pid --fork --kill-child sh "$script" inside "$folder" "$@" &
    child=$!
    result=0
    wait "$child" || result=$?
    child=""
    exit "$result"
}
