#!/bin/sh
# tests/interop/meshes.sh NPM_FOLDER PYTHON DESCRIBE_MESH [FOLDER]: fetches the bunny of an npm package, which is in the
# public domain, and runs meshes.py. Without npm the bunny is left out.
here=$(dirname "$0")
skip() {
    echo "without the bunny: $1"
    exit 77
}
. "$here/npm_file.sh"
sum=4c428649f2cabf3c11a0225f58367c503d181b7e2a59223a610c88a5308412b3
(npm_file bunny@1.0.1 index.js "$sum" "$1/bunny.js") || [ $? = 77 ] || exit 1
exec "$2" "$here/meshes.py" "$3" "$1" ${4+"$4"}
