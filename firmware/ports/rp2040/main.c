/* Firmware for an RP2040 of one or two axes, without pico-sdk, for rp2040js: it sets neither clocks nor pins, which the
 * simulator does not need and pico-sdk does on a board. UART 0 is the line at 1 Mbaud, PWM slices 0 and 1 are the motors,
 * alarm 0 of the timer is the independent timer, the chip's watchdog the hardware watchdog. Words at the end of the
 * memory stand for the encoders, and for the fault that rig.mjs plants. */
#include "haptic_device.h"
#include "startup.h"

struct uart { uint32_t data, unused[5], flags, unused_too[2], divisor, fraction, format, control, levels, interrupts; };
struct timer { uint32_t unused[4], alarm[4], armed, raw_high, raw_low, debug, pause, pending, interrupts; };
struct pwm { uint32_t control, divider, counter, duty, top; }; /* of the duty, the upper half is the negative force */
#define UART0 ((volatile struct uart *)0x40034000)
enum uart_flag { UART_RECEIVED_NOTHING = 1 << 4, UART_FULL = 1 << 5 };
#define PWM ((volatile struct pwm *)0x40050000)
#define TIMER ((volatile struct timer *)0x40054000)
#define RESETS REGISTER(0x4000C000)
#define WATCHDOG_CONTROL REGISTER(0x40058000)
#define WATCHDOG_LOAD REGISTER(0x40058004)
#define INTERRUPTS_ON REGISTER(0xE000E100)
#define ENCODERS ((volatile int32_t *)0x20040000)
#define FAULT REGISTER(0x20040008)
#define KICK() (WATCHDOG_LOAD = 2 * 30000) /* 30 ms: it counts twice a microsecond (erratum RP2040-E1) */
enum { TICK_US = 1000, PWM_PERIOD = 2000, LIMIT_MN = 20000 };
enum fault { NONE, HANG_LOOP, HANG_WRITE, HANG_CLOCK, HANG_DEAF, HANG_KICKING, CUT };

static struct haptic_device device;
static struct haptic_device_config config;
static volatile uint8_t received[256], received_head, received_tail;
static uint8_t to_send[256], to_send_head, to_send_tail;
static volatile bool has_ticked;
static uint32_t alarm_us;

static uint32_t clock_us(void *context)
{
    static uint32_t us;
    (void)context;
    if (FAULT != HANG_CLOCK)
        us = TIMER->raw_low;
    return us;
}

static void measure(void *context, struct haptic_sample *sample)
{
    (void)context;
    for (int i = 0; i < AXES; i++)
        sample->count[i] = ENCODERS[i];
    sample->lost = FAULT == CUT;
}

static void motor_force(void *context, const int32_t force_mn[])
{
    (void)context;
    for (int i = 0; i < AXES; i++) {
        uint32_t duty = (uint32_t)(force_mn[i] < 0 ? -force_mn[i] : force_mn[i]) * PWM_PERIOD / LIMIT_MN;
        PWM[i].duty = force_mn[i] < 0 ? duty << 16 : duty;
    }
}

static void motor_off(void *context)
{
    (void)context;
    PWM[0].duty = PWM[1].duty = 0;
}

static uint8_t take(void *context, uint8_t *bytes, uint8_t room)
{
    uint8_t length = 0;
    (void)context;
    while (length < room && received_tail != received_head)
        bytes[length++] = received[received_tail++];
    return length;
}

static bool give(void *context, const uint8_t *bytes, uint8_t length)
{
    (void)context;
    while (FAULT == HANG_WRITE)
        ;
    if ((uint8_t)(to_send_tail - to_send_head - 1) < length)
        return false;
    while (length--)
        to_send[to_send_head++] = *bytes++;
    return true;
}

static void on_received(void)
{
    while (!(UART0->flags & UART_RECEIVED_NOTHING)) {
        received[received_head] = (uint8_t)UART0->data;
        if ((uint8_t)(received_head + 1) != received_tail)
            received_head++;
    }
}

static void on_alarm(void)
{
    TIMER->pending = 1;
    TIMER->alarm[0] = alarm_us += TICK_US;
    has_ticked = true;
    haptic_device_watchdog_from_isr(&device, TICK_US);
}

/* The planted faults of the loop. */
static void hang(void)
{
    if (FAULT == HANG_DEAF)
        __asm volatile("cpsid i");
    while (FAULT == HANG_LOOP || FAULT == HANG_DEAF || FAULT == HANG_KICKING)
        if (FAULT == HANG_KICKING)
            KICK();
}

int main(void)
{
    config = (struct haptic_device_config){ .name = "rp2040 0.2.0", .axes = AXES, .sample_rate_hz = 1000000 / TICK_US,
        .counts_per_metre = { 100000, 100000 }, .force_limit_mn = { LIMIT_MN, LIMIT_MN }, .clock_us = clock_us, .measure = measure,
        .motor_force = motor_force, .motor_off = motor_off, .read = take, .write = give };
    RESETS = 0;
    haptic_device_init(&device, &config);
    for (int i = 0; i < AXES; i++) {
        PWM[i].top = PWM_PERIOD - 1;
        PWM[i].control = 1;
    }
    UART0->divisor = 8;
    UART0->format = 3 << 5 | 1 << 4; /* 8 bits, with FIFOs */
    UART0->control = 1 | 3 << 8;
    UART0->interrupts = 1 << 4;
    TIMER->interrupts = 1;
    TIMER->alarm[0] = alarm_us = TIMER->raw_low + TICK_US;
    INTERRUPTS_ON = 1 | 1 << 20;
    KICK();
    WATCHDOG_CONTROL = 1 << 30;
    for (;;) {
        haptic_device_poll(&device);
        while (to_send_tail != to_send_head && !(UART0->flags & UART_FULL))
            UART0->data = to_send[to_send_tail++];
        hang();
        if (has_ticked) {
            has_ticked = false;
            KICK();
        }
        __asm volatile("cpsid i");
        if (received_head == received_tail && to_send_head == to_send_tail)
            __asm volatile("wfi");
        __asm volatile("cpsie i");
    }
}

__attribute__((section(".vectors"), used)) static void *const vectors[48] = { [0] = &stack_top, [1] = on_reset, [2] = on_fault,
    [3] = on_fault, [11] = on_fault, [14] = on_fault, [15] = on_fault, [16] = on_alarm, [36] = on_received };
