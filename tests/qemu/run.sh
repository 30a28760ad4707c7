#!/usr/bin/env bash
# hapticd on a true kernel's USB: run.sh [--binaries DIR]
#
# Boots Debian's own kernel in qemu, by software, so neither /dev/kvm nor root is needed. Inside, the kernel's dummy host controller carries gadgets whose device side is a
# fake rig: a serial function (CDC-ACM) and a HID function. qemu adds a serial converter (FTDI). guest.sh is the guest's only program; it makes the checks and
# prints a line for each. Only what happens is checked, never how quickly: software emulation is slow.
#
#   --binaries DIR  hapticd, haptic-ctl and fake-rig are there; otherwise they are built
#
# Ends with 0 if every check passed, with 1 if one failed, with 77 if a program is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
cache=$target/qemu
binaries=
while [ $# -gt 0 ]; do
    case $1 in
        --binaries) binaries=$2 && shift 2 ;;
        *) echo "run.sh: there is no option $1" >&2 && exit 2 ;;
    esac
done

# What to install where a program is missing.
for needed in qemu-system-x86_64:qemu-system-x86 apt-get:apt cpio:cpio modprobe:kmod dpkg-deb:dpkg; do
    if ! PATH=$PATH:/usr/sbin:/sbin command -v "${needed%%:*}" >/dev/null; then
        echo "SKIPPED: ${needed%%:*} is missing (Debian: apt install ${needed##*:})"
        exit 77
    fi
done
PATH=$PATH:/usr/sbin:/sbin

if [ -z "$binaries" ]; then
    (cd "$root" && cargo build --quiet --locked -p hapticd -p haptic-ctl -p device-io --bins)
    binaries=$target/debug
fi

mkdir -p "$cache"
# One run at a time: the second waits for what the first has made.
exec 9>"$cache/lock"
flock 9

. "$here/kernel.sh"

# The guest's files: those, our programs, and the libraries that they were linked with.
image() {
    local stage=$cache/stage made
    rm -rf "$stage"
    mkdir -p "$stage"/{bin,dev,etc,proc,sys,tmp,run}
    cp -r "$kernel/modules" "$stage/modules"
    cp "$kernel/busybox" "$stage/bin/busybox"
    cp "$here/guest.sh" "$stage/init"
    cp "$here/rig.sh" "$stage/"
    chmod 755 "$stage/init"
    for made in hapticd haptic-ctl fake-rig; do
        cp "$binaries/$made" "$stage/bin/"
        ldd "$binaries/$made" | grep -o '/[^ ]*' | while read -r library; do
            mkdir -p "$stage$(dirname "$library")"
            cp -nL "$library" "$stage$library"
        done
    done
    strip --strip-debug "$stage"/bin/{hapticd,haptic-ctl,fake-rig} 2>/dev/null || true
    printf 'root:x:0:0:root:/:/bin/sh\nnobody:x:65534:65534:nobody:/:/bin/sh\n' >"$stage/etc/passwd"
    printf 'root:x:0:\ndialout:x:20:\nnobody:x:65534:\n' >"$stage/etc/group"
    (cd "$stage" && find . | cpio --quiet -o -H newc -R 0:0) >"$cache/initrd"
}

fetch_kernel
image

# The converter's bytes go to the fake rig inside the guest through a port of the guest's own: qemu connects the two.
sockets=$(mktemp -d)
trap 'rm -rf "$sockets"' EXIT
began=$SECONDS
# With -icount the guest's clock counts its instructions, so that a busy machine makes it slow but not late: a device's watchdog bites only where the programs are at fault.
timeout --kill-after=5 330 qemu-system-x86_64 \
    -machine q35 -accel tcg -icount shift=1,sleep=off -cpu max -smp 1 -m 512 -nodefaults -no-user-config -display none -no-reboot \
    -kernel "$kernel/vmlinuz" -initrd "$cache/initrd" -append 'console=ttyS0 quiet panic=-1 mitigations=off' \
    -serial stdio -monitor none \
    -device qemu-xhci,id=xhci \
    -chardev "socket,id=converter,path=$sockets/line,server=on,wait=off" -device usb-serial,chardev=converter,bus=xhci.0 \
    -device virtio-serial-pci -chardev "socket,id=rig,path=$sockets/line,reconnect=1" -device virtserialport,chardev=rig,name=rig \
    </dev/null 2>&1 | sed --unbuffered 's/\r//' | tee "$cache/log" | grep --line-buffered -E '^(PASS|FAIL|NOTE) ' || true
took=$((SECONDS - began))

passed=$(grep -c '^PASS ' "$cache/log" || true)
failed=$(grep -c '^FAIL ' "$cache/log" || true)
ended=$(grep -c '^END' "$cache/log" || true)
if [ "$ended" = 0 ]; then
    echo "FAIL the guest did not come to its end; its last lines:"
    tail -20 "$cache/log"
    failed=$((failed + 1))
fi
echo "SUMMARY $passed passed, $failed failed, $took s in qemu of $SECONDS s in all"

[ "$failed" = 0 ]
