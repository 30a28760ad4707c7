/* What the interrupts leave for the main loop: bits of a register that an interrupt sets in one instruction. */
#ifndef WORK_H
#define WORK_H

#include <avr/io.h>

#define WORK GPIOR0
#define WORK_MEASURING 0 /* the sample clock has ticked, and the sample is not there yet */
#define WORK_SAMPLE 1 /* a sample is there */
#define WORK_FRAME 2 /* a zero was received, the end of a frame */

#endif
