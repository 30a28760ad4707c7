#!/bin/busybox sh
# The only program of the guest that run.sh boots: makes the gadgets, runs hapticd against each, and says what it found. A line begins with PASS, FAIL or NOTE.
/bin/busybox mkdir -p /bin /usr/bin
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mount -t tmpfs tmp /tmp
mount -t tmpfs run /run
# Whatever happens, the guest ends.
(sleep 300; echo 'FAIL the guest took too long'; poweroff -f) &

. /rig.sh
insert_modules
mount -t configfs config /sys/kernel/config

# The converter is qemu's own; taking it from its driver is what a program sees of pulling it out.
converter=
find_converter() {
    for device in /sys/bus/usb/devices/*; do
        [ "$(cat "$device/idVendor" 2>/dev/null)" = 0403 ] && converter=$(basename "$device") && return
    done
    return 1
}
plug_in_converter() { echo "$converter" >/sys/bus/usb/drivers/usb/bind; }
unplug_converter() { echo "$converter" >/sys/bus/usb/drivers/usb/unbind; }

ctl() { haptic-ctl --socket /run/c.sock "$@"; }
is() { ctl --json status | grep -q "\"state\": *\"$1\""; }
knows_firmware() { ctl status | grep -q 'firmware *fake-rig'; }
engages_and_pulls() { ctl engage && within 3000 is engaged && within 3000 pulls "$1"; }
never_engages() {
    for _ in 1 2 3 4 5 6 7 8 9 10; do
        is idle || return 1
        sleep 0.05
    done
    force_stays_zero "$1"
}

is_in_use() { devices_of root --probe "$1" | grep -F 'another program has it open'; }

# One kind of link from end to end: NAME ADDRESS PLUG_IN UNPLUG, and where its fake rig speaks
link() {
    name=$1 address=$2 plug_in=$3 unplug=$4
    shift 4
    start_fake_rig "$name" "$@"
    check "$name: it says who it is when asked" says_who_it_is "$address"
    hapticd --device "$address" --socket /run/c.sock --rate 500 --stale-ms 500 --uncommissioned 2>/tmp/hapticd.log &
    daemon=$!
    check "$name: connects, and is idle" within 10000 is idle
    check "$name: the firmware is known" within 3000 knows_firmware
    check "$name: while it is in use nobody else gets it" is_in_use "$address"
    check "$name: idle, the motor gives nothing" force_stays_zero "$name"
    check "$name: engages, and the force reaches the motor" engages_and_pulls "$name"
    check "$name: a stop is confirmed" ctl stop
    check "$name: stopped, the motor gives nothing" within 1000 force_is_zero "$name"
    check "$name: a reset leaves it idle" ctl reset
    check "$name: engages again" engages_and_pulls "$name"
    check "$name: is unplugged" $unplug
    check "$name: unplugged while engaged, it is disconnected" within 2000 is disconnected
    check "$name: unplugged, the motor gives nothing" within 1000 force_is_zero "$name"
    check "$name: is plugged in again" $plug_in
    check "$name: plugged in again, it is idle within 2 s" within 2000 is idle
    check "$name: it never engages by itself" never_engages "$name"
    check "$name: engages after that" engages_and_pulls "$name"
    kill -TERM $daemon
    wait $daemon
    check "$name: the daemon ends well" [ $? = 0 ]
    check "$name: without the daemon, the motor gives nothing" within 1000 force_is_zero "$name"
    check "$name: the daemon did not panic" not grep panicked /tmp/hapticd.log
    kill $fake_rig
}

# A daemon that lists what there is and asks who it is, for the superuser and for somebody without any right: NAME
start_lister() {
    mkdir -m 700 "/tmp/$1" && chown "$1" "/tmp/$1" || return
    su "$1" -c "exec hapticd --device fake --socket /tmp/$1/s.sock" 2>"/tmp/$1.log" &
    within 10000 [ -S "/tmp/$1/s.sock" ]
}
devices_of() { of=$1; shift; haptic-ctl --socket "/tmp/$of/s.sock" devices "$@"; }
# The list that USER gets shows TEXT of the device at ADDRESS.
lists() { devices_of "$1" | awk -v address="$2" '/^[^ ]/ { on = $0 == address } { print >"/tmp/listed" } on' | grep -F "$3" || { cat /tmp/listed; return 1; }; }
says_who_it_is() { devices_of root --probe "$1" | tee /tmp/listed | grep -q 'fake-rig .* 500 samples/s, 10.000 um a count, up to 20 N' || { cat /tmp/listed; return 1; }; }

echo "NOTE kernel $(uname -r), up $(milliseconds) ms"
check 'the gadget is made' make_gadget
check 'the gadget is plugged in' plug_in_gadget
check 'a HID node appears' within 3000 [ -e /dev/hidraw0 ]
check 'a CDC-ACM node appears' within 3000 [ -e /dev/ttyACM0 ]
check 'a converter node appears' within 3000 [ -e /dev/ttyUSB0 ]
check 'the converter is on the bus' find_converter

check 'a daemon for the list' start_lister root
check 'a daemon without any right' start_lister nobody
slider='Acme Slider (1209:0001, serial number 17)'
check 'the list names the HID device' lists root hid:1209:0001:17 "$slider, HID device /dev/hidraw0"
check 'the list names the CDC-ACM port' lists root 'serial:/dev/ttyACM0?baud=1000000' "$slider, serial port /dev/ttyACM0"
check 'the list names the converter' lists root 'serial:/dev/ttyUSB0?baud=1000000' '(0403:6001'
check 'the superuser is told of nothing in the way' not lists root hid:1209:0001:17 'fix: '
check 'another user is told how to be allowed the HID device' lists nobody hid:1209:0001:17 \
    'SUBSYSTEM=="hidraw", ATTRS{idVendor}=="1209", ATTRS{idProduct}=="0001", GROUP="hapticd", MODE="0660"'
check 'another user is told how to be allowed the port' lists nobody 'serial:/dev/ttyACM0?baud=1000000' 'usermod -aG dialout'

link acm serial:/dev/ttyACM0 plug_in_gadget unplug_gadget --tty /dev/ttyGS0
link hid hid:1209:0001:17 plug_in_gadget unplug_gadget --hid /dev/hidg0
link ftdi serial:/dev/ttyUSB0 plug_in_converter unplug_converter --tty /dev/vport*p1

dmesg >/tmp/dmesg
check 'the kernel has nothing to complain of' not grep -E 'BUG:|WARNING: CPU|Oops|refcount_t' /tmp/dmesg
echo END
poweroff -f
