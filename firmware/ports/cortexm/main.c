/* Firmware for a Cortex-M3 or M4 of one or two axes, on QEMU's mps2-an385 and -an386. Their UART takes 70 us a byte, so
 * line, motors and encoders are registers in shared memory. SysTick is the independent timer, and the CMSDK's watchdog the
 * hardware watchdog: its first end is an interrupt that nothing masks, its second a reset. */
#include "haptic_device.h"

#include "shared.h"
#include "startup.h"

#define SHARED ((struct shared *)0x21000000)
#define CORE_HZ 25000000
#define TICK_US 100
#define WATCHDOG_MS 200 /* of QEMU's time, of which a hung board gets 1 ms for 0.2 ms of the rig's: 40 ms of that */
/* Turns that are waited before sleeping, as the rig may have time to make up for. */
#define SPINS 1000

#define SYSTICK_CONTROL REGISTER(0xE000E010)
#define SYSTICK_RELOAD REGISTER(0xE000E014)
#define RESET_CONTROL REGISTER(0xE000ED0C)
#define WATCHDOG_LOAD REGISTER(0x40008000)
#define WATCHDOG_CONTROL REGISTER(0x40008008)
#define WATCHDOG_CLEAR REGISTER(0x4000800C)

static struct haptic_device device;
static struct haptic_device_config config;
static volatile bool has_ticked;

static uint32_t clock_us(void *context)
{
    static uint32_t us;
    (void)context;
    if (SHARED->fault != HANG_CLOCK)
        us = SHARED->time_us;
    return us;
}

static void measure(void *context, struct haptic_sample *sample)
{
    (void)context;
    for (int i = 0; i < config.axes; i++)
        sample->count[i] = SHARED->count[i];
    sample->lost = SHARED->is_cut;
}

static void motor_force(void *context, const int32_t force_mn[])
{
    (void)context;
    for (int i = 0; i < config.axes; i++)
        SHARED->force_mn[i] = force_mn[i];
}

static void motor_off(void *context)
{
    (void)context;
    SHARED->force_mn[0] = SHARED->force_mn[1] = 0;
}

static uint8_t take(void *context, uint8_t *bytes, uint8_t room)
{
    struct ring *ring = &SHARED->to_board;
    uint8_t length = 0;
    (void)context;
    for (; length < room && ring->tail != ring->head; ring->tail++)
        bytes[length++] = ring->bytes[ring->tail % RING_BYTES];
    return length;
}

static bool give(void *context, const uint8_t *bytes, uint8_t length)
{
    struct ring *ring = &SHARED->from_board;
    (void)context;
    while (SHARED->fault == HANG_WRITE)
        ;
    if (RING_BYTES - (ring->head - ring->tail) < length)
        return false;
    for (uint8_t i = 0; i < length; i++, ring->head++)
        ring->bytes[ring->head % RING_BYTES] = bytes[i];
    return true;
}

static void kick(void)
{
    WATCHDOG_CLEAR = 1;
}

/* The planted faults of the loop. */
static void hang(void)
{
    if (SHARED->fault == HANG_DEAF)
        __asm volatile("cpsid i");
    while (SHARED->fault == HANG_LOOP || SHARED->fault == HANG_DEAF)
        ;
    while (SHARED->fault == HANG_KICKING)
        kick();
    if (SHARED->fault == RESET)
        RESET_CONTROL = 0x05FA0004;
}

static void on_systick(void)
{
    static uint32_t last_us;
    uint32_t elapsed_us = SHARED->time_us - last_us;
    last_us += elapsed_us;
    has_ticked = true;
    if (elapsed_us != 0)
        haptic_device_watchdog_from_isr(&device, (uint16_t)(elapsed_us < 5000 ? elapsed_us : 5000));
}

int main(void)
{
    config = (struct haptic_device_config){ .name = "cortex-m 0.2.0", .axes = (uint8_t)SHARED->axes, .sample_rate_hz = 1000,
        .counts_per_metre = { 100000, 100000 }, .force_limit_mn = { 20000, 20000 }, .clock_us = clock_us, .measure = measure,
        .motor_force = motor_force, .motor_off = motor_off, .read = take, .write = give };
    SHARED->fault = NONE;
    haptic_device_init(&device, &config);
    SHARED->boots++;
    SYSTICK_RELOAD = CORE_HZ / 1000000 * TICK_US - 1;
    SYSTICK_CONTROL = 7;
    WATCHDOG_LOAD = CORE_HZ / 1000 * WATCHDOG_MS / 2;
    WATCHDOG_CONTROL = 3;
    for (;;) {
        uint32_t now_us = SHARED->time_us;
        haptic_device_poll(&device);
        SHARED->seen_us = now_us;
        hang();
        if (has_ticked) {
            has_ticked = false;
            kick();
        }
        for (int i = 0; i < SPINS && SHARED->time_us == now_us; i++)
            ;
        if (SHARED->time_us == now_us)
            __asm volatile("wfi");
    }
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = { &stack_top, on_reset, on_fault, on_fault, on_fault,
    on_fault, on_fault, 0, 0, 0, 0, on_fault, on_fault, 0, on_fault, on_systick };
