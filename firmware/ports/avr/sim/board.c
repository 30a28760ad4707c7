#include "board.h"

#include <simavr/avr_adc.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define QUEUE_BYTES 4096
#define DDRD 0x2a
#define TCNT0 0x46
#define TCCR1B 0x81
#define OCR0B 0x48
#define PWM_CYCLES 256
#define RAM_START 0x100
/* Content of memory that was never written. */
#define PAINT 0xa5
#define PWM_PIN 5
/* The UART of an AVR holds two bytes while it shifts in a third, so a byte may lie there for the
 * time of two, of ten bits each. */
#define UART_PATIENCE (2 * 10 * BOARD_HZ / 1000000)

static avr_t *avr;
static avr_uart_t *uart;
static struct board_stats stats;

static struct interrupt interrupts[] = {
    { .name = "sample clock", .vector = 11 }, { .name = "uart received", .vector = 18 },
    { .name = "uart empty", .vector = 19 },   { .name = "analogue", .vector = 21 },
    { .name = "encoder A", .vector = 1 },     { .name = "encoder B", .vector = 2 },
};
#define SAMPLE_CLOCK (&interrupts[0])
#define UART_RECEIVED (&interrupts[1])
#define INTERRUPTS (sizeof interrupts / sizeof *interrupts)

static struct {
    uint8_t bytes[QUEUE_BYTES];
    size_t length;
} to_board, from_board;

static struct {
    bool level;
    uint64_t since, high, measured_from, last_high;
} pwm;
static bool direction;
static uint64_t last_frame, woken_at;
static bool is_awake = true, is_sample_due, is_frame_begun;

static uint8_t pulls_mask[3], pulls_value[3]; /* of ports B, C and D */

static void (*reset_of_core)(avr_t *);
static uint8_t unpatched[4];
static avr_flashaddr_t patched_at;
static bool is_patched;

/* Standard output is the caller's. */
static void on_log(avr_t *core, const int level, const char *format, va_list arguments)
{
    (void)core;
    if (level <= LOG_WARNING)
        vfprintf(stderr, format, arguments);
}

static void fail(const char *what)
{
    fprintf(stderr, "simulator: %s\n", what);
    exit(1);
}

static bool is_driven(void)
{
    return pwm.level && (avr->data[DDRD] & 1 << PWM_PIN);
}

static void account_pwm(void)
{
    if (is_driven()) {
        pwm.high += avr->cycle - pwm.since;
        pwm.last_high = avr->cycle;
    }
    pwm.since = avr->cycle;
}

static void on_pwm(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    account_pwm();
    pwm.level = value & 1;
}

/* An AVR takes a new duty over at the beginning of a period; libsimavr does at once, which
 * lengthens or shortens the one in which it comes. */
static struct {
    avr_io_write_t write;
    void *param;
    uint8_t value;
} duty;

static avr_cycle_count_t on_period(avr_t *core, avr_cycle_count_t when, void *param)
{
    (void)when, (void)param;
    duty.write(core, OCR0B, duty.value, duty.param);
    return 0;
}

static void on_duty(avr_t *core, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)address, (void)param;
    uint8_t count = core->io[AVR_DATA_TO_IO(TCNT0)].r.c(core, TCNT0, core->io[AVR_DATA_TO_IO(TCNT0)].r.param);
    duty.value = value;
    avr_cycle_timer_register(core, PWM_CYCLES - count + 1, on_period, NULL);
}

static void on_direction(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    direction = value & 1;
}

static void on_sent(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    stats.bytes_out++;
    if (is_frame_begun && is_sample_due) {
        uint64_t took = avr->cycle - SAMPLE_CLOCK->raised_at;
        if (took > stats.longest_to_frame)
            stats.longest_to_frame = took;
        is_sample_due = false;
    }
    is_frame_begun = value == 0;
    if (from_board.length < QUEUE_BYTES)
        from_board.bytes[from_board.length++] = value;
}

static avr_cycle_count_t on_byte_time(avr_t *core, avr_cycle_count_t when, void *param)
{
    (void)core, (void)param;
    if (to_board.length == 0)
        return 0;
    uint8_t byte = to_board.bytes[0];
    memmove(to_board.bytes, to_board.bytes + 1, --to_board.length);
    stats.bytes_in++;
    avr_raise_irq(uart->io.irq + UART_IRQ_INPUT, byte);
    if (byte == 0)
        last_frame = avr->cycle;
    return when + uart->cycles_per_byte;
}

static void on_interrupt_raised(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    struct interrupt *interrupt = param;
    if (!value)
        return;
    interrupt->raised_at = avr->cycle;
    if (interrupt == SAMPLE_CLOCK)
        is_sample_due = true;
}

static void on_interrupt_running(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    struct interrupt *interrupt = param;
    if (value) {
        interrupt->count++;
        interrupt->began_at = avr->cycle;
        uint64_t wait = avr->cycle - interrupt->raised_at;
        if (wait > interrupt->longest_wait)
            interrupt->longest_wait = wait;
        if (interrupt == UART_RECEIVED && wait > UART_PATIENCE)
            stats.overruns++;
    } else {
        uint64_t took = avr->cycle - interrupt->began_at;
        if (took > interrupt->longest)
            interrupt->longest = took;
    }
}

/* Time goes on by the pace of the caller, not by the simulator's own. */
static void on_sleep(avr_t *core, avr_cycle_count_t cycles)
{
    (void)cycles;
    if (is_awake) {
        uint64_t busy = core->cycle - woken_at;
        stats.busy_cycles += busy;
        if (busy > stats.longest_busy)
            stats.longest_busy = busy;
        is_awake = false;
    }
}

static void on_reset(avr_t *core)
{
    stats.resets++;
    account_pwm();
    pwm.level = false;
    is_awake = true;
    woken_at = core->cycle;
    if (is_patched) {
        memcpy(core->flash + patched_at, unpatched, sizeof unpatched);
        is_patched = false;
    }
    reset_of_core(core);
}

static void find_uart(void)
{
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (strcmp(io->kind, "uart") == 0)
            uart = (avr_uart_t *)io;
    if (!uart)
        fail("this core has no UART");
}

void board_start(const char *elf)
{
    avr_global_logger_set(on_log);
    elf_firmware_t firmware = { 0 };
    if (elf_read_firmware(elf, &firmware) != 0)
        fail("the firmware cannot be read");
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr)
        fail("libsimavr does not know the ATmega328P");
    avr_init(avr);
    firmware.frequency = BOARD_HZ;
    firmware.vcc = firmware.avcc = firmware.aref = 5000;
    avr_load_firmware(avr, &firmware);
    memset(avr->data + RAM_START, PAINT, avr->ramend + 1 - RAM_START);
    avr->sleep = on_sleep;
    reset_of_core = avr->reset;
    avr->reset = on_reset;

    duty.write = avr->io[AVR_DATA_TO_IO(OCR0B)].w.c;
    duty.param = avr->io[AVR_DATA_TO_IO(OCR0B)].w.param;
    avr->io[AVR_DATA_TO_IO(OCR0B)].w.c = on_duty;
    find_uart();
    uint32_t flags = 0; /* neither text on the console, nor a pause where the firmware polls */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(uart->io.irq + UART_IRQ_OUTPUT, on_sent, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), PWM_PIN), on_pwm, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 0), on_direction, NULL);
    for (size_t i = 0; i < INTERRUPTS; i++) {
        avr_irq_t *irq = avr_get_interrupt_irq(avr, interrupts[i].vector);
        if (!irq)
            fail("this core lacks an interrupt");
        avr_irq_register_notify(irq + AVR_INT_IRQ_PENDING, on_interrupt_raised, &interrupts[i]);
        avr_irq_register_notify(irq + AVR_INT_IRQ_RUNNING, on_interrupt_running, &interrupts[i]);
    }
    /* The buttons are not pressed. */
    board_set_pin('D', 4, true);
    board_set_pin('B', 1, true);
}

static avr_cycle_count_t on_deadline(avr_t *core, avr_cycle_count_t when, void *param)
{
    (void)core, (void)when, (void)param;
    return 0;
}

bool board_run(uint64_t cycle)
{
    if (to_board.length != 0 && avr_cycle_timer_status(avr, on_byte_time, NULL) == 0)
        avr_cycle_timer_register(avr, uart->cycles_per_byte, on_byte_time, NULL);
    /* The processor runs, or sleeps, through up to the next timer; so there is one at the end. */
    if (avr->cycle < cycle)
        avr_cycle_timer_register(avr, cycle - avr->cycle, on_deadline, NULL);
    while (avr->cycle < cycle) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed)
            return false;
        if (!is_awake && state == cpu_Running) {
            is_awake = true;
            woken_at = avr->cycle;
        }
    }
    return true;
}

uint64_t board_cycle(void)
{
    return avr->cycle;
}

size_t board_room(void)
{
    return QUEUE_BYTES - to_board.length;
}

bool board_is_receiving(void)
{
    return to_board.length != 0;
}

void board_send(const uint8_t *bytes, size_t length)
{
    memcpy(to_board.bytes + to_board.length, bytes, length);
    to_board.length += length;
}

size_t board_receive(uint8_t *bytes, size_t room)
{
    size_t length = from_board.length < room ? from_board.length : room;
    memcpy(bytes, from_board.bytes, length);
    memmove(from_board.bytes, from_board.bytes + length, from_board.length - length);
    from_board.length -= length;
    return length;
}

double board_duty(uint64_t cycle)
{
    account_pwm();
    /* The last instruction may have ended beyond it. */
    uint64_t beyond = is_driven() ? avr->cycle - cycle : 0;
    double duty = (double)(pwm.high - beyond) / (double)(cycle - pwm.measured_from);
    pwm.high = beyond;
    pwm.measured_from = cycle;
    return duty;
}

bool board_direction(void)
{
    return direction;
}

uint64_t board_last_high(void)
{
    account_pwm();
    return pwm.last_high;
}

uint64_t board_last_frame(void)
{
    return last_frame;
}

void board_set_analogue(int channel, double volts)
{
    static avr_irq_t *inputs[8];
    if (!inputs[channel])
        inputs[channel] = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, channel);
    avr_raise_irq(inputs[channel], (uint32_t)(1000 * volts + 0.5));
}

void board_set_pin(char port, int pin, bool level)
{
    /* What the outside drives is also what the port falls back to when the firmware writes to
     * another pin of it. */
    uint8_t *mask = &pulls_mask[port - 'B'], *value = &pulls_value[port - 'B'];
    *mask |= 1 << pin;
    *value = level ? *value | 1 << pin : *value & ~(1 << pin);
    avr_ioport_external_t external = { .name = port, .mask = *mask, .value = *value };
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
    /* A low level on an external interrupt that nobody has set up would be looked at in every
     * cycle, from each reset on. */
    avr_extint_set_strict_lvl_trig(avr, 0, 0);
    avr_extint_set_strict_lvl_trig(avr, 1, 0);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pin), level);
}

bool board_hang(const char *how)
{
    static const struct {
        const char *name;
        uint8_t code[4];
    } ways[] = {
        { "loop", { 0xff, 0xcf, 0xff, 0xcf } }, /* rjmp .-2 */
        { "deaf", { 0xf8, 0x94, 0xff, 0xcf } }, /* cli; rjmp .-2 */
        { "kicking", { 0xa8, 0x95, 0xfe, 0xcf } }, /* wdr; rjmp .-4 */
    };
    if (strcmp(how, "clock") == 0) {
        avr->io[AVR_DATA_TO_IO(TCCR1B)].w.c(avr, TCCR1B, 0, avr->io[AVR_DATA_TO_IO(TCCR1B)].w.param);
        return true;
    }
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        if (strcmp(how, ways[i].name) != 0 || is_patched)
            continue;
        /* In the main loop, between two instructions, and not in an interrupt. */
        while (avr->interrupts.running_ptr != 0 || !avr->sreg[S_I])
            if (!board_run(avr->cycle + 1))
                return false;
        patched_at = avr->pc;
        memcpy(unpatched, avr->flash + patched_at, sizeof unpatched);
        memcpy(avr->flash + patched_at, ways[i].code, sizeof unpatched);
        is_patched = true;
        return true;
    }
    return false;
}

void board_reset(void)
{
    avr_reset(avr);
}

struct board_stats board_stats(void)
{
    struct board_stats now = stats;
    size_t run = 0;
    for (unsigned at = RAM_START; at <= avr->ramend; at++) {
        run = avr->data[at] == PAINT ? run + 1 : 0;
        if (run > now.never_used)
            now.never_used = run;
    }
    return now;
}

const struct interrupt *board_interrupts(size_t *count)
{
    *count = INTERRUPTS;
    return interrupts;
}

void board_clear_stats(void)
{
    stats = (struct board_stats){ 0 };
    for (size_t i = 0; i < INTERRUPTS; i++)
        interrupts[i].count = interrupts[i].longest = interrupts[i].longest_wait = 0;
}
