/* The serial line: ring buffers that the two interrupts of the UART empty and fill. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_init(void);

/* The next byte received, if there is one. */
bool uart_get(uint8_t *byte);

bool uart_has_byte(void);

/* Whether so many bytes can be queued. */
bool uart_has_room(uint8_t bytes);

/* Puts a byte into the queue, so far behind the bytes that are being sent; nothing of it is sent
 * yet. */
void uart_place(uint8_t ahead, uint8_t byte);

/* Sends the first so many of the bytes that were placed. */
void uart_send(uint8_t bytes);

#endif
