/* What an image for a Cortex-M does before main, and where it crashes. A port's main.c includes it last, has main and
 * motor_off, and lists its interrupts. */
#ifndef STARTUP_H
#define STARTUP_H

#include <stdint.h>
#include <string.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* Of sections.ld. */
extern uint32_t data_source, data_begin, data_end, bss_begin, bss_end, stack_top;

int main(void);
static void motor_off(void *context);

static void on_reset(void)
{
    motor_off(NULL);
    memcpy(&data_begin, &data_source, (size_t)((char *)&data_end - (char *)&data_begin));
    memset(&bss_begin, 0, (size_t)((char *)&bss_end - (char *)&bss_begin));
    main();
}

/* Until the hardware watchdog resets. */
static void on_fault(void)
{
    for (;;)
        motor_off(NULL);
}

#endif
