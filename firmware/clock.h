/* The sample clock: timer 1 ticks SAMPLE_RATE_HZ times a second, and counts half microseconds in between. */
#ifndef CLOCK_H
#define CLOCK_H

#include "config.h"

#include <avr/io.h>
#include <stdint.h>

#define CLOCK_PRESCALER 8
#define CLOCK_COUNTS (F_CPU / CLOCK_PRESCALER / SAMPLE_RATE_HZ)
#define COUNTS_PER_US (F_CPU / CLOCK_PRESCALER / 1000000)
#define TICK_US (1000000 / SAMPLE_RATE_HZ)

_Static_assert(CLOCK_COUNTS <= 65536 && CLOCK_COUNTS * SAMPLE_RATE_HZ * CLOCK_PRESCALER == F_CPU, "timer 1 cannot make this sample rate exactly");
_Static_assert(TICK_US * SAMPLE_RATE_HZ == 1000000, "a tick is a whole number of microseconds");

static inline void clock_init(void)
{
    TCCR1B = 1 << WGM12 | 1 << CS11; /* counts to OCR1A and begins again, at an eighth of the processor's clock */
    OCR1A = CLOCK_COUNTS - 1;
    TIMSK1 = 1 << OCIE1A;
}

/* Time since the tick, us. */
static inline uint16_t clock_since_tick_us(void)
{
    return TCNT1 / COUNTS_PER_US;
}

#endif
