#!/usr/bin/env python3
"""Plants faults in the library, one at a time, and says whether property.py sees each.

    tests/mutants.py

Exit code 1 where one is not seen. It needs a C compiler, cc."""

import os
import subprocess
import sys
import tempfile

here = os.path.dirname(os.path.abspath(__file__))
CONVERSATIONS = "60"

# Fault, what stands there, what stands there instead.
FAULTS = [
    ("poll's watchdog never trips", "now - device->commanded_us >= device->watchdog_us", "0"),
    ("the timer's watchdog never trips", "if (device->quiet_us >= device->watchdog_us)", "if (0)"),
    ("the timer feeds its own watchdog", "if (device->fed || !device->enabled) {", "if (device->open || !device->enabled) {"),
    (
        "nobody looks at a trip after driving",
        "switched them on again. */\n    if (device->trip)\n        switch_off(device);\n",
        "switched them on again. */\n    device->trip = false;\n",
    ),
    (
        "a refused message feeds the watchdog",
        "    } else if (device->open && (int32_t)(number - device->newest) > 0) {",
        "    } else if (device->open && (device->commanded_us = now, device->fed = true, (int32_t)(number - device->newest) > 0)) {",
    ),
    ("the CRC is not checked", "if (crc == CRC_RESIDUE && ", "if ("),
    ("a frame's last distance is not checked", " && distance == 0 && length", " && length"),
    ("init leaves the motors as they are", "    config->motor_off(config->context);\n    if (!config->clock_us", "    if (!config->clock_us"),
    (
        "a second enable keeps the force",
        "zero force until the next command. */\n    switch_off(device);",
        "zero force until the next command. */\n    if (!(message[2] & FLAG_ENABLED))\n        switch_off(device);",
    ),
    ("a command without 'enabled' leaves the motors on", "    if (!(message[2] & FLAG_ENABLED)) {\n        switch_off(device);\n        return;\n    }\n", ""),
    ("the force is not cut to the limit", "force > limit ? limit : force < -limit ? -limit : force", "force"),
    ("the second axis is cut to the first's limit", "config->force_limit_mn[axis];\n", "config->force_limit_mn[0];\n"),
    ("commands drive without an enable", "if (!device->enabled || device->trip)\n        return;", "if (device->trip)\n        return;"),
    ("a lost position does not switch off", "        haptic_device_fault(device, HAPTIC_DEVICE_SENSOR, 0);", "        report(device, HAPTIC_DEVICE_SENSOR, 0);"),
    ("the motors are enabled without a position", "device->enabled = !device->lost;", "device->enabled = true;"),
    ("motor_on comes before the interrupt lets it", "device->enabled = !device->lost;\n        if (device->enabled &&", "if (!device->lost &&"),
    ("an old sequence is taken", "(int32_t)(number - device->newest) > 0", "1"),
    ("a sequence from half way round is taken", "(int32_t)(number - device->newest) > 0", "number != device->newest"),
    ("a hello does not switch off", "uint32_t now)\n{\n    switch_off(device);\n    device->nonce", "uint32_t now)\n{\n    device->nonce"),
    ("silence never comes", "device->open && now - device->received_us >= SILENCE_US", "0"),
    ("answers go out after silence", "        device->pending = 0;\n", ""),
    ("a bad message hides why the motors are off", "error == HAPTIC_DEVICE_BAD_MESSAGE && device->pending & PENDING_ERROR", "0"),
    ("the second axis gets the first's force", "message + 8 + 4 * axis", "message + 8"),
    ("the second axis is not sent", "axis < config->axes; axis++) {\n        at = put32", "axis < 1; axis++) {\n        at = put32"),
    ("the hello lacks the second axis", "(two ? FLAG_TWO_AXES : 0)", "0"),
    ("an enable(off) takes the mark away", "    device->refused = false;\n", "    device->refused = device->tripped = false;\n"),
    ("a command of any length is taken", " || length != length_of(device, kind)", ""),
    ("a sample overtakes the hello", "if (!device->open || device->pending & PENDING_HELLO)", "if (!device->open)"),
    ("parts are written without a look at the room", "config->room(config->context) < end - message + FRAMING_BYTES", "0"),
    ("the config is not checked", "config->axes < 1 || config->axes > HAPTIC_DEVICE_AXES", "0"),
]


def is_seen(source, folder):
    """What property.py says of a library with a fault; nothing where it sees none."""
    path = os.path.join(folder, "mutant")
    with open(path + ".c", "w", encoding="utf-8") as file:
        file.write(source)
    subprocess.run(["cc", "-std=c99", "-O1", "-w", "-I", os.path.join(here, "../src"), "-shared", "-fPIC", "-o", path + ".so", path + ".c"], check=True)
    command = [sys.executable, os.path.join(here, "property.py"), path + ".so", CONVERSATIONS]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return "it hangs"
    return None if run.returncode == 0 else run.stdout.strip() or "it crashes"


def main():
    with open(os.path.join(here, "../src/haptic_device.c"), encoding="utf-8") as file:
        source = file.read()
    seen = 0
    with tempfile.TemporaryDirectory() as folder:
        for fault, there, instead in FAULTS:
            if source.count(there) != 1:
                print(f"FAULT {fault}: its place is there {source.count(there)} times")
                continue
            output = is_seen(source.replace(there, instead), folder)
            seen += output is not None
            print(f"{'ok   ' if output else 'FAULT'} {fault}: {output or 'not seen'}", flush=True)
    print(f"{seen} of {len(FAULTS)} seen")
    return 0 if seen == len(FAULTS) else 1


if __name__ == "__main__":
    sys.exit(main())
