# The kernel of the virtual machines, for bash: `fetch_kernel` leaves it in $cache. Its caller ends with 77 where it cannot be fetched.

# Modules of the guest, with what they need in turn.
modules='dummy_hcd libcomposite usb_f_acm usb_f_hid cdc_acm ftdi_sio usbhid hid_generic xhci_pci virtio_pci virtio_console configfs'

# The kernel with its modules, and busybox, from Debian: kept until Debian has a newer kernel.
fetch_kernel() {
    local package version made
    package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
    if [ -z "$package" ]; then
        echo 'SKIPPED: apt knows no linux-image-amd64 (apt-get update on an amd64 Debian)'
        exit 77
    fi
    if [ "$(cat "$cache/base.version" 2>/dev/null)" = "$package $modules" ]; then return; fi
    rm -rf "$cache/deb" "$cache/base" "$cache/base.version"
    mkdir -p "$cache/deb" "$cache/base"
    if ! (cd "$cache/deb" && timeout 120 apt-get download -qq "$package" busybox-static 2>"$cache/deb/log"); then
        echo "SKIPPED: $package could not be fetched: $(tail -1 "$cache/deb/log")"
        exit 77
    fi
    for made in "$cache"/deb/*.deb; do dpkg-deb -x "$made" "$cache/deb/root"; done
    version=$(ls "$cache/deb/root/lib/modules")
    depmod -b "$cache/deb/root" "$version"
    cp "$cache/deb/root/boot/vmlinuz-$version" "$cache/vmlinuz"
    cp "$cache/deb/root/bin/busybox" "$cache/base/busybox"
    mkdir "$cache/base/modules"
    # In the order in which they can be inserted; what is built in is left out.
    for made in $modules; do
        # Builtin lines and options are of no use here.
        modprobe -d "$cache/deb/root" -S "$version" --show-depends "$made" | sed -n 's/^insmod \([^ ]*\).*/\1/p'
    done | awk '!seen[$0]++' | while read -r made; do
        cp "$made" "$cache/base/modules/"
        basename "$made" >>"$cache/base/modules/order"
    done
    # Newer kernels' modules are packed.
    find "$cache/base/modules" -name '*.xz' -exec xz -d {} +
    sed -i 's/\.xz$//' "$cache/base/modules/order"
    echo "$version" >"$cache/kernel"
    rm -rf "$cache/deb"
    echo "$package $modules" >"$cache/base.version"
}
