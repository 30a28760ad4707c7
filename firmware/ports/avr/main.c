/* Firmware for a rig with an ATmega328P at 16 MHz and a Hapkit's pins: docs/board.md says how to wire and flash it. */
#include "haptic_device.h"

#include "buttons.h"
#include "clock.h"
#include "encoder.h"
#include "motor.h"
#include "uart.h"

#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <string.h>
#include <util/atomic.h>

#define FIRMWARE "hapkit 0.2 "
#define MAX_NUMBER 6
#define AS_TEXT(what) TEXT_OF(what)
#define TEXT_OF(what) #what

static struct haptic_device device;
static uint32_t tick_us;
/* The newest sample, by an interrupt. */
static struct haptic_sample newest;

/* The AVR's watchdog stays on through the reset that it makes, at 16 ms: off with it before anything that takes longer. */
void watchdog_stop(void) __attribute__((naked, used, section(".init3")));
void watchdog_stop(void)
{
    MCUSR = 0;
    wdt_disable();
}

ISR(TIMER1_COMPA_vect)
{
    tick_us += TICK_US;
    WORK |= 1 << WORK_MEASURING;
    encoder_tick(tick_us);
    haptic_device_watchdog_from_isr(&device, TICK_US);
}

void sample_take(uint32_t time_us, int32_t count, bool is_lost)
{
    if (is_lost)
        motor_off();
    newest.time_us = time_us;
    newest.count[0] = count;
    /* The motor is off; a loop that was late for this sample must learn it too. */
    newest.lost |= is_lost;
    WORK |= 1 << WORK_SAMPLE;
}

static uint32_t clock_us(void *context)
{
    uint32_t now;
    (void)context;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) now = tick_us;
    return now;
}

static void drive(void *context, const int32_t force_mn[])
{
    (void)context;
    motor_drive(force_mn[0]);
}

static void off(void *context)
{
    (void)context;
    motor_off();
}

static bool on(void *context)
{
    (void)context;
    motor_enable();
    return true;
}

static uint8_t pressed(void *context)
{
    (void)context;
    return buttons_pressed();
}

static uint8_t take(void *context, uint8_t *bytes, uint8_t room)
{
    (void)context;
    return uart_receive(bytes, room);
}

static uint8_t room(void *context)
{
    (void)context;
    return uart_room();
}

static bool give(void *context, const uint8_t *bytes, uint8_t length)
{
    (void)context;
    if (uart_room() < length)
        return false;
    uart_send(bytes, length);
    return true;
}

/* Firmware, encoder and, if it was given one, the board's number, as the chip has none. */
static const char *name_of_board(void)
{
    static char name[sizeof FIRMWARE + 8 + 1 + MAX_NUMBER] = FIRMWARE;
    strcat(name, encoder_name);
    if (*AS_TEXT(NUMBER))
        strcat(strcat(name, "#"), AS_TEXT(NUMBER));
    return name;
}
_Static_assert(sizeof AS_TEXT(NUMBER) <= 1 + MAX_NUMBER, "NUMBER has at most six letters or digits");

int main(void)
{
    static struct haptic_device_config config = { .axes = 1, .buttons_there = BUTTONS_THERE,
        .sample_rate_hz = SAMPLE_RATE_HZ, .force_limit_mn = { (uint32_t)(1000.0 * FORCE_LIMIT_N) }, .clock_us = clock_us,
        .motor_force = drive, .motor_off = off, .motor_on = on, .buttons = pressed, .read = take, .write = give,
        .room = room };
    static struct haptic_sample sample;
    motor_init();
    buttons_init();
    encoder_init();
    config.name = name_of_board();
    config.counts_per_metre[0] = encoder_counts_per_metre;
    haptic_device_init(&device, &config);
    uart_init();
    clock_init();
    /* 32 ms, by an oscillator that is good for 10 percent: a processor that hangs is stopped within 50 ms too. */
    wdt_enable(WDTO_30MS);
    set_sleep_mode(SLEEP_MODE_IDLE);
    for (;;) {
        /* A frame waits while a sample is on its way, which then leaves in time. */
        cli();
        while (!(WORK & 1 << WORK_SAMPLE) && (WORK & (1 << WORK_MEASURING | 1 << WORK_FRAME)) != 1 << WORK_FRAME) {
            /* Sleeps until the next interrupt. One before sei wakes it too, as sei lets one more instruction pass. */
            sleep_enable();
            sei();
            sleep_cpu();
            sleep_disable(); /* before cli: in simavr the interrupt comes one instruction late */
            cli();
        }
        bool is_due = WORK & 1 << WORK_SAMPLE;
        if (is_due) {
            sample.time_us = newest.time_us;
            sample.count[0] = newest.count[0];
            sample.lost = newest.lost;
            newest.lost = false;
        }
        WORK = 0;
        sei();
        if (is_due)
            haptic_device_sample(&device, &sample);
        haptic_device_poll(&device);
        /* Loop, sample clock and, of the magneto-resistive sensor, converter are alive. */
        if (is_due)
            wdt_reset();
    }
}
