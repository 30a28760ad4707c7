/* The ATmega328P on its board, as libsimavr runs it, seen from its pins. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BOARD_HZ 16000000

struct interrupt {
    const char *name;
    uint8_t vector;
    uint64_t raised_at, began_at;
    uint64_t count, longest, longest_wait; /* cycles; the wait is from what raises it to its first instruction */
};

struct board_stats {
    uint64_t bytes_in, bytes_out, overruns; /* of the UART; an overrun is a byte that no place was left for */
    uint64_t longest_to_frame; /* cycles from a tick of the sample clock to the first byte of the next frame */
    uint64_t resets;
    size_t never_used; /* bytes of memory between the data and the deepest stack */
    uint64_t busy_cycles, longest_busy; /* from waking up to going to sleep again, with all interrupts in between */
};

/* Loads the firmware; exits where it cannot. */
void board_start(const char *elf);

/* Runs up to a cycle, counted from power-on. False where the processor has crashed. */
bool board_run(uint64_t cycle);

uint64_t board_cycle(void);

/* Bytes on their way to the UART, at the speed of the line: no more than there is room for. */
void board_send(const uint8_t *bytes, size_t length);
size_t board_room(void);
bool board_is_receiving(void);

/* Takes what the UART has sent. */
size_t board_receive(uint8_t *bytes, size_t room);

/* The part of the time since the last call and up to a cycle, to which the board has been run, that D5 was high; and the
 * direction on D8. */
double board_duty(uint64_t cycle);
bool board_direction(void);

/* When D5 was last high, and when the end of the last frame (a zero) was received, cycles. */
uint64_t board_last_high(void);
uint64_t board_last_frame(void);

void board_set_analogue(int channel, double volts);
void board_set_pin(char port, int pin, bool level);

/* Ways for the main loop to hang, as a broken firmware would: with interrupts, without, or kicking the hardware watchdog
 * all the time; or for the sample clock to stop. */
bool board_hang(const char *how);

/* Resets the processor, wherever it is. */
void board_reset(void);

struct board_stats board_stats(void);
const struct interrupt *board_interrupts(size_t *count);
void board_clear_stats(void);

#endif
