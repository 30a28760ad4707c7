#!/usr/bin/env bash
# A minimal Debian of its own, for the tests of the packages: root.sh
#
# Prints the path of its root. It has systemd, udev and D-Bus, and what hapticd depends on, so that nothing is fetched when a package is
# installed on it: its apt has no source. It is of the release that this machine has, whose libraries the programs were linked with, and
# from the mirror that this machine's apt uses. It is made once and kept in /var/tmp. Ends with 77 where it cannot be made.
set -euo pipefail
cache=/var/tmp/hapticd-debian
skip() {
    echo "SKIPPED: $1" >&2
    exit 77
}

[ "$(id -u)" = 0 ] || skip 'a Debian root is made by root'
command -v mmdebstrap >/dev/null || skip 'mmdebstrap is missing (Debian: apt install mmdebstrap)'
release=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
# shellcheck disable=SC2016 # apt's own variables
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' "Codename: $release" 2>/dev/null | head -1)

mkdir -p -m 700 "$cache"
# The folder's name is known to everybody.
[ ! -L "$cache" ] && [ -O "$cache" ] || skip "$cache belongs to somebody else"
exec 9>"$cache/lock"
flock 9
# shellcheck disable=SC2016 # mmdebstrap gives the path
how=(--mode=root --format=directory --variant=minbase --include=systemd-sysv,udev,dbus,init-system-helpers
    --customize-hook='echo debian >"$1/etc/hostname"'
    --customize-hook='rm -rf "$1"/etc/resolv.conf "$1"/etc/apt/sources.list*')
if [ "$(cat "$cache/made" 2>/dev/null)" != "$release ${how[*]}" ]; then
    rm -rf "$cache/made" "$cache/root" "$cache/making"
    # Without a mirror it takes Debian's own.
    timeout 600 mmdebstrap --quiet "${how[@]}" "$release" "$cache/making" ${mirror:+"$mirror"} >"$cache/log" 2>&1 ||
        skip "a Debian root could not be made: $(tail -1 "$cache/log")"
    mv "$cache/making" "$cache/root"
    echo "$release ${how[*]}" >"$cache/made"
fi
echo "$cache/root"
