/* The device side of hapticd's link protocol, version 1, for any board: one or two motors, each with an encoder, on a
 * serial line or USB HID. This header is the manual. The library allocates nothing, waits for nothing, owns no interrupt
 * and computes with integers only.
 *
 *     static struct haptic_device device;
 *     static struct haptic_device_config config;
 *
 *     at start:   switch the motors off; fill in config; haptic_device_init(&device, &config);
 *     loop:       haptic_device_poll(&device);                       as often as possible, at least 4 times a sample
 *                 if (ticked) { ticked = false; kick_hardware_watchdog(); }
 *     interrupt:  ticked = true;                                     of a hardware timer, each millisecond
 *                 haptic_device_watchdog_from_isr(&device, 1000);
 *
 * Line: serial, 8N1, at 1000000 baud; at another rate the host's address names it: serial:/dev/ttyACM0?baud=500000. Or USB
 * HID (config.hid): reports of 64 bytes both ways without numbers, on a usage page of the vendor's own (0xFF00).
 *
 * Units and signs: forces are those of the motor on the hand. A positive force moves the handle to larger counts.
 * check_rig.py PORT checks a board at rest, and with --push 0.5 also this; swap the motor's or the encoder's wires if it
 * fails.
 *
 * Safety. The motors give force only between the host's enable and the first of: a command without "enabled", a disable,
 * a hello, watchdog_ms without a valid command, a lost position, a fault. A port adds three things:
 *   1. A pull-down resistor at the power stage's enable or PWM input: pins float while the processor is in reset.
 *   2. The interrupt above, on the core that runs the loop, of higher priority than whatever may hang. It ends the force
 *      when the loop, write or read hang, and when clock_us stands still.
 *   3. A hardware watchdog of at most 40 ms, kicked as above: only when both loop and interrupt have run. It ends the
 *      force when the processor hangs with interrupts off. Reset must leave the motors off. */
#ifndef HAPTIC_DEVICE_H
#define HAPTIC_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define HAPTIC_DEVICE_AXES 2
#define HAPTIC_DEVICE_FRAME 62 /* bytes of the longest frame on a serial line */
#define HAPTIC_DEVICE_REPORT 64 /* bytes of a HID report, both ways */

/* A measurement of all axes at one moment. */
struct haptic_sample {
    uint32_t time_us; /* of the measurement, on the clock of clock_us */
    int32_t count[HAPTIC_DEVICE_AXES]; /* may wrap around, must not jump */
    int32_t hand_force_mn[HAPTIC_DEVICE_AXES]; /* sent only with config.wide */
    int32_t acceleration_mm_s2[HAPTIC_DEVICE_AXES]; /* sent only with config.wide */
    bool lost; /* the count is wrong since the last sample (wire off, too fast): motors go off, the host gets an error */
};

/* The board. It must outlive the device and not change. Unused fields are 0. Every function gets "context". */
struct haptic_device_config {
    const char *name; /* name and version of the firmware, up to 24 ASCII characters; may end in # and the chip's id, as in
                       * "mine 1.0#5a3c01", which is then the rig's serial number */
    uint8_t axes; /* 1 or 2 */
    uint8_t buttons_there; /* existing buttons, one bit each */
    bool hid; /* the line is USB HID, not serial */
    bool wide; /* samples carry hand force and acceleration */
    bool rotary; /* two axes only: counts a radian and uN m, instead of counts a metre and mN */
    bool absolute; /* two axes only: count 0 is the home pose, also after power-on */
    float counts_per_metre[HAPTIC_DEVICE_AXES]; /* 1 to 1e10 */
    uint32_t force_limit_mn[HAPTIC_DEVICE_AXES]; /* largest force of the motor; commands are cut to it */
    uint16_t sample_rate_hz; /* 10 to 20000, preferably a divisor of 1000000; begin with 1000 */
    uint16_t watchdog_ms; /* 1 to 200; 0 means 50 */
    void *context;

    /* Time in us, through all 32 bits, then around to 0. Steps: up to 10 us, or up to 1 ms without measure. */
    uint32_t (*clock_us)(void *context);

    /* Takes a measurement; poll calls it when a sample is due. time_us is set to the time of the call; change it if the
     * position is of another moment. All else is 0 and false before. Optional: leave it out if an interrupt measures, and
     * call haptic_device_sample. */
    void (*measure)(void *context, struct haptic_sample *sample);
    /* Gives this force on each axis from now on, by an array of HAPTIC_DEVICE_AXES. It is within the limit already. */
    void (*motor_force)(void *context, const int32_t force_mn[]);

    /* Zero force, at once: a pin or register, no bus, no waiting. The loop and the interrupt call it, also repeatedly and
     * also inside motor_force, so it must be safe to interrupt. */
    void (*motor_off)(void *context);
    /* Switches the power stage on, at zero force. False refuses, and the host gets an error. Optional. */
    bool (*motor_on)(void *context);
    /* Buttons pressed, one bit each, debounced. Optional. */
    uint8_t (*buttons)(void *context);
    /* Takes received bytes without waiting; returns their number. Serial: up to room bytes, also fewer than there are. HID:
     * one report, or 0. */
    uint8_t (*read)(void *context, uint8_t *bytes, uint8_t room);

    /* Sends all bytes, or none and returns false; never waits. HID: always one whole report. On USB it must return false
     * when the host has closed the port: a write that waits there is a frequent cause of firmware that hangs. */
    bool (*write)(void *context, const uint8_t *bytes, uint8_t length);

    /* Number of bytes that write would take now, at most 255. Optional, serial only: with it the library writes a frame in
     * parts while it encodes the rest, which takes a slow processor a fifth of a millisecond. Arduino:
     * Serial.availableForWrite(). */
    uint8_t (*room)(void *context);
};

enum haptic_device_state { HAPTIC_DEVICE_SILENT, HAPTIC_DEVICE_OPEN, HAPTIC_DEVICE_ENABLED };
enum haptic_device_error { HAPTIC_DEVICE_BAD_MESSAGE = 1, HAPTIC_DEVICE_SENSOR, HAPTIC_DEVICE_MOTOR, HAPTIC_DEVICE_OTHER = 255 };

/* Private. */
struct haptic_device {
    const struct haptic_device_config *config;
    uint32_t newest, newest_command, nonce, sequence, acknowledged, detail;
    uint32_t received_us, commanded_us, due_us, period_us, watchdog_us, quiet_us, crc;
    uint8_t frame[HAPTIC_DEVICE_FRAME], length, distance, pending, refused, error;
    bool open, tripped, lost;
    volatile bool enabled, fed, trip;
};

/* Switches the motors off, then checks the config. Returns false for a value beyond its bounds, or without a function that
 * is not optional; every other function then does nothing, and the motors stay off. Call it before the timer's interrupt
 * starts. */
bool haptic_device_init(struct haptic_device *device, const struct haptic_device_config *config);

/* Receives, drives the motors, measures when a sample is due, sends. Never waits. */
void haptic_device_poll(struct haptic_device *device);

/* Sends a measurement that an interrupt took, all its fields set. Call it once for each from the loop, and leave out
 * config.measure. */
void haptic_device_sample(struct haptic_device *device, const struct haptic_sample *sample);

/* Reports that motor or board have failed: switches the motors off and tells the host. It may enable them again; refuse in
 * motor_on as long as the fault lasts. */
void haptic_device_fault(struct haptic_device *device, uint8_t error, uint32_t detail);

/* Switches the motors off when no valid command has come for watchdog_ms, without the loop and without clock_us. Call it
 * from a timer's interrupt with the time since the last call, 100 to 5000 us. All other functions are for the loop. */
void haptic_device_watchdog_from_isr(struct haptic_device *device, uint16_t elapsed_us);

/* The protocol's state, for a light. */
enum haptic_device_state haptic_device_state(const struct haptic_device *device);

#ifdef __cplusplus
}
#endif
#endif
