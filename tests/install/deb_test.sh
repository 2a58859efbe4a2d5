#!/bin/sh
# deb_test.sh SOURCES BUILD [--mirror URL]: packages of Debian from the tree BUILD, built when it is not. Two runs give
# the same bytes, and lintian finds no error. Installed in a bare Debian 12, made by debootstrap, vkrun computes rightly
# and the first programs of README.md in Python and C run; where buildah is, the image of Containerfile runs the demo.
# Needs root, debootstrap, debhelper, dh-python and lintian. Exit status 77: skipped, with the reason.
set -eu
. "$(dirname "$0")/debian.sh"

# block LANGUAGE: the first block of it in README.md
block() {
    sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/{/^\`\`\`/d;p;}" "$sources/README.md"
}

# inside FOLDER SOURCES PACKAGES MIRROR: all that mounts or may leave processes
inside() {
    system=$1/root
    sources=$2
    bootstrap bookworm "$system" "$4"
    if command -v buildah >/dev/null; then image "$1" "$3"; else echo "left out: the image, as there is no buildah"; fi
    mount -t proc proc "$system/proc"
    mount --rbind /dev "$system/dev"
    mkdir "$system/packages" "$system/work"
    cp "$3"/*.deb "$system/packages"
    in_root "$system" apt-get -qq update
    in_root "$system" sh -c 'apt-get -qq -o Dpkg::Use-Pty=0 install -y /packages/*.deb gcc libc6-dev pkgconf \
        cmake make >/dev/null'
    block python >"$system/work/first.py"
    block c >"$system/work/orbit.c"
    in_root "$system" sh -ec 'cd /work
        vkrun doctor
        vkrun demo --out out --objects 2
        cp "$(find out/data -path "*/rgb/*.png" | sort | head -n 1)" photo.png
        python3 first.py
        test -s orbit.png && rm orbit.png
        cc orbit.c $(pkg-config --cflags --libs splat) -o orbit
        ./orbit scene.ply
        test -s orbit.png
        test -s /usr/share/man/man1/vkrun-predict.1.gz
        printf "cmake_minimum_required(VERSION 3.25)\nproject(a C)\nfind_package(Splat REQUIRED)
            add_executable(a orbit.c)\ntarget_link_libraries(a splat::splat)\n" >CMakeLists.txt
        cmake -B build >/dev/null && cmake --build build >/dev/null && ./build/a scene.ply'
    in_root "$system" apt-get -qq purge -y vkrun 'libsplat*' python3-libsplat >/dev/null
    [ -z "$(find "$system/usr" -name '*splat*' -o -name '*vkrun*' | grep -v /dpkg/)" ] || fail "files are left"
}

# image FOLDER PACKAGES: Containerfile on the bare system in place of its base image
image() {
    storage="--root $1/storage --runroot $1/run --storage-driver vfs"
    # shellcheck disable=SC2086  # lists of words
    tool() { buildah $storage "$@"; }
    container=$(tool from scratch)
    tool add --quiet "$container" "$system" / >/dev/null
    tool commit --quiet "$container" localhost/base >/dev/null
    tool rm "$container" >/dev/null
    tool bud --quiet --isolation chroot --pull-never --build-arg BASE=localhost/base --network host \
        -f "$sources/packaging/Containerfile" -t vkrun "$2" >"$1/bud.log" 2>&1 ||
        { cat "$1/bud.log"; fail "buildah bud"; }
    container=$(tool from --pull-never localhost/vkrun)
    echo "== the image: $(tool inspect --format '{{.OCIv1.Config.User}} {{.OCIv1.Config.Cmd}}' localhost/vkrun)"
    [ "$(tool run --isolation chroot "$container" -- id -u)" = 1000 ] || fail "the image runs as another user"
    # shellcheck disable=SC2046  # a list of words
    tool run --isolation chroot "$container" -- \
        $(tool inspect --format '{{range .OCIv1.Config.Cmd}}{{.}} {{end}}' localhost/vkrun) >"$1/demo.log" 2>&1 ||
        { cat "$1/demo.log"; fail "the image's command"; }
    tail -n 3 "$1/demo.log"
    rm -rf "$1/storage"
}

if [ "$1" = inside ]; then
    shift
    inside "$@"
    exit
fi
sources=$(cd "$1" && pwd)
build=$2
mirror=$(mirror_here)
[ "${3-}" != --mirror ] || mirror=$4
need dh dh_python3 lintian
out=$build-packages
rm -rf "$out"
SOURCE_DATE_EPOCH=$(git -c safe.directory='*' -C "$sources" log -1 --format=%ct)
export SOURCE_DATE_EPOCH
for run in first second; do "$sources/packaging/deb" --build "$build" --out "$out/$run"; done
diff -r "$out/first" "$out/second" || fail "two runs give other bytes"
echo "two runs: the same bytes"
lintian --allow-root --fail-on error "$out"/first/*.deb || fail "lintian"
private "$0" "$sources" "$out/first" "$mirror"
