/* The serial line: ring buffers that the two interrupts of the UART empty and fill. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_init(void);

/* Takes received bytes up to the end of a frame, in parts: between two of them the main loop can send a sample. Sets
 * WORK_FRAME if more are there. */
uint8_t uart_receive(uint8_t *bytes, uint8_t room);

/* Bytes that can be queued. */
uint8_t uart_room(void);

/* Queues bytes, for which there must be room. Interrupts are on afterwards. */
void uart_send(const uint8_t *bytes, uint8_t length);

#endif
