#include "watchdog.h"

#include <avr/wdt.h>
#include <util/atomic.h>

_Static_assert(WATCHDOG_TICKS > 0 && WATCHDOG_TICKS <= UINT8_MAX, "the age of the newest command has 8 bits");

volatile bool watchdog_open, watchdog_bitten, watchdog_ticked;
volatile uint8_t watchdog_command_age;
volatile uint16_t watchdog_message_age;

/* The AVR's watchdog stays on through the reset that it makes, at 16 ms: off with it before
 * anything that takes longer. */
void watchdog_stop(void) __attribute__((naked, used, section(".init3")));
void watchdog_stop(void)
{
    MCUSR = 0;
    wdt_disable();
}

void watchdog_init(void)
{
    /* 32 ms, by an oscillator that is good for 10 percent: a processor that hangs is stopped
     * within the 50 ms too. */
    wdt_enable(WDTO_30MS);
}

void watchdog_alive(void)
{
    if (watchdog_ticked) {
        watchdog_ticked = false;
        wdt_reset();
    }
}

void watchdog_command(void)
{
    watchdog_command_age = 0;
}

void watchdog_message(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) watchdog_message_age = 0;
}
