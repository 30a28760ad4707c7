#!/usr/bin/env bash
# From a real surface to its rendering, and how far they are apart: 1 kg of aluminium on Teflon, which slides at 2 N.
#
#     examples/aluminium-on-teflon.sh [DIRECTORY]
#
# The real surface is simulated, by a solver that hapticd does not render with; with records of your own, leave out
# the first step. Everything goes into DIRECTORY: real.csv and hand.csv, identified.json, scene.toml, rendered.mcap,
# compare.json, and the plots identified.html, compare.html and compare.svg. It takes half a minute.
#
# HAPTICD_BIN is the directory of the programs [default: built here, optimised]; HAPTICD_OPTIONS are further options
# of the daemon.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=$(realpath -m "${1:-aluminium-on-teflon}")
if [ -z "${HAPTICD_BIN:-}" ]; then
    cargo build --quiet --release --bin hapticd --bin haptic-ctl --bin fake-rig
    HAPTICD_BIN=target/release
fi
socket=$(mktemp -d)
ctl() { "$HAPTICD_BIN/haptic-ctl" --socket "$socket/control.sock" "$@"; }
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$socket"' EXIT
mkdir -p "$out"

echo "1. A lab records the real surface: a force sensor with 0.1 N of noise, an encoder of 10 um"
ctl surface scenes/aluminium-on-teflon.toml --mass 1 --out "$out/real.csv" --hand "$out/hand.csv" --force

echo "2. Its mass and friction are identified"
ctl identify "$out/real.csv" --model karnopp --out "$out/scene.toml" --plot "$out/identified.html" --force
ctl identify "$out/real.csv" --model karnopp --json >"$out/identified.json"

echo "3. hapticd renders them to a hand that repeats the motion, and every tick is recorded"
"$HAPTICD_BIN/fake-rig" --pty "$socket/rig" --hand "$out/hand.csv" >/dev/null &
until [ -e "$socket/rig" ]; do sleep 0.02; done
# shellcheck disable=SC2086 # several options
"$HAPTICD_BIN/hapticd" --device "serial:$socket/rig" --uncommissioned --scene "$out/scene.toml" \
    --socket "$socket/control.sock" --scene-dir "$socket" --state-dir "$socket" ${HAPTICD_OPTIONS:-} 2>"$out/hapticd.log" &
daemon=$!
until [ -S "$socket/control.sock" ]; do
    kill -0 "$daemon" || { cat "$out/hapticd.log" >&2; exit 1; }
    sleep 0.02
done
# The lab's hand held the mass by a sensor of 5 N/mm; the motion begins with a rest of 2 s.
ctl set K=5N/mm B=30Ns/m >/dev/null
# Nobody has identified this rig, and its hand holds whatever comes.
ctl engage --wait --anyway >/dev/null
ctl record "$out/rendered.mcap" --force --for 25s

echo "4. The rendered surface is compared with the real one"
ctl compare "$out/real.csv" "$out/rendered.mcap" --plot "$out/compare.html"
ctl compare "$out/real.csv" "$out/rendered.mcap" --plot "$out/compare.svg" --json >"$out/compare.json"
