/* The messages of the link protocol, version 1, byte for byte as docs/device-protocol.md lists them. The AVR is little-endian and packs without
 * gaps, so a message on the line is the struct in memory. */
#ifndef MESSAGE_H
#define MESSAGE_H

#include <stdint.h>

#define PROTOCOL_VERSION 1

enum kind {
    KIND_DEVICE_HELLO = 0x01,
    KIND_SAMPLE = 0x02,
    KIND_WIDE_SAMPLE = 0x03,
    KIND_ACKNOWLEDGE = 0x04,
    KIND_ERROR = 0x05,
    KIND_HOST_HELLO = 0x11,
    KIND_COMMAND = 0x12,
    KIND_ENABLE = 0x13,
};

enum error_code { ERROR_BAD_MESSAGE = 1, ERROR_SENSOR = 2, ERROR_MOTOR = 3 };

#define FLAG_ENABLED 0x01
#define FLAG_WATCHDOG 0x02

struct device_hello {
    uint8_t kind, version, flags, buttons;
    uint32_t nonce;
    float counts_per_metre;
    uint32_t force_limit_mn, sample_rate_hz;
    uint16_t watchdog_ms, reserved;
    char firmware[24];
};

struct sample {
    uint8_t kind, version, flags, buttons;
    uint32_t sequence, time_us;
    int32_t count;
    uint32_t command;
};

struct acknowledge {
    uint8_t kind, version, refused, reserved;
    uint32_t sequence;
};

struct error {
    uint8_t kind, version, code, reserved;
    uint32_t detail;
};

struct host_hello {
    uint8_t kind, version;
    uint16_t reserved;
    uint32_t nonce;
};

/* A command and an enable begin alike. */
struct command {
    uint8_t kind, version, flags, reserved;
    uint32_t sequence;
    int32_t force_mn;
};

_Static_assert(sizeof(struct device_hello) == 48, "hello");
_Static_assert(sizeof(struct sample) == 20, "sample");
_Static_assert(sizeof(struct acknowledge) == 8, "acknowledge");
_Static_assert(sizeof(struct error) == 8, "error");
_Static_assert(sizeof(struct host_hello) == 8, "host hello");
_Static_assert(sizeof(struct command) == 12, "command and enable");

#define LONGEST_MESSAGE 48

#endif
