/* Two watchdogs. This one counts, in the interrupt of the sample clock, how long the host has been quiet, and needs nothing of the main loop. The other,
 * the AVR's own, resets the processor when the main loop or that interrupt no longer comes round. */
#ifndef WATCHDOG_H
#define WATCHDOG_H

#include "config.h"
#include "motor.h"

#include <stdbool.h>
#include <stdint.h>

#define WATCHDOG_MS 50
#define WATCHDOG_TICKS (WATCHDOG_MS * SAMPLE_RATE_HZ / 1000)
#define SILENCE_TICKS SAMPLE_RATE_HZ

/* Whether samples are sent: from a hello to a second without a valid message. */
extern volatile bool watchdog_open;
/* Whether the motor was switched off because no command came. */
extern volatile bool watchdog_bitten;

/* Ticks of the sample clock since the newest command, and since the newest message. */
extern volatile uint8_t watchdog_command_age;
extern volatile uint16_t watchdog_message_age;

void watchdog_init(void);

/* A command or an enable has come: the motor may go on. */
void watchdog_command(void);

/* A valid message has come: the host is there. */
void watchdog_message(void);

/* Called by the main loop, which is alive; and the sample clock is if it has ticked in between. */
void watchdog_alive(void);

extern volatile bool watchdog_ticked;

/* In the interrupt of the sample clock. */
static inline void watchdog_tick(void)
{
    watchdog_ticked = true;
    if (motor_enabled && ++watchdog_command_age >= WATCHDOG_TICKS) {
        motor_off();
        watchdog_bitten = true;
    }
    if (watchdog_open && ++watchdog_message_age >= SILENCE_TICKS) {
        motor_off();
        watchdog_open = false;
    }
}

#endif
