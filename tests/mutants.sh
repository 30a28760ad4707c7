#!/usr/bin/env bash
# Which faults in the parts that keep the hand safe would no test see? cargo-mutants plants each in
# a clone of the tree, runs the cheapest tests that should see it, and this prints those that lived.
# It takes minutes (limiter, clock) to hours (rt), so it is run on demand; docs/safety.md has the
# last result, and why each that lived may.
#
#   tests/mutants.sh                       # limiter senses state session clock: an hour or two
#   tests/mutants.sh limiter rt            # parts: limiter, senses, state, servo, session, clock, rt
#   tests/mutants.sh session -- --shard 0/4   # what comes after -- goes to cargo mutants
#
# What is committed is tested, not what is being worked on. The clone and its build stay in
# $HAPTICD_MUTANTS_DIR (by default target/mutants), so a second run begins sooner.
set -euo pipefail
cd "$(dirname "$0")/.."

version=27.1.0
if [ "$(cargo mutants --version 2>/dev/null)" != "cargo-mutants $version" ]; then
    echo "cargo-mutants $version is missing: cargo install --locked --version $version cargo-mutants" >&2
    exit 2
fi

parts=()
while [ $# != 0 ] && [ "$1" != -- ]; do
    parts+=("$1")
    shift
done
[ "${1-}" = -- ] && shift
[ ${#parts[@]} != 0 ] || parts=(limiter senses state session clock)

# For each part: the files that are changed, their package, and the tests that should see it: a
# package and what `cargo test` gets. What the first tests do not see is held against the next ones.
# What is not named here is not run: a whole test run for every mutant would take a week.
describe() {
    case $1 in
    limiter) files=(haptic-core/src/limiter.rs) package=haptic-core tests=("haptic-core --lib -- limiter") ;;
    # Without the test of one number: it turns red with every change of the forces, wanted or not.
    state)
        files=(haptic-core/src/servo/rig.rs) package=haptic-core
        tests=("haptic-core --lib -- servo --skip every_build_gives")
        ;;
    # What lives costs a build of the daemon: the tick's tests decide every reading of a device.
    servo)
        files=(haptic-core/src/servo/{mod,inputs,sensing,transition,force_offset,fault,state}.rs)
        package=haptic-core
        tests=("haptic-core --lib -- servo --skip every_build_gives" "hapticd --bins -- rt::tick")
        ;;
    session)
        files=(device-io/src/link/{session,sent_messages}.rs) package=device-io
        tests=("device-io --lib -- link::")
        ;;
    clock) files=(device-io/src/link/device_clock.rs) package=device-io tests=("device-io --lib -- link::") ;;
    senses)
        files=(haptic-core/src/{sample_clock,position_guard}.rs) package=haptic-core
        tests=("haptic-core --lib -- sample_clock position_guard")
        ;;
    # Without the minutes that the stall and purity tests take for each.
    rt)
        files=('hapticd/src/rt/*.rs') package=hapticd
        tests=("hapticd --bins -- rt:: --skip stall_tests --skip purity_tests")
        ;;
    *)
        echo "no part $1: limiter, senses, state, servo, session, clock, rt" >&2
        exit 2
        ;;
    esac
}
for part in "${parts[@]}"; do describe "$part"; done

folder=${HAPTICD_MUTANTS_DIR:-$PWD/target/mutants}
mkdir -p "$folder"
commit=$(git rev-parse --short HEAD)
if [ ! -e "$folder/tree/.git" ]; then
    git clone --quiet --shared . "$folder/tree"
fi
# A run that was broken off has left its mutant there.
git -C "$folder/tree" fetch --quiet "$PWD" HEAD
git -C "$folder/tree" checkout --quiet --force --detach FETCH_HEAD

# Long runs are short: what they see, they see early.
unset HAPTICD_TEST_LONG
export CARGO_TERM_COLOR=never
# The clone has a target folder of its own.
unset CARGO_TARGET_DIR

for part in "${parts[@]}"; do
    describe "$part"
    filters=()
    for file in "${files[@]}"; do filters+=(--file "crates/$file"); done
    out="$folder/$part"
    mkdir -p "$out"
    count() { wc -l <"$out/mutants.out/$1.txt"; }
    rest=()
    for stage in "${tests[@]}"; do
        read -ra words <<<"$stage"
        printf '\n## %s, commit %s, %s: cargo test --package %s\n\n' \
            "$part" "$commit" "$(date --utc +%F)" "$stage"
        status=0
        # In place is one at a time: two at once would make each other's timings fail, and a mutant
        # caught by that alone is not caught.
        nice -n 10 cargo mutants --dir "$folder/tree" --in-place --output "$out" \
            --timeout "${HAPTICD_MUTANTS_TIMEOUT_S:-120}" --build-timeout 900 \
            --package "$package" --test-package "${words[0]}" "${rest[@]}" "${filters[@]}" \
            --exclude '**/*_tests.rs' --colors never --no-shuffle "$@" -- "${words[@]:1}" \
            >"$out/log" 2>&1 || status=$?
        # 2: some lived; 3: some took too long. Anything else and nothing was learnt.
        case $status in 0 | 2 | 3) ;; *) tail -20 "$out/log" && exit "$status" ;; esac
        printf '%s caught, %s ended by time, %s do not compile, %s lived:\n\n' \
            "$(count caught)" "$(count timeout)" "$(count unviable)" "$(count missed)"
        sed 's/^/- /' "$out/mutants.out/missed.txt"
        [ "$status" != 0 ] || break
        # Only what lived, or took too long, goes on.
        rest=(--iterate)
    done
done
