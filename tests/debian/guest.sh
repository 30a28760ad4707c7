#!/bin/bash
# What runs on the machine that boot.sh boots: installs the package, plugs two rigs in and pulls them out, goes to sleep while they pull,
# and says what it found. A line begins with PASS, FAIL or NOTE; a check that has a figure ends with it.
cd / || exit
export DEBIAN_FRONTEND=noninteractive
exec >/dev/ttyS0 2>&1
# Whatever happens, the machine ends.
(sleep 600; echo 'FAIL the machine took too long'; systemctl reboot --force --force) &

. /proof/rig.sh

# alice is a member of the group haptic. Her haptic-ctl, for the rig that $rig_name names or for the only one.
rig_name=
ctl() { runuser -u alice -- haptic-ctl --socket "/run/hapticd$rig_name/control.sock" "$@"; }
for_rig() { local rig_name=@$1; shift; "$@"; }
property() { systemctl show --value --property "$1" "${2:-hapticd}.service"; }
is_unit() { [ "$(property ActiveState "$1")" = "$2" ]; }
is() { ctl --json status | grep "\"state\":\"$1\""; }
has_no_force() { ctl --json status | grep '"command_force_N":-\?0\.0,'; }
# Anyway: on an emulated machine the loop is slow and its link late, which the scene may not bear on a light rig, as these
# count while their mass is not known.
engages_and_pulls() {
    ctl engage --anyway --wait --timeout 20s && ctl wait --until 'command_force_N>1' --timeout 20s
}

installs() { dpkg --install /proof/hapticd.deb && usermod --append --groups haptic alice; }

# As the unit alone grants it: outside of a virtual machine the manager itself may not raise every limit.
real_time_is_granted() {
    local pid thread stat priority policy locked oom capabilities
    pid=$(property MainPID)
    for thread in /proc/"$pid"/task/*; do
        stat=$(cat "$thread/stat")
        # Counted from behind the name: the 40th and the 41st field of all.
        read -r priority policy <<<"$(awk '{ print $38, $39 }' <<<"${stat##*) }")"
        [ "$policy" = 1 ] && break
    done
    locked=$(awk '/^VmLck:/ { print $2 }' "/proc/$pid/status")
    oom=$(cat "/proc/$pid/oom_score_adj")
    capabilities=$(awk '/^CapPrm:/ { print $2 }' "/proc/$pid/status")
    figure="SCHED_FIFO $priority, $locked kB locked, oom_score_adj $oom, capabilities $capabilities"
    echo "policy $policy: $figure"
    [ "$policy" = 1 ] && [ "$priority" = 80 ] && [ "$locked" -gt 1000 ] && [ "$oom" = -900 ] && [ "$capabilities" = 0000000000000000 ]
}

# Rigs that udev starts.

# Time goes by as the emulator's work does: a late tick is no fault, and waiting for the next one without a pause would be its dearest work.
patient='rate = 200\nspin-us = 0\nstale-ms = 500\nlate-policy = "warn"\nuncommissioned = true\n'
of_rig() { printf "device = \"%s\"\n$patient" "$2" >"/etc/hapticd/hapticd$1.toml"; }
both() { "$@" left && "$@" right; }
neither() { not "$@" left && not "$@" right; }
has_node() { echo "$1: $(stat --dereference --format='%G %a' "/dev/hapticd/$1")" | grep ': hapticd 660$'; }
runs() { is_unit "hapticd@$1" active; }
is_idle() { for_rig "$1" is idle; }
is_disconnected() { for_rig "$1" is disconnected; }

plugging_in_starts_both() {
    local from
    from=$(milliseconds)
    plug_in_gadget && within 10000 both runs && figure="$(($(milliseconds) - from)) ms" && both has_node
}
firmware_answers() {
    sample_rate_hz=200
    start_fake_rig left --tty /dev/ttyGS0 && start_fake_rig right --hid /dev/hidg0 && within 10000 both is_idle
}
one_pulls_and_the_other_does_not() {
    for_rig left engages_and_pulls && within 3000 pulls left && for_rig right is idle && force_is_zero right
}
both_pull() { for_rig right engages_and_pulls && within 3000 pulls right && within 3000 pulls left; }
pulled_out_both_lose_their_force() {
    local from
    from=$(milliseconds)
    unplug_gadget && within 2000 both is_disconnected && figure="$(($(milliseconds) - from)) ms" &&
        within 1000 both force_is_zero && both runs && neither has_node
}
plugged_in_again_both_are_idle() {
    local from
    from=$(milliseconds)
    plug_in_gadget && within 5000 both is_idle && figure="$(($(milliseconds) - from)) ms" && both force_stays_zero && both is_idle
}
what_was_stopped_is_started() {
    systemctl stop hapticd@left.service hapticd@right.service && unplug_gadget && sleep 1 && neither runs &&
        plug_in_gadget && within 10000 both runs && within 5000 both is_idle
}

# Sleep. The daemon's own fake rig and the rig on USB pull when the machine goes to sleep.

is_awake_again() { journalctl --no-pager --output=cat --unit=systemd-suspend | grep 'returned from sleep'; }
sleeps() {
    engages_and_pulls && for_rig left engages_and_pulls && within 3000 pulls left || return
    fell_asleep=$(date +%s)
    # The host wakes it.
    systemctl suspend && within 90000 is_awake_again
}
# Journal entries on the fault `stalled` since the machine fell asleep, by its message id: docs/reference/faults.md.
stalled() {
    journalctl --quiet --no-pager --unit=hapticd --since="@$fell_asleep" MESSAGE_ID=a4b3f8073e62507aaca8c871affe9bc7 "$@"
}
has_reported() {
    journalctl --sync
    reported=$(stalled --output=cat)
    echo "$reported"
    [ -n "$reported" ]
}
# The clock of these times stands still in the sleep: when the kernel let the programs run again, and when the fault was
# reported.
ms_from_waking_to_reporting() {
    {
        journalctl --quiet --no-pager --dmesg --output=short-monotonic --grep='Restarting tasks' | tail -1
        stalled --output=short-monotonic
    } | tr -d '[]' | awk 'NR == 1 { woke = $1 } END { if (NR == 2) printf "%.0f", ($1 - woke) * 1000 }'
}
comes_back_faulted() {
    within 5000 has_reported && [ "$(wc -l <<<"$reported")" = 1 ] && is faulted && has_no_force &&
        sleep 1 && is faulted && has_no_force &&
        figure="$(ms_from_waking_to_reporting) ms"
}
rig_has_let_go() { for_rig left ctl status; not for_rig left is engaged && force_stays_zero left; }
engages_again() { ctl reset && engages_and_pulls; }
rig_engages_again() {
    for_rig left is faulted && { for_rig left ctl reset || return; }
    within 5000 is_idle left && for_rig left engages_and_pulls && within 3000 pulls left
}

echo "NOTE Debian $(cat /etc/debian_version), kernel $(uname -r), $(systemctl --version | head -1), up $(milliseconds) ms"
useradd alice
check 'the package is installed' installs
check 'a member of the group starts the daemon by engaging the rig' ctl engage --wait --timeout 20s
check 'the unit grants the real-time thread its priority and its memory, and no capability' real_time_is_granted
systemctl stop hapticd.service

insert_modules
mount -t configfs config /sys/kernel/config
of_rig '' fake
of_rig @left serial:/dev/serial/by-id/usb-Acme_Slider_17-if00
of_rig @right hid:1209:0001:17
check 'a rig on USB is made' make_gadget
check 'two rigs that are plugged in start their daemons, with link and group' plugging_in_starts_both
check 'both are idle' firmware_answers
check 'one pulls, and the other knows nothing of it' one_pulls_and_the_other_does_not
check 'both pull' both_pull
check 'pulled out, both are disconnected and their motors without force' pulled_out_both_lose_their_force
check 'plugged in again, both are idle and do not engage by themselves' plugged_in_again_both_are_idle
check 'a daemon that was stopped is started when its rig is plugged in' what_was_stopped_is_started

systemctl stop hapticd@right.service
check 'the machine sleeps while two rigs pull' sleeps
check 'awake again, the daemon is faulted, without force, and has reported it once' comes_back_faulted
check 'awake again, the motor of the rig on USB has no force' rig_has_let_go
check 'after a reset it engages' engages_again
check 'the rig on USB engages' rig_engages_again

check 'no daemon has panicked' not journalctl --no-pager --quiet --grep=panicked
dmesg >/tmp/dmesg
check 'the kernel has nothing to complain of' not grep -E 'BUG:|WARNING: CPU|Oops|refcount_t' /tmp/dmesg
echo END
# The emulator, told not to restart, ends; powered off after a sleep, it did not.
systemctl reboot --force --force
