#!/usr/bin/env bash
# The package on a booted Debian: boot.sh --package FILE --fake-rig FILE
#
# Boots the root of root.sh with Debian's own kernel in qemu, by software, so that /dev/kvm is not needed. There systemd, udev, USB and sleep are real.
# guest.sh makes the checks; a line for each is printed. With -icount the machine's clock counts its instructions: a busy
# host makes it slow, but not late.
#
# Ends with 0 if every check passed, with 1 if one failed, with 77 if something is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
PATH=$PATH:/usr/sbin:/sbin
package=
fake_rig=
while [ $# -gt 0 ]; do
    case $1 in
        --package) package=$2 && shift 2 ;;
        --fake-rig) fake_rig=$2 && shift 2 ;;
        *) echo "boot.sh: there is no option $1" >&2 && exit 2 ;;
    esac
done
for needed in qemu-system-x86_64:qemu-system-x86 apt-get:apt cpio:cpio modprobe:kmod dpkg-deb:dpkg socat:socat; do
    if ! command -v "${needed%%:*}" >/dev/null; then
        echo "SKIPPED: ${needed%%:*} is missing (Debian: apt install ${needed##*:})"
        exit 77
    fi
done
# What is missing is skipped, and what fails has failed.
root=$("$here/root.sh" 2>&1) || { ended=$? && echo "$root" && exit $ended; }
cache=$(dirname "$root")
# One at a time.
exec 9>"$cache/boot.lock"
flock 9
# shellcheck source=tests/qemu/kernel.sh
. "$here/../qemu/kernel.sh"
fetch_kernel

stage=$(mktemp -d "$cache/stage.XXXXXX")
wakes=
trap 'kill $wakes 2>/dev/null || true; rm -rf "$stage"' EXIT
mkdir -p "$stage"/{proof,etc/systemd/system,usr/local/bin}
cp "$here/guest.sh" "$here/../qemu/rig.sh" "$stage/proof/"
cp -r "$kernel/modules" "$stage/modules"
# A minimal Debian has no insmod.
cp "$kernel/busybox" "$stage/usr/local/bin/insmod"
cp "$fake_rig" "$stage/usr/local/bin/fake-rig"
strip --strip-debug "$stage/usr/local/bin/fake-rig" 2>/dev/null || true
# What is unpacked in emulation is not compressed.
dpkg-deb --raw-extract "$package" "$stage/package"
strip --strip-debug "$stage"/package/usr/bin/* 2>/dev/null || true
dpkg-deb --root-owner-group -Znone --build "$stage/package" "$stage/proof/hapticd.deb" >/dev/null
rm -r "$stage/package"
# With an identity it is no first boot.
echo 6a70dc4a1f0e4c1c9d5d6f2f6b7a8c90 >"$stage/etc/machine-id"
cat >"$stage/etc/systemd/system/proof.service" <<'UNIT'
[Service]
ExecStart=/bin/bash /proof/guest.sh
UNIT
# What nobody needs on it takes long to unpack.
(cd "$root" && find . -xdev \( -path './usr/share/doc/*' -o -path './usr/share/man/*' -o -path './usr/share/locale/*' -o -path './usr/share/zoneinfo/*' \
    -o -path './usr/share/perl/*' -o -path './usr/lib/*/perl/*' -o -path './usr/lib/*/gconv/*' -o -path './usr/lib/udev/hwdb.d/*' \) -prune -o -print |
    cpio --quiet -o -H newc) >"$stage/initrd"
(cd "$stage" && find etc modules proof usr | cpio --quiet -o -H newc -R 0:0) >>"$stage/initrd"

# Once it sleeps, it is left to sleep for 3 s, which its own clock of the day counts, and woken.
tell() { echo "$1" | socat - "UNIX-CONNECT:$stage/monitor" 2>/dev/null; }
(
    until tell 'info status' | grep -q suspended; do sleep 0.5; done
    sleep 3
    tell system_wakeup >/dev/null
) &
wakes=$!

began=$SECONDS
timeout --kill-after=5 1500 qemu-system-x86_64 \
    -machine q35 -accel tcg -icount shift=1,sleep=off -cpu max -smp 1 -m 1536 -rtc clock=host -nodefaults -no-user-config -display none -no-reboot \
    -kernel "$kernel/vmlinuz" -initrd "$stage/initrd" \
    -append 'console=ttyS0 quiet panic=-1 mitigations=off rdinit=/lib/systemd/systemd systemd.show_status=0 systemd.unit=proof.service' \
    -serial stdio -monitor "unix:$stage/monitor,server=on,wait=off" \
    </dev/null 2>&1 | sed --unbuffered 's/\r//' | tee "$cache/boot.log" | grep --line-buffered -E '^(PASS|FAIL|NOTE) ' || true
took=$((SECONDS - began))

passed=$(grep -c '^PASS ' "$cache/boot.log" || true)
failed=$(grep -c '^FAIL ' "$cache/boot.log" || true)
if ! grep -q '^END' "$cache/boot.log"; then
    echo 'FAIL the machine did not come to its end; its last lines:'
    tail -20 "$cache/boot.log"
    failed=$((failed + 1))
fi
echo "SUMMARY $passed passed, $failed failed, $took s in qemu of $SECONDS s in all"
[ "$failed" = 0 ]
