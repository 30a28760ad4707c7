/* The registers of a board that the machine lacks: its encoders, motors and line are in memory of QEMU that is a file, and
 * rig.c is what is wired to them. One side writes a ring's head, the other its tail; both count on for ever. */
#ifndef SHARED_H
#define SHARED_H

#include <stdint.h>

#define RING_BYTES 4096

enum fault { NONE, HANG_LOOP, HANG_WRITE, HANG_CLOCK, HANG_DEAF, HANG_KICKING, RESET };

struct ring {
    volatile uint32_t head, tail;
    volatile uint8_t bytes[RING_BYTES];
};

struct shared {
    volatile uint32_t axes, fault, is_cut, boots;
    volatile uint32_t time_us, seen_us; /* the board's clock, which the rig drives; how far the board has lived */
    volatile int32_t count[2], force_mn[2];
    struct ring to_board, from_board;
};

#endif
