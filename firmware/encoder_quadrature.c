/* A quadrature encoder on the motor's shaft: channel A on D2, B on D3. Each edge of either is a count. */
#include "clock.h"
#include "encoder.h"

#include <avr/interrupt.h>
#include <avr/io.h>

const char encoder_name[] = "quadrature";
const float encoder_counts_per_metre = COUNTS_PER_METRE;

/* 16 bits are quicker to count than 32, and a tick is too short for them to wrap around. */
static volatile uint16_t edges;
static volatile bool is_lost;
static uint8_t phase;

/* The two channels are a Gray code of the phase, a quarter of a line each. */
static inline uint8_t read_phase(void)
{
    uint8_t pins = PIND >> PD2;
    return (pins ^ pins >> 1) & 3;
}

void encoder_init(void)
{
    PORTD |= 1 << PD2 | 1 << PD3; /* pull-ups, for encoders that only pull down */
    EICRA = 1 << ISC00 | 1 << ISC10; /* every edge */
    EIMSK = 1 << INT0 | 1 << INT1;
    phase = read_phase();
}

ISR(INT0_vect)
{
    uint8_t now = read_phase();
    uint8_t turned = (now - phase) & 3;
    phase = now;
    if (turned == 1)
        edges++;
    else if (turned == 3)
        edges--;
    else if (turned == 2)
        is_lost = true; /* two edges at once: nobody knows which way */
}

ISR(INT1_vect, ISR_ALIASOF(INT0_vect));

void encoder_tick(uint32_t tick_us)
{
    static uint16_t last_edges;
    static int32_t count;
    uint32_t time_us = tick_us + clock_since_tick_us();
    uint16_t now = edges;
    bool was_lost = is_lost;
    is_lost = false;
    /* The rest of this interrupt does not concern the edges, which at speed are closer together than it is long. */
    sei();
    count += (int16_t)(now - last_edges);
    last_edges = now;
    sample_take(time_us, count, was_lost);
}
