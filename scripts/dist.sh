#!/bin/sh
# Makes the packages of a release in dist/ and tries each one where this machine can:
#   sh scripts/dist.sh [PART...]     default: all parts
#   linux-x86_64, linux-aarch64      a tarball and a .deb for glibc 2.28 or newer, linked by zig
#   wheel-x86_64, wheel-aarch64      a Python wheel for glibc 2.28 or newer
#   windows                          a zip for x86-64, by mingw-w64; started under wine
#   macos                            the code is checked for both processors; nothing is made
#   publish                          the crates, as a registry would get them, built from their packages; nothing is uploaded
#   install                          `cargo install --path .`
#   chroot                           the .deb and the wheel in a fresh Debian without Rust, timed up to the first picture; needs root
# What this machine cannot do is said and skipped. The exit status is 1 if a part failed. Everything in Python that is needed is put
# into an environment under target/; mingw-w64, wine, qemu and debootstrap come from apt.
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

all="linux-x86_64 linux-aarch64 wheel-x86_64 wheel-aarch64 windows macos publish install chroot"
repository=$PWD
dist=$repository/dist
target=${CARGO_TARGET_DIR:-$repository/target}
venv=$target/dist-venv
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)

# Ends a part that this machine cannot make. 77 says so to main().
skip() {
    say "SKIPPED $part: $*"
    exit 77
}

fail() {
    say "FAILED $part: $*"
    exit 1
}

# The triple of Rust for a processor's Linux, and Debian's name of the processor.
linux_triple() { echo "$1-unknown-linux-gnu"; }
debian_name() { case $1 in x86_64) echo amd64 ;; aarch64) echo arm64 ;; esac; }

need_target() {
    rustc --print target-libdir --target "$1" 2>/dev/null | xargs ls >/dev/null 2>&1 && return 0
    command -v rustup >/dev/null 2>&1 && rustup target add "$1" >&2 && return 0
    skip "no standard library of Rust for $1 (rustup target add $1)"
}

# The environment with zig, which brings the C library of every age and processor.
need_venv() {
    if ! [ -x "$venv/bin/maturin" ]; then
        "${PYTHON:-python3}" -m venv "$venv" && "$venv/bin/pip" install -q cargo-zigbuild ziglang "maturin>=1.16,<2" ||
            skip "cannot install cargo-zigbuild, ziglang and maturin into $venv"
    fi
    PATH=$venv/bin:$PATH
    export PATH
}

# need_command COMMAND PACKAGE...: installs the packages if the command is missing.
need_command() {
    command=$1
    shift
    command -v "$command" >/dev/null 2>&1 || apt_install "no $command" "$@"
}

# The newest glibc that a file asks for must be old enough.
check_glibc() {
    newest=$(readelf -V "$1" | grep -o 'GLIBC_2\.[0-9]*' | sort -uV | tail -1)
    say "$1 needs $newest"
    [ "$(printf '%s\n' "$newest" GLIBC_2.28 | sort -V | tail -1)" = GLIBC_2.28 ] || fail "$newest is newer than GLIBC_2.28"
}

# An empty working folder, removed at the end of the part.
enter_empty_folder() {
    empty=$(mktemp -d)
    trap 'rm -rf "$empty"' EXIT
    cd "$empty"
}

# tiny_render PROGRAM...: the version and one small frame of the demo, whose scene is all that the folder gets.
tiny_render() {
    "$@" --version
    cp "$repository"/assets/* .
    begin=$(date +%s)
    "$@" -q render demo.toml -o frames --frames 7 --format png --backend cpu --set 'camera.size_px=[64,48]' \
        --set 'camera.focal_px=[42,42]' --set 'camera.principal_point_px=[31.5,23.5]'
    [ -s frames/color/frame_000007.png ] || fail "no picture"
    say "$part: a frame of 64x48 px in $(($(date +%s) - begin)) s"
}

# The folder that tarball and zip hold. Manual pages and completions are made by PROGRAM, a build of this machine's own kind.
#   stage FOLDER BINARY TRIPLE PROGRAM
stage() {
    rm -rf "$1"
    mkdir -p "$1/completions"
    cp "$2" README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$1"
    "$4" -q man "$1/man/man1"
    for shell in bash zsh fish elvish powershell; do
        "$4" completions $shell > "$1/completions/camsim.$shell"
    done
    "${PYTHON:-python3}" scripts/dist/licences.py "$3" camsim "$1/LICENCES-OF-DEPENDENCIES.txt" >&2
}

# A program that runs here and writes the same pages: that of the x86-64 part, or a build of this machine's.
native_program() {
    native=$target/$(linux_triple "$(uname -m)")/dist/camsim
    [ -x "$native" ] || cargo build --profile dist --locked --target "$(linux_triple "$(uname -m)")" >&2
    echo "$native"
}

make_linux() {
    processor=$1
    triple=$(linux_triple "$processor")
    [ "$(uname -s)" = Linux ] || skip "made on Linux"
    need_venv
    need_target "$triple"
    cargo zigbuild --profile dist --locked --target "$triple.2.28"
    check_glibc "$target/$triple/dist/camsim"
    name=camsim-$version-linux-$processor
    stage "$target/packages/$name" "$target/$triple/dist/camsim" "$triple" "$(native_program)"
    tar -C "$target/packages" --owner=0 --group=0 --sort=name -czf "$dist/$name.tar.gz" "$name"
    make_deb "$target/packages/$name" "$(debian_name "$processor")"
    try_tarball "$dist/$name.tar.gz" "$processor"
}

# make_deb FOLDER ARCHITECTURE. The program opens Vulkan and the window's libraries itself, if they are there.
make_deb() {
    command -v dpkg-deb >/dev/null 2>&1 || {
        say "no dpkg-deb: no .deb"
        return 0
    }
    root=$target/packages/deb-$2
    rm -rf "$root"
    mkdir -p "$root/DEBIAN" "$root/usr/bin" "$root/usr/share/man" "$root/usr/share/doc/camsim" \
        "$root/usr/share/bash-completion/completions" "$root/usr/share/zsh/vendor-completions" "$root/usr/share/fish/vendor_completions.d"
    cp "$1/camsim" "$root/usr/bin"
    cp -r "$1/man/man1" "$root/usr/share/man"
    gzip -9n "$root"/usr/share/man/man1/*
    cp "$1"/*.md "$1"/LICENCES* "$root/usr/share/doc/camsim"
    cat "$1"/LICENSE-MIT "$1"/LICENSE-APACHE > "$root/usr/share/doc/camsim/copyright"
    cp "$1/completions/camsim.bash" "$root/usr/share/bash-completion/completions/camsim"
    cp "$1/completions/camsim.zsh" "$root/usr/share/zsh/vendor-completions/_camsim"
    cp "$1/completions/camsim.fish" "$root/usr/share/fish/vendor_completions.d/camsim.fish"
    deb_control "$2" "$(du -sk "$root/usr" | cut -f1)" > "$root/DEBIAN/control"
    chmod -R go=rX,u+w "$root"
    dpkg-deb --root-owner-group -Zxz --build "$root" "$dist/camsim_${version}_$2.deb" >&2
}

deb_control() {
    cat <<CONTROL
Package: camsim
Version: $version
Architecture: $1
Installed-Size: $2
Maintainer: The camsim contributors
Section: science
Priority: optional
Depends: libc6 (>= 2.28)
Recommends: libvulkan1, mesa-vulkan-drivers | vulkan-icd
Suggests: libwayland-client0, libx11-6, libx11-xcb1, libxcursor1, libxi6, libxkbcommon0, libxkbcommon-x11-0, xdg-desktop-portal
Description: pictures of a real, imperfect airborne camera
 camsim turns a flight log and a scene into the frames that real, imperfect
 airborne cameras would have taken, with the truth about every pixel: depth,
 normal, object, optical flow, pose and time.
 .
 It renders without a graphics adapter too. The packages that are suggested
 are for its window.
CONTROL
}

# try_tarball FILE PROCESSOR: unpacked in an empty folder.
try_tarball() {
    enter_empty_folder
    tar -xzf "$1" --strip-components 1
    ls man/man1/camsim-render.1 completions/camsim.bash LICENCES-OF-DEPENDENCIES.txt >/dev/null
    if [ "$2" = "$(uname -m)" ]; then
        tiny_render ./camsim
    elif need_emulator "$2"; then
        tiny_render "qemu-$2-static" -L "/usr/$2-linux-gnu" ./camsim
    else
        say "NOT STARTED: $1, there is no emulator of $2"
    fi
}

# qemu, and the C library that programs of the processor load.
need_emulator() {
    [ -e "/usr/$1-linux-gnu/lib/libc.so.6" ] && command -v "qemu-$1-static" >/dev/null 2>&1 && return 0
    apt_install "no emulator of $1" qemu-user-static "libc6-$(debian_name "$1")-cross"
}

# The wheel has the program without its window, as the module needs it.
make_wheel() {
    [ "$(uname -s)" = Linux ] || skip "made on Linux"
    need_venv
    triple=$(linux_triple "$1")
    need_target "$triple"
    licences=python/camsim/LICENCES-OF-DEPENDENCIES.txt
    trap 'rm -f "$licences"' EXIT
    "${PYTHON:-python3}" scripts/dist/licences.py "$triple" camsim-python "$licences" >&2
    maturin build --profile dist --locked --out "$dist" --zig --compatibility manylinux_2_28 --target "$triple"
    wheel=$(ls "$dist"/camsim-"$version"-*manylinux*_"$1".whl)
    if [ "$1" = "$(uname -m)" ]; then
        CAMSIM_FIRST_FRAME=$target/first-frame.png sh scripts/wheel-test.sh "$wheel"
    else
        say "NOT STARTED: $wheel, this is no $1"
    fi
}

make_windows() {
    triple=x86_64-pc-windows-gnu
    need_command x86_64-w64-mingw32-gcc gcc-mingw-w64-x86-64 || skip "no mingw-w64"
    need_target $triple
    cargo build --profile dist --locked --target $triple
    name=camsim-$version-windows-x86_64
    stage "$target/packages/$name" "$target/$triple/dist/camsim.exe" $triple "$(native_program)"
    # Manual pages are for systems with `man`.
    rm -r "$target/packages/$name/man"
    "${PYTHON:-python3}" -m zipfile -c "$dist/$name.zip" "$target/packages/$name"
    try_zip "$dist/$name.zip"
}

try_zip() {
    need_command wine wine wine64 || {
        say "NOT STARTED: $1, there is no wine"
        return 0
    }
    enter_empty_folder
    "${PYTHON:-python3}" -m zipfile -e "$1" .
    # Its own settings and registry, and no windows that ask for more components.
    export WINEPREFIX="$empty/wine" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml="
    # Wine before 9 lacks a library of Windows 10 that programs of Rust load.
    if [ "$(wine --version | sed 's/^wine-\([0-9]*\).*/\1/')" -lt 9 ]; then
        x86_64-w64-mingw32-gcc -shared -o bcryptprimitives.dll "$repository/scripts/dist/bcryptprimitives.c" -ladvapi32
    fi
    mv camsim-*/camsim.exe .
    tiny_render wine camsim.exe
    wineserver -k 2>/dev/null || true
}

make_macos() {
    for triple in x86_64-apple-darwin aarch64-apple-darwin; do
        need_target $triple
        cargo check --locked --target $triple
        say "$triple: the code is checked; no program is linked or started"
    done
}

# Every crate in the order of its dependencies; cargo builds each from its package alone, all in all most crates three times.
make_publish() {
    CARGO_PROFILE_DEV_DEBUG=0 cargo publish --workspace --dry-run --locked
}

# With the profile and target of the other parts, so that little is built again.
make_install() {
    root=$target/packages/install
    cargo install --path . --locked --force --root "$root" --profile dist --target "$(linux_triple "$(uname -m)")"
    enter_empty_folder
    tiny_render "$root/bin/camsim"
}

sums() { (cd "$dist" && rm -f SHA256SUMS && sha256sum camsim* > SHA256SUMS && cat SHA256SUMS); }

run_part() {
    case $1 in
    linux-x86_64 | linux-aarch64) make_linux "${1#linux-}" ;;
    wheel-x86_64 | wheel-aarch64) make_wheel "${1#wheel-}" ;;
    chroot)
        . scripts/dist/chroot.sh
        try_chroot
        ;;
    windows | macos | publish | install) "make_$1" ;;
    *)
        say "unknown part $1; there are: $all"
        exit 2
        ;;
    esac
}

# A part has a shell of its own: `set -e` does not hold in a function whose status is looked at.
if [ "${1:-}" = --part ]; then
    part=$2
    setup_cargo
    mkdir -p "$dist"
    run_part "$part"
    exit 0
fi

failed=
skipped=
made=
for part in ${*:-$all}; do
    say "$part"
    status=0
    sh scripts/dist.sh --part "$part" || status=$?
    case $status in
    0) made="$made $part" ;;
    77) skipped="$skipped $part" ;;
    *) failed="$failed $part" ;;
    esac
done
ls "$dist"/camsim* >/dev/null 2>&1 && sums
say "made:${made:- nothing}; skipped:${skipped:- nothing}; failed:${failed:- nothing}"
[ -z "$failed" ]
