# Sourced by scripts/dist.sh: the .deb and the wheel in a Debian that has neither Rust nor a compiler, each timed up to the first
# picture.

try_chroot() {
    [ "$(id -u)" = 0 ] || skip "debootstrap needs root"
    need_command debootstrap debootstrap || skip "no debootstrap"
    architecture=$(debian_name "$(uname -m)")
    deb=$dist/camsim_${version}_$architecture.deb
    wheel=$(ls "$dist"/camsim-"$version"-*manylinux*_"$(uname -m)".whl 2>/dev/null || true)
    [ -s "$deb" ] && [ -s "$wheel" ] || fail "make linux-$(uname -m) and wheel-$(uname -m) first"
    enter_empty_folder
    debootstrap --variant=minbase --include=python3-venv "${DEBIAN:-bookworm}" "$empty/root" "${MIRROR:-http://deb.debian.org/debian}" \
        >"$target/debootstrap.log" 2>&1 || skip "debootstrap failed here, see $target/debootstrap.log"
    mkdir "$empty/root/packages"
    cp "$deb" "$wheel" "$empty/root/packages"
    # numpy comes along: the folder has no network.
    "${PYTHON:-python3}" -m pip download -q --only-binary :all: -d "$empty/root/packages" \
        --python-version "$(in_root python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')" "numpy>=1.23"
    try_deb
    try_wheel
}

# A command in the new system, with none of the caller's variables.
in_root() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 chroot "$empty/root" "$@"; }

try_deb() {
    begin=$(date +%s)
    in_root apt-get install -q -y --no-install-recommends "/packages/${deb##*/}" >&2
    in_root camsim -q demo -o /root/demo
    [ -s "$empty/root/root/demo/contact-sheet.png" ] || fail "no picture of the .deb's program"
    say "chroot: .deb installed and the built-in flight rendered in $(($(date +%s) - begin)) s"
    in_root camsim --version
    in_root dpkg --verify camsim
}

try_wheel() {
    begin=$(date +%s)
    in_root sh -euc 'python3 -m venv /root/fresh
        /root/fresh/bin/pip install -q --no-index --find-links /packages camsim
        /root/fresh/bin/python -c "import camsim; camsim.Scenario.demo()[7].save(\"/root/first.png\")"'
    [ -s "$empty/root/root/first.png" ] || fail "no picture of the wheel"
    say "chroot: wheel installed and a first picture saved in $(($(date +%s) - begin)) s"
}
