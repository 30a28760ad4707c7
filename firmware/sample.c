#include "sample.h"

#include "clock.h"
#include "encoder.h"
#include "watchdog.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

volatile bool sample_is_lost;
static volatile bool is_there;
static uint32_t newest_time_us, next_sequence;
static int32_t newest_count;

ISR(TIMER1_COMPA_vect)
{
    static uint32_t tick_us;
    tick_us += TICK_US;
    encoder_tick(tick_us);
    watchdog_tick();
}

/* A sample that the main loop has not taken is lost, and the sequence shows it. */
void sample_take(uint32_t time_us, int32_t count, bool is_lost)
{
    if (is_lost)
        motor_off();
    sample_is_lost = is_lost;
    newest_time_us = time_us;
    newest_count = count;
    next_sequence++;
    is_there = true;
}

void sample_begin(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        next_sequence = 0;
        is_there = false;
    }
}

bool sample_is_there(void)
{
    return is_there;
}

bool sample_get(struct sample *sample)
{
    if (!is_there)
        return false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        sample->time_us = newest_time_us;
        sample->count = newest_count;
        sample->sequence = next_sequence - 1;
        is_there = false;
    }
    return true;
}
