/* What the simulated boards need of the computer: a pseudo-terminal as their line, and its time. */
#ifndef HOST_H
#define HOST_H

/* Ends the program with an error of the system. */
_Noreturn void die(const char *what);

/* Opens a pseudo-terminal without blocking, and leads a link to it; without a link only its name is printed. Its other end
 * stays open, so the line survives the host. */
int open_line(const char *link);

long long now_ns(void);
void sleep_until(long long ns);

/* A microcontroller is never late; the simulation asks for the highest priority without real time, which would starve the
 * host's threads. */
void hurry(void);

#endif
