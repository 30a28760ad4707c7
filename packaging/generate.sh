#!/bin/sh
# Makes what a Debian package installs and the programs know themselves: manual pages, completions, the JSON schema of
# the control protocol. `cargo deb --no-build` finds it beside the programs.
#
# Usage: packaging/generate.sh PACKAGE DIR, where PACKAGE is hapticd or haptic-gui and DIR has the built programs, as
# target/release has.
set -eu
package=$1 programs=$2
made=$programs/packaged/$package
rm -rf "$made"
mkdir -p "$made"
case $package in
    hapticd)
        "$programs/haptic-ctl" --quiet man "$made/man"
        "$programs/hapticd" --manual-page >"$made/man/hapticd.8"
        "$programs/haptic-ctl" raw --schema >"$made/control-protocol.schema.json"
        for shell in bash fish zsh; do
            "$programs/haptic-ctl" completions $shell >"$made/completions.$shell"
        done
        gzip --best --no-name --keep "$made"/man/*
        ;;
    haptic-gui)
        "$programs/haptic-gui" --manual-page >"$made/haptic-gui.1"
        gzip --best --no-name --keep "$made/haptic-gui.1"
        ;;
    *) echo "generate.sh: unknown package $package: it is hapticd or haptic-gui" >&2 && exit 2 ;;
esac
