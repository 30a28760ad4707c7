#include "haptic_device.h"

#include <string.h>

#define VERSION 1
#define SILENCE_US 1000000
#define CRC_BYTES 4
/* COBS adds one byte, and a zero ends the frame. */
#define FRAMING_BYTES (CRC_BYTES + 2)
/* Bytes that one poll takes from a serial line, so that a burst cannot delay the next sample. */
#define READ_BYTES 24
/* Bytes worth a call of config.write. */
#define PART_BYTES 4

enum kind { HELLO = 0x01, SAMPLE, WIDE_SAMPLE, ACKNOWLEDGE, ERROR, HOST_HELLO = 0x11, COMMAND, ENABLE };
enum flag { FLAG_ENABLED = 1, FLAG_TRIPPED = 2 };
enum hello_flag { FLAG_WIDE = 1, FLAG_TWO_AXES = 2, FLAG_ROTARY = 4, FLAG_ABSOLUTE = 8 };
/* Answers that wait until the line takes them. */
enum pending { PENDING_HELLO = 1, PENDING_ACKNOWLEDGE = 2, PENDING_ERROR = 4 };

/* CRC-32, reflected polynomial 0xEDB88320. The table's entry of a byte is the XOR of the entries of its bits. */
#define CRC1(n)                                                                                                        \
    (((n) & 1 ? 0x77073096 : 0) ^ ((n) & 2 ? 0xEE0E612C : 0) ^ ((n) & 4 ? 0x076DC419 : 0)                              \
     ^ ((n) & 8 ? 0x0EDB8832 : 0) ^ ((n) & 16 ? 0x1DB71064 : 0) ^ ((n) & 32 ? 0x3B6E20C8 : 0)                          \
     ^ ((n) & 64 ? 0x76DC4190 : 0) ^ ((n) & 128 ? 0xEDB88320 : 0))
#define CRC4(n) CRC1(n), CRC1((n) + 1), CRC1((n) + 2), CRC1((n) + 3)
#define CRC16(n) CRC4(n), CRC4((n) + 4), CRC4((n) + 8), CRC4((n) + 12)
#define CRC64(n) CRC16(n), CRC16((n) + 16), CRC16((n) + 32), CRC16((n) + 48)
#ifdef __FLASH /* An AVR copies plain constants to its RAM. */
static const __flash
#else
static const
#endif
uint32_t crc_table[256] = { CRC64(0), CRC64(64), CRC64(128), CRC64(192) };
#define CRC_START 0xFFFFFFFF
/* The CRC, before the final complement, of any message followed by its own CRC. */
#define CRC_RESIDUE 0xDEBB20E3

static uint32_t crc_add(uint32_t crc, uint8_t byte)
{
    return crc >> 8 ^ crc_table[(uint8_t)crc ^ byte];
}

static uint8_t *put32(uint8_t *at, uint32_t value)
{
    at[0] = (uint8_t)value;
    at[1] = (uint8_t)(value >> 8);
    at[2] = (uint8_t)(value >> 16);
    at[3] = (uint8_t)(value >> 24);
    return at + 4;
}

static uint32_t get32(const uint8_t *at)
{
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Sends a message; the CRC goes behind its end. Returns false, and sends nothing, if the line has no room: part of a
 * frame is worse than none. With config.room complete COBS groups are written while the rest is encoded. */
static bool send(const struct haptic_device_config *config, uint8_t *message, uint8_t *end)
{
    uint8_t out[HAPTIC_DEVICE_FRAME], *group = out, *to = out + 1;
    uint32_t crc = CRC_START;
    bool in_parts = config->room, sent = true;
    if (config->hid) {
        uint8_t report[HAPTIC_DEVICE_REPORT] = { 0 };
        memcpy(report, message, (size_t)(end - message));
        return config->write(config->context, report, sizeof report);
    }
    if (in_parts && config->room(config->context) < end - message + FRAMING_BYTES)
        return false;
    for (bool has_crc = false;; has_crc = true) {
        while (message != end) {
            uint8_t byte = *message++;
            crc = crc_add(crc, byte);
            *to++ = byte;
            if (byte != 0)
                continue;
            /* In the place of each zero is the distance to the next. Frames are too short for a distance of 255. */
            *group = (uint8_t)(to - 1 - group);
            group = to - 1;
            if (in_parts && group - out >= PART_BYTES) {
                sent &= config->write(config->context, out, (uint8_t)(group - out));
                group = out;
                to = out + 1;
            }
        }
        if (has_crc)
            break;
        end = put32(end, ~crc);
    }
    *group = (uint8_t)(to - group);
    *to++ = 0;
    return config->write(config->context, out, (uint8_t)(to - out)) && sent;
}

static bool send_hello(struct haptic_device *device)
{
    const struct haptic_device_config *config = device->config;
    bool two = config->axes > 1;
    uint8_t message[HAPTIC_DEVICE_FRAME] = { HELLO, VERSION }, *at = message + 4;
    message[2] = (config->wide ? FLAG_WIDE : 0) | (two ? FLAG_TWO_AXES : 0) | (two && config->rotary ? FLAG_ROTARY : 0)
        | (two && config->absolute ? FLAG_ABSOLUTE : 0);
    message[3] = config->buttons_there;
    at = put32(at, device->nonce);
    at = put32(at, bits_of(config->counts_per_metre[0]));
    at = put32(at, config->force_limit_mn[0]);
    at = put32(at, config->sample_rate_hz);
    at = put32(at, device->watchdog_us / 1000);
    for (uint8_t i = 0; i < 24 && config->name[i]; i++)
        at[i] = (uint8_t)config->name[i];
    at += 24;
    if (two)
        at = put32(put32(at, bits_of(config->counts_per_metre[1])), config->force_limit_mn[1]);
    return send(config, message, at);
}

static bool send_short(struct haptic_device *device, uint8_t kind, uint8_t code, uint32_t number)
{
    uint8_t message[8 + CRC_BYTES] = { kind, VERSION, code };
    return send(device->config, message, put32(message + 4, number));
}

/* Sends what waits. The hello goes first, and no sample overtakes it. */
static void send_pending(struct haptic_device *device)
{
    if (device->pending & PENDING_HELLO && !send_hello(device))
        return;
    device->pending &= (uint8_t)~PENDING_HELLO;
    if (device->pending & PENDING_ACKNOWLEDGE && send_short(device, ACKNOWLEDGE, device->refused, device->acknowledged))
        device->pending ^= PENDING_ACKNOWLEDGE;
    if (device->pending & PENDING_ERROR && send_short(device, ERROR, device->error, device->detail))
        device->pending ^= PENDING_ERROR;
}

static void switch_off(struct haptic_device *device)
{
    /* Disabled first: the interrupt trips only what is enabled. */
    device->enabled = false;
    device->config->motor_off(device->config->context);
    if (device->trip) {
        device->tripped = true;
        device->trip = false;
    }
}

static void report(struct haptic_device *device, uint8_t error, uint32_t detail)
{
    /* A complaint about a message must not displace the reason why the motors are off. */
    if (error == HAPTIC_DEVICE_BAD_MESSAGE && device->pending & PENDING_ERROR)
        return;
    device->error = error;
    device->detail = detail;
    device->pending |= PENDING_ERROR;
}

static void on_hello(struct haptic_device *device, uint32_t nonce, uint32_t now)
{
    switch_off(device);
    device->nonce = nonce;
    device->newest = device->newest_command = device->sequence = 0;
    device->tripped = false;
    device->open = true;
    device->received_us = device->due_us = now;
    device->pending = PENDING_HELLO;
    if (device->lost)
        report(device, HAPTIC_DEVICE_SENSOR, 0);
}

static void on_command(struct haptic_device *device, const uint8_t *message)
{
    const struct haptic_device_config *config = device->config;
    int32_t force_mn[HAPTIC_DEVICE_AXES] = { 0 };
    device->newest_command = device->newest;
    if (!(message[2] & FLAG_ENABLED)) {
        switch_off(device);
        return;
    }
    if (!device->enabled || device->trip)
        return;
    for (uint8_t axis = 0; axis < config->axes; axis++) {
        int32_t force = (int32_t)get32(message + 8 + 4 * axis), limit = (int32_t)config->force_limit_mn[axis];
        force_mn[axis] = force > limit ? limit : force < -limit ? -limit : force;
    }
    config->motor_force(config->context, force_mn);
    /* The interrupt may have switched the motors off inside motor_force, which then switched them on again. */
    if (device->trip)
        switch_off(device);
}

static void on_enable(struct haptic_device *device, const uint8_t *message)
{
    const struct haptic_device_config *config = device->config;
    /* An enable of enabled motors also means zero force until the next command. */
    switch_off(device);
    device->refused = false;
    if (message[2] & FLAG_ENABLED) {
        /* Enabled before motor_on: until then the interrupt repeats motor_off, and would undo it. */
        device->enabled = !device->lost;
        if (device->enabled && config->motor_on && !config->motor_on(config->context))
            switch_off(device);
        device->refused = !device->enabled;
        device->tripped &= device->refused;
        if (device->trip)
            switch_off(device);
    }
    device->acknowledged = device->newest;
    device->pending |= PENDING_ACKNOWLEDGE;
}

/* Of a message from the host; other kinds are refused whatever their length. */
static uint8_t length_of(const struct haptic_device *device, uint8_t kind)
{
    return kind == HOST_HELLO ? 8 : kind == COMMAND && device->config->axes > 1 ? 16 : 12;
}

static void receive(struct haptic_device *device, const uint8_t *message, uint8_t length, uint32_t now)
{
    uint8_t kind = message[0], version = message[1];
    uint32_t number = get32(message + 4);
    /* A message of a device is an echo on the line; an answer to it would come back as well. */
    if (kind < HOST_HELLO)
        return;
    if (version != VERSION || kind > ENABLE || length != length_of(device, kind)) {
        /* Also while silent: a host of another version must learn which one this is. */
        report(device, HAPTIC_DEVICE_BAD_MESSAGE, kind | (uint32_t)version << 8 | (uint32_t)length << 16);
        return;
    }
    if (kind == HOST_HELLO) {
        on_hello(device, number, now);
    } else if (device->open && (int32_t)(number - device->newest) > 0) {
        device->newest = number;
        device->received_us = device->commanded_us = now;
        device->fed = true;
        if (kind == COMMAND)
            on_command(device, message);
        else
            on_enable(device, message);
    }
}

/* Undoes COBS and adds up the CRC while a frame comes, so that little is left to do at its end. */
static void take_bytes(struct haptic_device *device, const uint8_t *at, const uint8_t *end, uint32_t now)
{
    uint8_t length = device->length, distance = device->distance;
    uint32_t crc = device->crc;
    for (; at != end; at++) {
        uint8_t byte = *at;
        if (byte == 0) {
            /* The shortest message has kind and version. A frame that fills the buffer was too long. */
            if (crc == CRC_RESIDUE && distance == 0 && length >= 1 + 2 + CRC_BYTES && length != sizeof device->frame)
                receive(device, device->frame + 1, length - 1 - CRC_BYTES, now);
            length = distance = 0;
            continue;
        }
        /* In the place of a zero stands the distance to the next; before the message is one more. */
        if (distance == 0) {
            distance = byte;
            byte = 0;
        }
        distance--;
        crc = length == 0 ? CRC_START : crc_add(crc, byte);
        if (length < sizeof device->frame)
            device->frame[length++] = byte;
    }
    device->length = length;
    device->distance = distance;
    device->crc = crc;
}

/* What the time ends: the force, and the conversation. */
static void watch(struct haptic_device *device, uint32_t now)
{
    if (device->enabled && now - device->commanded_us >= device->watchdog_us)
        device->trip = true;
    if (device->trip)
        switch_off(device);
    if (device->open && now - device->received_us >= SILENCE_US) {
        switch_off(device);
        device->open = false;
        device->pending = 0;
    }
}

bool haptic_device_init(struct haptic_device *device, const struct haptic_device_config *config)
{
    memset(device, 0, sizeof *device);
    if (!config->motor_off)
        return false;
    config->motor_off(config->context);
    if (!config->clock_us || !config->motor_force || !config->read || !config->write || !config->name
        || config->axes < 1 || config->axes > HAPTIC_DEVICE_AXES || config->watchdog_ms > 200
        || config->sample_rate_hz < 10 || config->sample_rate_hz > 20000)
        return false;
    /* Positive floats are in the order of their bits: 1 to 1e10, without float arithmetic. */
    for (uint8_t axis = 0; axis < config->axes; axis++) {
        uint32_t bits = bits_of(config->counts_per_metre[axis]);
        if (bits < 0x3F800000 || bits > 0x501502F9 || config->force_limit_mn[axis] > INT32_MAX)
            return false;
    }
    device->period_us = 1000000 / config->sample_rate_hz;
    device->watchdog_us = 1000 * (uint32_t)(config->watchdog_ms ? config->watchdog_ms : 50);
    device->due_us = config->clock_us(config->context);
    device->config = config;
    return true;
}

void haptic_device_sample(struct haptic_device *device, const struct haptic_sample *sample)
{
    const struct haptic_device_config *config = device->config;
    uint8_t message[40 + CRC_BYTES], *at = message;
    if (!config)
        return;
    if (sample->lost && !device->lost)
        haptic_device_fault(device, HAPTIC_DEVICE_SENSOR, 0);
    device->lost = sample->lost;
    if (!device->open || device->pending & PENDING_HELLO)
        return;
    *at++ = config->wide ? WIDE_SAMPLE : SAMPLE;
    *at++ = VERSION;
    *at++ = (device->enabled && !device->trip ? FLAG_ENABLED : 0)
        | (device->tripped || device->trip ? FLAG_TRIPPED : 0);
    *at++ = config->buttons ? config->buttons(config->context) : 0;
    at = put32(at, device->sequence++);
    at = put32(at, sample->time_us);
    for (uint8_t axis = 0; axis < config->axes; axis++) {
        at = put32(at, (uint32_t)sample->count[axis]);
        if (axis == 0)
            at = put32(at, device->newest_command);
        if (config->wide)
            at = put32(put32(at, (uint32_t)sample->hand_force_mn[axis]), (uint32_t)sample->acceleration_mm_s2[axis]);
    }
    /* One that the line does not take is lost; the sequence shows it. */
    send(config, message, at);
}

void haptic_device_fault(struct haptic_device *device, uint8_t error, uint32_t detail)
{
    if (!device->config)
        return;
    switch_off(device);
    if (device->open)
        report(device, error, detail);
}

/* Measures when a sample is due, on a fixed grid. Samples that the loop is too late for are left out. */
static void measure(struct haptic_device *device, uint32_t now)
{
    uint32_t late = now - device->due_us, period = device->period_us;
    if ((int32_t)late < 0)
        return;
    struct haptic_sample sample = { .time_us = now };
    /* The next one is at least 7/8 of a period away. A division only where one was missed: it is slow without hardware. */
    device->due_us += late < period - period / 8 ? period : period + (late + period / 8) / period * period;
    device->config->measure(device->config->context, &sample);
    haptic_device_sample(device, &sample);
}

void haptic_device_poll(struct haptic_device *device)
{
    const struct haptic_device_config *config = device->config;
    uint8_t bytes[HAPTIC_DEVICE_REPORT], length;
    if (!config)
        return;
    uint32_t now = config->clock_us(config->context);
    watch(device, now);
    /* Before receiving, so that it is punctual whatever the host sends. */
    if (config->measure)
        measure(device, now);
    if (device->pending)
        send_pending(device);
    length = config->read(config->context, bytes, config->hid ? sizeof bytes : READ_BYTES);
    if (!config->hid)
        take_bytes(device, bytes, bytes + length, now);
    else if (length != 0 && length >= length_of(device, bytes[0]))
        receive(device, bytes, length_of(device, bytes[0]), now);
    if (device->pending)
        send_pending(device);
}

void haptic_device_watchdog_from_isr(struct haptic_device *device, uint16_t elapsed_us)
{
    const struct haptic_device_config *config = device->config;
    if (!config)
        return;
    if (device->fed || !device->enabled) {
        device->fed = false;
        device->quiet_us = elapsed_us; /* as a command may have come right after the last interrupt */
    } else {
        device->quiet_us += elapsed_us;
        if (device->quiet_us >= device->watchdog_us)
            device->trip = true;
    }
    /* Again and again: the loop may hang anywhere, also behind the line that drives. */
    if (device->trip || !device->enabled)
        config->motor_off(config->context);
}

enum haptic_device_state haptic_device_state(const struct haptic_device *device)
{
    return !device->open ? HAPTIC_DEVICE_SILENT
        : device->enabled && !device->trip ? HAPTIC_DEVICE_ENABLED : HAPTIC_DEVICE_OPEN;
}
