/* Where the handle is. There are two sources, encoder_quadrature.c and encoder_magneto.c; make ENCODER=... chooses one. Each calls sample_take from an
 * interrupt, once a tick, at the moment to which the position belongs. */
#ifndef ENCODER_H
#define ENCODER_H

#include "config.h"

#include <stdbool.h>
#include <stdint.h>

extern const char encoder_name[];
extern const float encoder_counts_per_metre;

void encoder_init(void);

/* First in the interrupt of the sample clock; tick_us is the time of the tick. */
void encoder_tick(uint32_t tick_us);

/* A sample has been taken. is_lost says that the position is not to be trusted since the last one: a wire is off, or it moved too fast to be followed. */
void sample_take(uint32_t time_us, int32_t count, bool is_lost);

#endif
