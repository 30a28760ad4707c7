/* The position sensors of the rig, on the pins of the board. Both are always there; the firmware looks at the one that it
 * was built for. */
#ifndef SENSOR_H
#define SENSOR_H

#include <stdbool.h>
#include <stdint.h>

/* Lets the board live until a cycle, while the handle goes on to a position: the edges of the quadrature encoder are
 * spread over that time. Returns false where the processor has crashed. */
bool sensor_run(uint64_t cycle, double position_m);

void sensor_start(void);

/* Takes the wire of the magneto sensor off, or channel B of the encoder. */
void sensor_cut(void);

#endif
