#include "link.h"

#include "message.h"
#include "uart.h"

#define CRC_BYTES 4
/* A message, its CRC, one byte of stuffing and the zero that ends it. */
#define LONGEST_FRAME (LONGEST_MESSAGE + CRC_BYTES + 2)

/* What each value of a byte does to the CRC: 1 KiB of memory for a quarter of the time that 16 entries would take. */
static uint32_t crc_of_byte[256];

void link_init(void)
{
    uint8_t byte = 0;
    do {
        uint32_t crc = byte;
        for (uint8_t bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
        crc_of_byte[byte] = crc;
    } while (++byte);
}

static uint32_t crc32(const uint8_t *bytes, uint8_t length)
{
    uint32_t crc = 0xFFFFFFFF;
    while (length--)
        crc = crc >> 8 ^ crc_of_byte[(uint8_t)crc ^ *bytes++];
    return ~crc;
}

void link_send(const void *message, uint8_t length)
{
    static uint8_t frame[LONGEST_FRAME];
    const uint8_t *from = message;
    uint32_t crc = crc32(from, length);
    /* Where the distance to the next zero goes, and where the next byte goes. Frames are too short for a distance of 255. */
    uint8_t distance_at = 0, at = 1;
    for (uint8_t i = 0; i < length + CRC_BYTES; i++) {
        if (i == length)
            from = (const uint8_t *)&crc;
        uint8_t byte = *from++;
        if (byte == 0) {
            frame[distance_at] = at - distance_at;
            distance_at = at;
        }
        frame[at++] = byte;
    }
    frame[distance_at] = at - distance_at;
    frame[at++] = 0;
    uart_put(frame, at);
}

/* Takes the stuffing out, in place. Returns the length without it, or 0 where no sender stuffs so. */
static uint8_t unstuff(uint8_t *stuffed, uint8_t length)
{
    uint8_t zero_at = 0;
    while (zero_at < length) {
        uint8_t distance = stuffed[zero_at];
        stuffed[zero_at] = 0;
        if (distance > length - zero_at)
            return 0;
        zero_at += distance;
    }
    return length - 1;
}

uint8_t link_take(uint8_t byte, const void **message)
{
    static uint8_t frame[LONGEST_FRAME];
    static uint8_t length;
    if (byte != 0) {
        /* What is too long to be a frame is dropped up to the next zero. */
        if (length < LONGEST_FRAME)
            frame[length++] = byte;
        return 0;
    }
    uint8_t stuffed = length;
    length = 0;
    if (stuffed < 2 + CRC_BYTES || stuffed == LONGEST_FRAME)
        return 0;
    uint8_t with_crc = unstuff(frame, stuffed);
    if (with_crc <= CRC_BYTES)
        return 0;
    /* The CRC of a message and its own CRC is always this, whatever the message. */
    if (crc32(frame + 1, with_crc) != 0x2144DF1C)
        return 0;
    *message = frame + 1;
    return with_crc - CRC_BYTES;
}
