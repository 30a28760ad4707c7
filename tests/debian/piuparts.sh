#!/usr/bin/env bash
# Both packages under piuparts, on the root of root.sh: piuparts.sh PACKAGE...
#
# They are installed, removed and purged, and once more from the version before; nothing may be left behind, and nothing fetched. The version
# before is the same package with a lower number. What the panel draws with is an empty package: no script of ours runs it.
#
# Ends with 0 if piuparts is content, with 1 if not, with 77 if something is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
PATH=$PATH:/usr/sbin:/sbin
if ! command -v piuparts >/dev/null; then
    echo 'SKIPPED: piuparts is missing (Debian: apt install piuparts)'
    exit 77
fi
# What is missing is skipped, and what fails has failed.
root=$("$here/root.sh" 2>&1) || { ended=$? && echo "$root" && exit $ended; }
release=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
stage=$(mktemp -d "$(dirname "$root")/piuparts.XXXXXX")
trap 'rm -rf "$stage"' EXIT
chmod 755 "$stage"
archive=$stage/archive
mkdir -p "$archive" "$stage/scripts" "$stage/drawing/DEBIAN"

# Lists a package in the archive.
list() {
    dpkg-deb --field "$1" | sed '/^$/d'
    echo "Filename: ./$(basename "$1")"
    echo "Size: $(stat --format=%s "$1")"
    echo "SHA256: $(sha256sum "$1" | cut -d ' ' -f 1)"
    echo
}
lacking=
for package in "$@"; do
    dpkg-deb --raw-extract "$package" "$stage/package"
    sed -i 's/^Version: .*/&~before/' "$stage/package/DEBIAN/control"
    dpkg-deb --root-owner-group -Znone --build "$stage/package" "$archive/before-$(basename "$package")" >/dev/null
    rm -r "$stage/package"
    for needed in $(dpkg-deb --field "$package" Depends | tr ',' '\n' | sed 's/^ *\([^ ]*\).*/\1/'); do
        dpkg-query --root="$root" --show "$needed" >/dev/null 2>&1 || lacking+="${lacking:+, }$needed"
    done
done
cat >"$stage/drawing/DEBIAN/control" <<CONTROL
Package: drawing-libraries
Version: 1
Architecture: all
Maintainer: The hapticd developers <hapticd@users.noreply.github.com>
Provides: ${lacking:-nothing}
Description: stands in for what the panel draws with
CONTROL
dpkg-deb --root-owner-group --build "$stage/drawing" "$archive/drawing.deb" >/dev/null
for package in "$archive"/*.deb; do list "$package"; done >"$archive/Packages"
printf '#!/bin/sh\necho "deb [trusted=yes] file:%s ./" >/etc/apt/sources.list\n' "$archive" >"$stage/scripts/post_chroot_unpack_archive"
chmod +x "$stage/scripts/post_chroot_unpack_archive"

began=$SECONDS
if ! piuparts --existing-chroot="$root" --distribution="$release" --keep-sources-list --bindmount="$archive" --scriptsdir="$stage/scripts" --no-eatmydata \
    --warn-on-debsums-errors --tmpdir="$stage" "$@" >"$stage/log" 2>&1; then
    grep -E ' ERROR: ' -A20 "$stage/log" | tail -60
    exit 1
fi
grep -E 'INFO: PASS' "$stage/log" | sed 's/.*INFO: PASS/PASS piuparts/'
echo "SUMMARY $((SECONDS - began)) s"
