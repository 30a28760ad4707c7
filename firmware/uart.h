/* The serial line: ring buffers that the two interrupts of the UART empty and fill. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_init(void);

/* The next byte received, if there is one. */
bool uart_get(uint8_t *byte);

bool uart_has_byte(void);

/* Queues all of the bytes, or, where they do not fit, none: half a frame is worth less than none. */
bool uart_put(const uint8_t *bytes, uint8_t length);

#endif
