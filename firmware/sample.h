/* From the interrupt that takes a sample to the main loop that sends it. */
#ifndef SAMPLE_H
#define SAMPLE_H

#include "message.h"

#include <stdbool.h>

/* Counts the samples from 0 again. */
void sample_begin(void);

/* The newest sample, unless it was taken before. */
bool sample_get(struct sample *sample);

bool sample_is_there(void);

/* Whether the position was lost before the newest sample. The motor is off then. */
extern volatile bool sample_is_lost;

#endif
