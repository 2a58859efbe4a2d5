#!/bin/sh
# tests/interop/meshes.sh NPM_FOLDER PYTHON DESCRIBE_MESH [FOLDER]: fetches the bunny of an npm package, which is in the
# public domain, and runs meshes.py. Without npm the bunny is left out. Where PYTHON lacks trimesh or pygltflib, pip
# fetches them once into an environment beside NPM_FOLDER. Exit status 77: skipped, with the reason.
here=$(dirname "$0")
skip() {
    echo "$1"
    exit 77
}
. "$here/npm_file.sh"
sum=4c428649f2cabf3c11a0225f58367c503d181b7e2a59223a610c88a5308412b3
(npm_file bunny@1.0.1 index.js "$sum" "$1/bunny.js") || [ $? = 77 ] || exit 1
python=$2
if ! "$python" -c "import trimesh, pygltflib" 2>/dev/null; then
    environment=$(dirname "$1")/meshes_environment
    python=$environment/bin/python3
    if [ ! -e "$environment/ready" ]; then
        log=$environment.log
        "$2" -m venv --clear --system-site-packages "$environment" >"$log" 2>&1 ||
            skip "skipped: no virtual environments; apt-get install python3-venv: $(tail -n 1 "$log")"
        "$python" -m pip install --quiet --only-binary=:all: trimesh==4.12.2 pygltflib==1.16.5 >"$log" 2>&1 ||
            skip "skipped: pip could not fetch trimesh and pygltflib: $(tail -n 1 "$log")"
        touch "$environment/ready"
    fi
fi
exec "$python" "$here/meshes.py" "$3" "$1" ${4+"$4"}
