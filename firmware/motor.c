#include "motor.h"

#include "config.h"

#include <util/atomic.h>

/* What a millinewton adds to the square of the duty, in units of 2^-24. All of the force is 2^24, so that the product of any force and this has 25 bits. */
#define FORCE_LIMIT_MN ((int32_t)(1000.0 * FORCE_LIMIT_N))
#define SQUARE_OF_MN ((uint32_t)(65536.0 * 256.0 / (1000.0 * FULL_FORCE_N) + 0.5))

_Static_assert(FORCE_LIMIT_N > 0.0 && FORCE_LIMIT_N <= FULL_FORCE_N, "the motor cannot give the force limit");

volatile bool motor_enabled;

void motor_init(void)
{
    motor_off();
    DDRB |= 1 << DDB0;
    DDRD |= 1 << DDD5;
    TCCR0B = 1 << CS00;
}

void motor_enable(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        motor_zero();
        motor_enabled = true;
    }
}

/* To the nearest whole number, but no more than 255. */
static uint8_t square_root(uint16_t square)
{
    uint8_t root = 0;
    for (uint8_t bit = 0x80; bit != 0; bit >>= 1) {
        uint8_t larger = root | bit;
        if ((uint16_t)larger * larger <= square)
            root = larger;
    }
    if (root != UINT8_MAX && square - (uint16_t)root * root > root)
        root++;
    return root;
}

void motor_drive(int32_t force_mn)
{
    bool low = MOTOR_REVERSED;
    if (force_mn < 0) {
        low = !low;
        /* The most negative number has no positive; as an unsigned one it has. */
        force_mn = force_mn < -FORCE_LIMIT_MN ? FORCE_LIMIT_MN : -force_mn;
    }
    if (force_mn > FORCE_LIMIT_MN)
        force_mn = FORCE_LIMIT_MN;
    uint32_t square = (uint32_t)force_mn * SQUARE_OF_MN >> 8;
    uint8_t duty = square_root(square < UINT16_MAX ? square : UINT16_MAX);

    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        /* The watchdog's interrupt may have switched the motor off while this was computed. */
        if (motor_enabled) {
            bool is_low = !(PORTB & 1 << PB0);
            if (duty == 0 || low != is_low)
                motor_zero();
            if (low)
                PORTB &= ~(1 << PB0);
            else
                PORTB |= 1 << PB0;
            if (duty != 0) {
                /* The pin is high for OCR0B + 1 of 256 clocks. */
                OCR0B = duty - 1;
                TCCR0A = PWM_ON;
            }
        }
    }
}
