/* What the simulated boards need of the computer: a pseudo-terminal as their line, its time, orders. */
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>

/* Ends the program with an error of the system. */
_Noreturn void die(const char *what);

/* Opens a pseudo-terminal without blocking, and leads a link to it; without a link only its name is printed. Its other
 * end stays open, so the line survives the host. */
int open_line(const char *link);

long long now_ns(void);
void sleep_until(long long ns);

/* The processor time that another process has used; 0 for one that has ended. */
long long used_ns(int process);

/* A microcontroller is never late; the simulation asks for the highest priority without real time, which would starve
 * the host's threads. */
void hurry(void);

/* What a board is asked for on its command line, behind its link: 1 or 2 axes, hands at rest, the encoders' plugs swapped. */
struct options {
    int axes;
    bool is_at_rest, are_swapped;
};
struct options options_of(int argc, char **argv, int first);

/* The next order on standard input, of which a line is one; empty if none comes in time. Returns false at the end. */
#define ORDER_BYTES 64
bool next_order(char order[ORDER_BYTES], int wait_ms);

#endif
