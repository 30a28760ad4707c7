#include "device.h"

#include "buttons.h"
#include "encoder.h"
#include "link.h"
#include "motor.h"
#include "sample.h"
#include "watchdog.h"

#include <string.h>

#define FIRMWARE "hapkit 0.1.0 "

/* Sequence of the newest message of the host that was accepted, and of the newest command. */
static uint32_t newest, newest_command;

static void send_error(uint8_t code, uint32_t detail)
{
    struct error error = { .kind = KIND_ERROR, .version = PROTOCOL_VERSION, .code = code, .detail = detail };
    link_send(&error, sizeof error);
}

static void hello(const struct host_hello *asked)
{
    struct device_hello answer = {
        .kind = KIND_DEVICE_HELLO,
        .version = PROTOCOL_VERSION,
        .buttons = BUTTONS_THERE,
        .nonce = asked->nonce,
        .counts_per_metre = encoder_counts_per_metre,
        .force_limit_mn = (uint32_t)(1000.0 * FORCE_LIMIT_N),
        .sample_rate_hz = SAMPLE_RATE_HZ,
        .watchdog_ms = WATCHDOG_MS,
        .firmware = FIRMWARE,
    };
    strncpy(answer.firmware + sizeof FIRMWARE - 1, encoder_name, sizeof answer.firmware - sizeof FIRMWARE + 1);
    motor_off();
    newest = newest_command = 0;
    watchdog_bitten = false;
    sample_begin();
    watchdog_open = true;
    link_send(&answer, sizeof answer);
}

static bool accept(uint32_t sequence)
{
    if ((int32_t)(sequence - newest) <= 0)
        return false;
    newest = sequence;
    return true;
}

static void command(const struct command *command)
{
    newest_command = command->sequence;
    watchdog_command();
    if (command->flags & FLAG_ENABLED)
        motor_drive(command->force_mn);
    else
        motor_off();
}

static void enable(const struct command *enable)
{
    bool on = enable->flags & FLAG_ENABLED;
    struct acknowledge answer = { .kind = KIND_ACKNOWLEDGE, .version = PROTOCOL_VERSION, .sequence = enable->sequence };
    if (!on) {
        motor_off();
    } else if (sample_is_lost) {
        answer.refused = 1;
    } else {
        watchdog_command();
        watchdog_bitten = false;
        motor_enable();
    }
    link_send(&answer, sizeof answer);
}

void device_receive(const void *message, uint8_t length)
{
    const uint8_t *bytes = message;
    uint8_t kind = bytes[0], version = length > 1 ? bytes[1] : 0;
    /* A message for the other direction is an echo of the line; an answer to it would come back
     * as well. */
    if (kind < KIND_HOST_HELLO)
        return;
    if (version == PROTOCOL_VERSION) {
        if (kind == KIND_HOST_HELLO && length == sizeof(struct host_hello)) {
            watchdog_message();
            hello(message);
            return;
        }
        if ((kind == KIND_COMMAND || kind == KIND_ENABLE) && length == sizeof(struct command)) {
            const struct command *order = message;
            if (!watchdog_open || !accept(order->sequence))
                return;
            watchdog_message();
            if (kind == KIND_COMMAND)
                command(order);
            else
                enable(order);
            return;
        }
    }
    /* Also while silent: a host of another version must learn which version this is. */
    send_error(ERROR_BAD_MESSAGE, kind | (uint32_t)version << 8 | (uint32_t)length << 16);
}

void device_send(struct sample *sample)
{
    sample->kind = KIND_SAMPLE;
    sample->version = PROTOCOL_VERSION;
    sample->flags = (motor_enabled ? FLAG_ENABLED : 0) | (watchdog_bitten ? FLAG_WATCHDOG : 0);
    sample->buttons = buttons_pressed();
    sample->command = newest_command;
    if (watchdog_open)
        link_send(sample, sizeof *sample);
}

void device_watch_position(void)
{
    static bool told;
    bool is_lost = sample_is_lost;
    if (is_lost && !told && watchdog_open)
        send_error(ERROR_SENSOR, 0);
    told = is_lost;
}
