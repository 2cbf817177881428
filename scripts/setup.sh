# Sourced by demo.sh and test.sh (POSIX sh). setup() checks for cargo, a C linker and a Vulkan driver; on Linux with apt it installs
# the linker and the driver if they are missing. It prints each thing that it installs.

say() { printf '%s\n' "camsim: $*" >&2; }

# Runs a command as root, directly or through sudo. Fails if neither is possible.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null 2>&1 && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
        sudo "$@"
    else
        return 1
    fi
}

# cargo, which asks rustc about its target with /dev/null for a program. A tool that ran as root may have put a file in its place, and
# what other programs have thrown away would be read as Rust; the device is made again, or the file emptied.
cargo() {
    if [ -e /dev/null ] && ! [ -c /dev/null ]; then
        say "/dev/null is a file, not a device: mending it"
        if mknod -m 666 /dev/null.new c 1 3; then mv -f /dev/null.new /dev/null; else : >/dev/null; fi
    fi
    command cargo "$@"
}

# apt_install REASON PACKAGE...
apt_install() {
    reason=$1
    shift
    if ! command -v apt-get >/dev/null 2>&1; then
        say "$reason, and this system has no apt. Debian's names for what is missing: $*"
        return 1
    fi
    say "$reason: installing $* with apt"
    # One broken third-party source makes the update fail, but rarely the packages needed here.
    as_root apt-get update -q >&2 || true
    if as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@" >&2; then
        return 0
    fi
    say "could not install them. As root: apt-get update && apt-get install $*"
    return 1
}

has_vulkan_loader() {
    { ldconfig -p || /sbin/ldconfig -p; } 2>/dev/null | grep -q 'libvulkan\.so\.1' && return 0
    for dir in /usr/lib /usr/lib64 /usr/local/lib /usr/lib/*-linux-gnu /run/opengl-driver/lib; do
        [ -e "$dir/libvulkan.so.1" ] && return 0
    done
    return 1
}

# Mesa installs the driver manifests of every GPU at once, and a container may have them without a GPU.
# So a manifest counts if it belongs to the software driver, or if the machine has a GPU device.
has_vulkan_driver() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}${VK_ADD_DRIVER_FILES:-}" ] && return 0
    gpu=no
    for device in /dev/dri/renderD* /dev/nvidia0 /dev/dxg /dev/kgsl-3d0; do
        [ -e "$device" ] && gpu=yes
    done
    for dir in /usr/share /usr/local/share /etc /usr/local/etc /run/opengl-driver/share "${XDG_DATA_HOME:-${HOME:-/root}/.local/share}"; do
        for manifest in "$dir"/vulkan/icd.d/*.json; do
            [ -e "$manifest" ] || continue
            [ "$gpu" = yes ] && return 0
            case $manifest in */lvp_icd*) return 0 ;; esac
        done
    done
    return 1
}

setup_vulkan() {
    has_vulkan_loader && has_vulkan_driver && return 0
    apt_install "no Vulkan adapter found" libvulkan1 mesa-vulkan-drivers && return 0
    say "going on without: camsim will say so if it finds no adapter either (Fedora: vulkan-loader mesa-vulkan-drivers;"
    say "Arch: vulkan-icd-loader vulkan-swrast; Alpine: vulkan-loader mesa-vulkan-swrast)"
}

setup_linker() {
    command -v cc >/dev/null 2>&1 && return 0
    apt_install "no C linker (cc), which Rust needs" gcc libc6-dev || exit 2
}

has_cargo() { (unset -f cargo && command -v cargo >/dev/null 2>&1); }

setup_cargo() {
    if ! has_cargo && [ -x "${CARGO_HOME:-${HOME:-/root}/.cargo}/bin/cargo" ]; then
        PATH="${CARGO_HOME:-${HOME:-/root}/.cargo}/bin:$PATH"
        export PATH
    fi
    if ! has_cargo; then
        say "no cargo. Get Rust from https://rustup.rs and run this again in a new shell:"
        say "  curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
        exit 2
    fi
}

setup() {
    case $(uname -s) in
    Linux)
        setup_cargo
        setup_linker
        setup_vulkan
        ;;
    Darwin)
        setup_cargo
        # Metal is part of macOS; only the command line tools can be missing.
        xcode-select -p >/dev/null 2>&1 || {
            say "no C linker. Install Apple's command line tools and run this again: xcode-select --install"
            exit 2
        }
        ;;
    MINGW* | MSYS* | CYGWIN*)
        setup_cargo
        say "on Windows this script installs nothing: DirectX 12 is there, and rustup has asked for the linker already"
        ;;
    *)
        setup_cargo
        say "unknown system $(uname -s): installing nothing, trying as it is"
        ;;
    esac
}
