/* Reference firmware for a rig of hapticd: an ATmega328P at 16 MHz with a Hapkit's pins.
 * README.md says how to build, wire and check it. */
#include "buttons.h"
#include "clock.h"
#include "device.h"
#include "encoder.h"
#include "link.h"
#include "motor.h"
#include "sample.h"
#include "uart.h"
#include "watchdog.h"

#include <avr/interrupt.h>
#include <avr/sleep.h>

int main(void)
{
    motor_init();
    buttons_init();
    encoder_init();
    link_init();
    uart_init();
    clock_init();
    watchdog_init();
    set_sleep_mode(SLEEP_MODE_IDLE);
    for (;;) {
        struct sample sample;
        const void *message;
        uint8_t byte;

        sei();
        watchdog_alive();
        device_watch_position();
        if (sample_get(&sample))
            device_send(&sample);
        /* A sample is never late, whatever the host sends. */
        while (!sample_is_there() && uart_get(&byte)) {
            uint8_t length = link_take(byte, &message);
            if (length != 0)
                device_receive(message, length);
        }

        /* Sleeps until the next interrupt. An interrupt before sei wakes it too, as sei lets one
         * more instruction pass. */
        cli();
        if (!uart_has_byte() && !sample_is_there()) {
            sleep_enable();
            sei();
            sleep_cpu();
            sleep_disable();
        }
    }
}
