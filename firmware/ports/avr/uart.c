#include "uart.h"

#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#define RING_BYTES 128
/* Between two parts of a frame, of 18 bytes with one axis, the main loop can send a sample. */
#define PART_BYTES 16
#define NEXT(at) ((uint8_t)((at) + 1) & (RING_BYTES - 1))

_Static_assert((F_CPU / 8) % BAUD_HZ == 0, "the UART cannot make this baud rate exactly");

/* One side writes the head, the other the tail; each is one byte, so neither is ever seen half written. */
struct ring {
    volatile uint8_t head, tail;
    volatile uint8_t bytes[RING_BYTES];
};

static struct ring received, to_send;

void uart_init(void)
{
    UCSR0A = 1 << U2X0;
    UBRR0 = F_CPU / 8 / BAUD_HZ - 1;
    UCSR0C = 1 << UCSZ01 | 1 << UCSZ00; /* 8 bits, no parity, 1 stop bit */
    UCSR0B = 1 << RXCIE0 | 1 << RXEN0 | 1 << TXEN0;
}

ISR(USART_RX_vect)
{
    uint8_t byte = UDR0;
    uint8_t head = received.head;
    uint8_t next = NEXT(head);
    /* The CRC of its frame shows a byte that is lost here, or damaged on the line. */
    if (next != received.tail) {
        received.bytes[head] = byte;
        received.head = next;
        if (byte == 0)
            WORK |= 1 << WORK_FRAME;
    }
}

ISR(USART_UDRE_vect)
{
    uint8_t tail = to_send.tail;
    UDR0 = to_send.bytes[tail];
    tail = NEXT(tail);
    to_send.tail = tail;
    if (tail == to_send.head)
        UCSR0B &= ~(1 << UDRIE0);
}

uint8_t uart_receive(uint8_t *bytes, uint8_t room)
{
    uint8_t tail = received.tail, head = received.head, length = 0;
    if (room > PART_BYTES)
        room = PART_BYTES;
    while (tail != head && length < room) {
        uint8_t byte = received.bytes[tail];
        bytes[length++] = byte;
        tail = NEXT(tail);
        if (byte == 0)
            break;
    }
    received.tail = tail;
    if (tail != head)
        WORK |= 1 << WORK_FRAME;
    return length;
}

uint8_t uart_room(void)
{
    return (uint8_t)(to_send.tail - to_send.head - 1) & (RING_BYTES - 1);
}

void uart_send(const uint8_t *bytes, uint8_t length)
{
    uint8_t head = to_send.head;
    for (; length != 0; length--) {
        to_send.bytes[head] = *bytes++;
        head = NEXT(head);
    }
    to_send.head = head;
    /* The interrupt clears this bit: read, change and write must not be torn apart. */
    cli();
    UCSR0B |= 1 << UDRIE0;
    sei();
}
