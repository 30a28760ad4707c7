/* The Hapkit's magneto-resistive sensor on A2. Its voltage rises with half a turn of the motor's shaft and then flips back to the beginning, so the flips
 * are counted. */
#include "clock.h"
#include "encoder.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#define RANGE (SENSOR_HIGH - SENSOR_LOW + 1)
/* Nobody moves through a quarter of the range in a tick (3.7 m/s at the handle); a reading that says so was taken during a flip. */
#define LARGEST_STEP (RANGE / 4)
#define MAX_RETRIES 3

#define CHANNEL 2
#define START (1 << ADEN | 1 << ADSC | 1 << ADIE | 1 << ADPS2 | 1 << ADPS1) /* 250 kHz: 10 bits in 52 us */
#define HOLD_US 6 /* the input is held after one and a half clocks of the converter */

const char encoder_name[] = "magneto";
const float encoder_counts_per_metre = 2.0 * RANGE / TRAVEL_PER_TURN_M;

static uint32_t time_of_tick_us;
static volatile uint16_t time_us;
static volatile uint8_t retries;

void encoder_init(void)
{
    ADMUX = 1 << REFS0 | CHANNEL; /* of the supply, which the sensor divides too */
    DIDR0 = 1 << ADC2D;
    ADCSRA = START & ~(1 << ADSC);
}

static inline void start(void)
{
    ADCSRA = START;
    time_us = clock_since_tick_us() + HOLD_US;
}

void encoder_tick(uint32_t tick_us)
{
    time_of_tick_us = tick_us;
    retries = 0;
    start();
}

ISR(ADC_vect)
{
    static int16_t last = -1;
    static int32_t count;
    int16_t reading = ADC;
    /* The sensor keeps away from the rails: at one of them, a wire is off. */
    if (reading < SENSOR_FAULT_MARGIN || reading > 1023 - SENSOR_FAULT_MARGIN) {
        sample_take(time_of_tick_us + time_us, count, true);
        return;
    }
    if (last < 0)
        last = reading;
    int16_t step = reading - last;
    if (step > RANGE / 2)
        step -= RANGE;
    else if (step < -RANGE / 2)
        step += RANGE;
    bool is_lost = step > LARGEST_STEP || step < -LARGEST_STEP;
    if (is_lost && retries++ < MAX_RETRIES) {
        start();
        return;
    }
    last = reading;
    count += step;
    sample_take(time_of_tick_us + time_us, count, is_lost);
}
