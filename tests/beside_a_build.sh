#!/usr/bin/env bash
# Do the tests pass on a machine that is busy? Runs them some times beside a release build on the same processors, which
# begins again whenever it ends, and prints a line for each run. Fails if a run fails.
#
#   tests/beside_a_build.sh       # ten times
#   tests/beside_a_build.sh 3
set -euo pipefail
cd "$(dirname "$0")/.."
runs=${1:-10}
folder=$(mktemp -d)
cargo test --workspace --quiet --no-run

build() {
    while true; do
        CARGO_TARGET_DIR=$folder/target cargo build --release --quiet
        rm -rf "$folder/target"
        echo built >>"$folder/builds"
    done
}
set -m
build &
builder=$!
set +m
trap 'kill -- "-$builder" 2>/dev/null; wait "$builder" 2>/dev/null || true; rm -rf "$folder"' EXIT

failed=0
for run in $(seq "$runs"); do
    began=$SECONDS
    cargo test --workspace --no-fail-fast >"$folder/run" 2>&1 && how=green || how=RED
    tests=$(awk '/^test result/ { passed += $4; failed += $6 } END { printf "%d passed, %d failed", passed, failed }' "$folder/run")
    printf 'run %2d: %s, %s, %d s, load %s\n' "$run" "$how" "$tests" $((SECONDS - began)) "$(cut -d' ' -f1 /proc/loadavg)"
    if [ $how = RED ]; then
        failed=1
        grep -E '^test .* FAILED$|panicked at' -A2 "$folder/run" | tail -n 40
        cp "$folder/run" "${HAPTICD_KEEP:-target}/red-$run.log"
    fi
done
exit $failed
