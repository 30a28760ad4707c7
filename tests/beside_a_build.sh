#!/usr/bin/env bash
# Do the tests pass on a machine that is busy? Runs them some times beside a release build on the same processors, which
# begins again whenever it ends, and prints a line for each run. Fails if a run fails.
#
#   tests/beside_a_build.sh          # ten times
#   tests/beside_a_build.sh 3
#   tests/beside_a_build.sh 3 0.3    # and every three seconds nothing runs for up to 0.3 s, as where a host takes the
#                                    # processors away; the rights to a real-time priority are needed
set -euo pipefail
cd "$(dirname "$0")/.."
runs=${1:-10}
stall_s=${2:-0}
folder=$(mktemp -d)
cargo test --workspace --quiet --no-run

build() {
    while true; do
        CARGO_TARGET_DIR=$folder/target cargo build --release --quiet
        rm -rf "$folder/target"
        echo built >>"$folder/builds"
    done
}
# Above every other thread, on each processor at the same times.
stall() {
    python3 - "$stall_s" <<'END'
import os, random, sys, time

stall_s, period_s = float(sys.argv[1]), 3.0
cores = sorted(os.sched_getaffinity(0))
core = next((core for core in cores[1:] if os.fork() == 0), cores[0])
os.sched_setaffinity(0, {core})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(99))
while True:
    turn = int(time.monotonic() / period_s) + 1
    random.seed(turn)
    time.sleep(max(0.0, (turn + 0.3 * random.random()) * period_s - time.monotonic()))
    end = time.monotonic() + stall_s * random.uniform(0.3, 1.0)
    while time.monotonic() < end:
        pass
END
}
set -m
build &
besides=("$!")
if [ "$stall_s" != 0 ]; then
    stall &
    besides+=("$!")
fi
set +m
stop() {
    for beside in "${besides[@]}"; do kill -- "-$beside" 2>/dev/null || true; done
    wait "${besides[@]}" 2>/dev/null || true
    rm -rf "$folder"
}
trap stop EXIT

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
