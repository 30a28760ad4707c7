#!/bin/sh
# Makes what a Debian package installs and the programs know themselves: manual pages, completions, the JSON schema of
# the control protocol. `cargo deb --no-build` finds it beside the programs.
#
# Usage: packaging/generate.sh PACKAGE DIR, where PACKAGE is hapticd or haptic-gui and DIR has the built programs, as
# target/release has.
set -eu

# Turns links that lead from pages so far below docs/ out of it, which would lead nowhere, into words.
name_the_source() {
    below=$1
    shift
    sed -zEi "s|\[([^]]*)\]\($below\.\./([^)#]*)[^)]*\)|\1 (\2 of the source)|g" "$@"
}

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
        cp -r "$(dirname "$0")/../docs" "$made/docs"
        name_the_source '' "$made"/docs/*.md
        name_the_source '\.\./' "$made"/docs/*/*.md
        ;;
    haptic-gui)
        "$programs/haptic-gui" --manual-page >"$made/haptic-gui.1"
        gzip --best --no-name --keep "$made/haptic-gui.1"
        ;;
    *) echo "generate.sh: unknown package $package: it is hapticd or haptic-gui" >&2 && exit 2 ;;
esac
