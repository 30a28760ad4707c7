#include "buttons.h"

#include <avr/io.h>

void buttons_init(void)
{
    PORTD |= 1 << PD4;
    PORTB |= 1 << PB1;
}

uint8_t buttons_pressed(void)
{
    static uint8_t pressed, count_low, count_high;
    uint8_t now = 0;
    if (!(PIND & 1 << PD4))
        now |= 1;
    if (!(PINB & 1 << PB1))
        now |= 2;
    /* A counter of two bits for each button, that begins anew where the button agrees with what was reported. */
    uint8_t differs = now ^ pressed;
    count_high = (count_high ^ count_low) & differs;
    count_low = ~count_low & differs;
    pressed ^= differs & count_low & count_high;
    return pressed;
}
