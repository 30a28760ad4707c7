/* The device's answers and actions: the state machine of docs/device-protocol.md. Nothing here
 * runs in an interrupt. */
#ifndef DEVICE_H
#define DEVICE_H

#include "message.h"

/* Acts on the message of a frame with a correct CRC. */
void device_receive(const void *message, uint8_t length);

/* Sends a sample; sequence, time and count are the caller's. */
void device_send(struct sample *sample);

/* Reports, once, that the position is lost. */
void device_watch_position(void);

#endif
