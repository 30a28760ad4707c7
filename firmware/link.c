#include "link.h"

#include "message.h"
#include "uart.h"

#define CRC_BYTES 4
#define CRC_START 0xFFFFFFFF
/* A message, its CRC, one byte of stuffing and the zero that ends it. */
#define LONGEST_FRAME (LONGEST_MESSAGE + CRC_BYTES + 2)

/* The effect of each value of a byte on the CRC: 1 KiB of memory for a quarter of the time that
 * 16 entries would take. */
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

static uint32_t crc_with(uint32_t crc, uint8_t byte)
{
    return crc >> 8 ^ crc_of_byte[(uint8_t)crc ^ byte];
}

static uint32_t crc32(const uint8_t *bytes, uint8_t length)
{
    uint32_t crc = CRC_START;
    while (length--)
        crc = crc_with(crc, *bytes++);
    return ~crc;
}

/* Each stretch up to a zero goes out as soon as its length is known, so that the line is busy
 * while the rest is made. */
void link_send(const void *message, uint8_t length)
{
    /* Half a frame is worse than none. */
    if (!uart_has_room(length + CRC_BYTES + 2))
        return;
    const uint8_t *from = message;
    uint32_t crc = CRC_START;
    /* So many bytes since the last zero, behind the place for their number. Frames are too short
     * for a stretch of 255. */
    uint8_t stretch = 1;
    for (uint8_t left = length + CRC_BYTES; left != 0; left--) {
        if (left == CRC_BYTES) {
            crc = ~crc;
            from = (const uint8_t *)&crc;
        }
        uint8_t byte = *from++;
        if (left > CRC_BYTES)
            crc = crc_with(crc, byte);
        if (byte != 0) {
            uart_place(stretch++, byte);
        } else {
            uart_place(0, stretch);
            uart_send(stretch);
            stretch = 1;
        }
    }
    uart_place(0, stretch);
    uart_place(stretch, 0);
    uart_send(stretch + 1);
}

/* Takes the stuffing out, in place. Returns the length without it, or 0 for impossible stuffing. */
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
        /* Bytes that are too long for a frame are dropped up to the next zero. */
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
