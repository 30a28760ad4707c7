#!/usr/bin/env bash
# Which faults in the parts that keep the hand safe would no test see? Each change that cargo-mutants
# knows is planted in a clone of the tree and held against the cheapest tests that should see it
# (tests/mutants.py); this prints those that lived. It is run on demand. A change by which the tests run
# out of time counts as caught. Last results, caught and alive:
#
#   limiter 60, 3   senses 122, 5   state 50, 0       servo 232, 17  forces 169, 7
#   motion 391, 16  session 116, 3  clock 59, 0       rt 229, 9      thread 32, 49
#   plane 360, 37   kinematics 233, 19
#
# Since then tests see 5 of the servo's, 3 of the forces', 5 of the motions', 4 of the kinematics' and one of rt: of
# each part some were planted again, and all of these were seen; the parts were not run again.
#
# Most survivors give the same result (a comparison at exact equality, a sign, words without a common
# bit) or change only a printed text. The others, and why they may live:
#
#   priority, processor, locked memory, deadlines (27)  real_time_claims compares each with the kernel's account
#   the stack touched beforehand, blocked signals (2)   real_time_claims counts the loop's page faults and waits
#   how the daemon waits for the loop's end (6)         blocked_output ends the whole daemon in every attack
#   the loop is asked to end (3)                        life ends the whole daemon by every signal
#   `--self-test` takes another device (2)              it drives no rig
#   when the loop spins                                 at most 0.1 ms of a period; `status` shows it
#   nine sizes of memory and stacks                     they only have to be large enough
#
#   tests/mutants.sh               # every part
#   tests/mutants.sh limiter rt    # some
#
# What is committed is tested, not what is being worked on. The clone and its build stay in
# $HAPTICD_MUTANTS_DIR (by default target/mutants), so a second run begins sooner. A change may take
# $HAPTICD_MUTANTS_TIMEOUT_S (by default 120) of the tests' time.
set -euo pipefail
cd "$(dirname "$0")/.."

version=27.1.0
if [ "$(cargo mutants --version 2>/dev/null)" != "cargo-mutants $version" ]; then
    echo "cargo-mutants $version is missing: cargo install --locked --version $version cargo-mutants" >&2
    exit 2
fi

all=(limiter senses state servo forces motion plane kinematics session clock rt thread)
parts=("$@")
[ ${#parts[@]} != 0 ] || parts=("${all[@]}")

# For each part: the files that are changed, their package, and the names of the tests that should
# see it. What is not named here is not run: a whole test run for every change would take a week.
describe() {
    integration=''
    case $1 in
    # What the servo alone asks of it, its tests see.
    limiter) package=haptic-core files=(limiter.rs) tests=(limiter servo --skip every_build_gives) ;;
    senses)
        package=haptic-core files=(sample_clock.rs position_guard.rs)
        tests=(sample_clock position_guard servo --skip every_build_gives)
        ;;
    # Without the test of one number: it turns red with every change of the forces, wanted or not.
    state) package=haptic-core files=(servo/rig.rs) tests=(servo --skip every_build_gives) ;;
    servo)
        package=haptic-core integration=physics tests=(servo --skip every_build_gives)
        files=(servo/{clock_doubt,inputs,sensing,servo,state,transition}.rs)
        ;;
    forces)
        package=haptic-core files=(servo/{step,compile}.rs compensation.rs) integration=physics
        tests=(servo compensation --skip every_build_gives)
        ;;
    motion)
        package=haptic-core files=(excitation/{mod,course}.rs own_motion.rs rig_friction.rs bound_error.rs)
        integration=physics
        tests=(excitation own_motion rig_friction bound_error compensation servo::tests::motion pulse_on)
        ;;
    # Not its series, for which references are the judge.
    plane)
        package=haptic-core files=(planar/{vector,renderer,spring}.rs) integration=physics
        tests=(planar_servo planar::{references,tests})
        ;;
    kinematics)
        package=device-io files=(kinematics/{dual,five_bar,geometry,mod,workspace}.rs link/planar_link.rs)
        tests=(kinematics link::planar)
        ;;
    session)
        package=device-io files=(link/session.rs link/sent_messages.rs)
        tests=(link::{session,sent_messages,queue_tests,serial})
        ;;
    clock) package=device-io files=(link/device_clock.rs) tests=(link::device_clock) ;;
    # Without a property that takes a second for each (what breaks it, others see) and the count of instructions, which
    # the planted changes raise.
    rt)
        package=hapticd files=(rt/{clock,inbox,lateness,outbox,schedule,shared,tick}.rs)
        tests=(
            rt::{clock,handoff,inbox,lateness,outbox,schedule,tick}
            --skip force_stays_within --skip tick_budget
        )
        ;;
    thread)
        package=hapticd files=(rt/thread.rs rt/privileges.rs)
        tests=(rt::thread:: rt::privileges rt::panic_tests)
        ;;
    *)
        echo "no part $1: ${all[*]}" >&2
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
# A change that only a rare case shows counts as not seen.
export PROPTEST_CASES=64
export CARGO_TERM_COLOR=never
# The clone has a target folder of its own.
unset CARGO_TARGET_DIR

for part in "${parts[@]}"; do
    describe "$part"
    git -C "$folder/tree" checkout --quiet --force HEAD
    mkdir -p "$folder/$part"
    printf '\n## %s, commit %s, %s: cargo test --package %s %s\n\n' \
        "$part" "$commit" "$(date --utc +%F)" "$package" "${tests[*]}"
    nice -n 10 python3 tests/mutants.py --tree "$folder/tree" --out "$folder/$part" \
        --package "$package" ${integration:+--integration "$integration"} \
        --files "${files[@]/#/crates/$package/src/}" -- "${tests[@]}"
done
