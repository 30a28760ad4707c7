# What the guests share, for any POSIX shell: how a check is made, the modules, a rig on USB whose other end is the kernel's own gadget, and
# what its motor does. `ctl` is the guest's own: haptic-ctl, as the one who may use it.

check() { # NAME, then what must succeed; it may leave its figure in $figure
    checked=$1 figure=
    shift
    if "$@" >/tmp/printed 2>&1; then
        echo "PASS $checked${figure:+: $figure}"
    else
        echo "FAIL $checked: $(tr '\n' ' ' </tmp/printed | cut -c1-400)"
    fi
}

milliseconds() { read -r up _ </proc/uptime; echo "${up%.*}${up#*.}0"; }

# Waits for something to be so: MILLISECONDS COMMAND...
within() {
    until_ms=$(($(milliseconds) + $1))
    shift
    until "$@"; do
        if [ "$(milliseconds)" -ge "$until_ms" ]; then
            echo "not so in time: $*; $(ctl status 2>&1 | head -12)"
            return 1
        fi
        sleep 0.02
    done
}

not() { ! "$@"; }

insert_modules() {
    while read -r module; do
        insmod "/modules/$module" || echo "NOTE $module: $?"
    done </modules/order
}

# One device with both functions, as its maker would build it.
gadget=/sys/kernel/config/usb_gadget/rig
make_gadget() {
    mkdir $gadget && cd $gadget || return
    echo 0x1209 >idVendor
    echo 0x0001 >idProduct
    mkdir strings/0x409 configs/c.1 functions/acm.0 functions/hid.0
    echo 17 >strings/0x409/serialnumber
    echo Acme >strings/0x409/manufacturer
    echo Slider >strings/0x409/product
    echo 0 >functions/hid.0/protocol
    echo 0 >functions/hid.0/subclass
    echo 64 >functions/hid.0/report_length
    # As output through the control endpoint alone loses reports.
    echo 0 >functions/hid.0/no_out_endpoint
    # The descriptor of docs/device-protocol.md.
    printf '\x06\x00\xff\x09\x01\xa1\x01\x15\x00\x26\xff\x00\x75\x08\x95\x40\x09\x01\x81\x02\x95\x40\x09\x01\x91\x02\xc0' >functions/hid.0/report_desc
    ln -s functions/acm.0 functions/hid.0 configs/c.1/
    ls /sys/class/udc
    [ -n "$(ls /sys/class/udc)" ]
}
plug_in_gadget() { ls /sys/class/udc >$gadget/UDC; }
unplug_gadget() { echo '' >$gadget/UDC; }

# What a fake rig says of its motor: the force now, the largest since it was last asked, whether its watchdog has bitten.
ask_force() {
    lines=$(wc -l <"/tmp/$1.printed")
    echo force >"/tmp/$1.asked"
    for _ in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
        [ "$(wc -l <"/tmp/$1.printed")" -gt "$lines" ] && tail -1 "/tmp/$1.printed" && return
        sleep 0.02
    done
    # An old answer is none.
    echo "the fake rig does not answer"
}
start_fake_rig() { # NAME ARGUMENTS
    rig=$1
    shift
    mkfifo "/tmp/$rig.asked"
    fake-rig --sample-rate-hz "${sample_rate_hz:-500}" --hand-frequency-hz 1 "$@" <>"/tmp/$rig.asked" >"/tmp/$rig.printed" 2>&1 &
    fake_rig=$!
    within 5000 grep -q fake-rig "/tmp/$rig.printed"
}
pulls() { ask_force "$1" | awk '{ print; exit !($1 == "force" && $4 > 0.5) }'; }
force_is_zero() { ask_force "$1" | awk '{ print; exit !($1 == "force" && $2 == 0) }'; }
force_stays_zero() { ask_force "$1" >/dev/null; sleep 0.7; ask_force "$1" | awk '{ print; exit !($1 == "force" && $2 == 0 && $4 == 0) }'; }
