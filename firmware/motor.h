/* The motor: PWM of 62.5 kHz on D5 (OC0B), direction on D8. */
#ifndef MOTOR_H
#define MOTOR_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

/* Whether the motor may be driven. */
extern volatile bool motor_enabled;

/* The first thing after a reset. */
void motor_init(void);

/* The motor may be driven from now on; it gives no force until it is. */
void motor_enable(void);

/* The force on the hand from now on, mN, cut to the limit; nothing where the motor is off. */
void motor_drive(int32_t force_mn);

#define PWM_OFF (1 << WGM01 | 1 << WGM00)
#define PWM_ON (PWM_OFF | 1 << COM0B1)

/* No force, at once: the pin leaves the timer and is low. One store and one bit, so an interrupt may call it at any time. */
static inline void motor_zero(void)
{
    TCCR0A = PWM_OFF;
    PORTD &= ~(1 << PD5);
}

/* No force until the next enable. */
static inline void motor_off(void)
{
    motor_zero();
    motor_enabled = false;
}

#endif
