/* Messages on the serial line: a CRC-32 behind each, both stuffed by COBS so that a zero ends a
 * frame and appears nowhere else. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

void link_init(void);

/* Sends a message, or drops it if the line has no room. */
void link_send(const void *message, uint8_t length);

/* Takes the next byte of the line. Where it ends a frame whose CRC is right, returns the length of its message, which stays in *message until the
 * next call; otherwise 0. */
uint8_t link_take(uint8_t byte, const void **message);

#endif
