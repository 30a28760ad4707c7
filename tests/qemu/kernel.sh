# The kernel of the virtual machines, for bash: `fetch_kernel` sets $kernel to a folder with vmlinuz, its version, modules/ and
# busybox. Its caller ends with 77 where it cannot be fetched.

# Modules of the guest, with what they need in turn.
modules='dummy_hcd libcomposite usb_f_acm usb_f_hid cdc_acm ftdi_sio usbhid hid_generic xhci_pci virtio_pci virtio_console configfs'

# The kernel with its modules, and busybox, from Debian: kept for all virtual machines until Debian has a newer kernel.
fetch_kernel() {
    local package target
    package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
    if [ -z "$package" ]; then
        echo 'SKIPPED: apt knows no linux-image-amd64 (apt-get update on an amd64 Debian)'
        exit 77
    fi
    target=${CARGO_TARGET_DIR:-$(dirname "${BASH_SOURCE[0]}")/../../target}
    kernel=$target/qemu/kernel
    mkdir -p "$target/qemu"
    # Another machine may be about it.
    exec 8>"$kernel.lock"
    flock 8
    if [ "$(cat "$kernel/made" 2>/dev/null)" != "$package $modules" ]; then unpack_kernel "$package"; fi
    exec 8>&-
}

unpack_kernel() {
    local package=$1 made version packages=$kernel/packages
    rm -rf "$kernel"
    mkdir -p "$packages" "$kernel/modules"
    if ! (cd "$packages" && timeout 120 apt-get download -qq "$package" busybox-static 2>"$packages/log"); then
        echo "SKIPPED: $package could not be fetched: $(tail -1 "$packages/log")"
        exit 77
    fi
    for made in "$packages"/*.deb; do dpkg-deb -x "$made" "$packages/root"; done
    version=$(ls "$packages/root/lib/modules")
    depmod -b "$packages/root" "$version"
    cp "$packages/root/boot/vmlinuz-$version" "$kernel/vmlinuz"
    cp "$packages/root/bin/busybox" "$kernel/busybox"
    # In the order in which they can be inserted; what is built in is left out.
    for made in $modules; do
        # Builtin lines and options are of no use here.
        modprobe -d "$packages/root" -S "$version" --show-depends "$made" | sed -n 's/^insmod \([^ ]*\).*/\1/p'
    done | awk '!seen[$0]++' | while read -r made; do
        cp "$made" "$kernel/modules/"
        basename "$made" >>"$kernel/modules/order"
    done
    # Newer kernels' modules are packed.
    find "$kernel/modules" -name '*.xz' -exec xz -d {} +
    sed -i 's/\.xz$//' "$kernel/modules/order"
    echo "$version" >"$kernel/version"
    rm -rf "$packages"
    echo "$package $modules" >"$kernel/made"
}
