#!/bin/sh
# The soak with faults: builds what it needs and runs it. `tests/soak.sh --help` says more.
set -eu
cd "$(dirname "$0")/.."
what='--profile bench --package system-tests'
for argument; do
    # As the tests are built, so that nothing is compiled twice.
    [ "$argument" != --debug ] || what='--profile dev --workspace'
done
# shellcheck disable=SC2086 # words
exec cargo bench --quiet --locked $what --bench soak -- "$@"
