#define _GNU_SOURCE
#include "host.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

void die(const char *what)
{
    fprintf(stderr, "simulator: %s: %s\n", what, strerror(errno));
    exit(1);
}

int open_line(const char *link)
{
    int line = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (line < 0 || grantpt(line) != 0 || unlockpt(line) != 0)
        die("a pseudo-terminal");
    const char *name = ptsname(line);
    int other = open(name, O_RDWR | O_NOCTTY);
    struct termios settings;
    if (other < 0 || tcgetattr(other, &settings) != 0)
        die(name);
    cfmakeraw(&settings);
    tcsetattr(other, TCSANOW, &settings);
    if (link) {
        unlink(link);
        if (symlink(name, link) != 0)
            die(link);
    }
    fprintf(stderr, "simulator: %s\n", link ? link : name);
    return line;
}

long long now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

void sleep_until(long long ns)
{
    struct timespec until = { ns / 1000000000LL, ns % 1000000000LL };
    while (now_ns() < ns)
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

long long used_ns(int process)
{
    clockid_t clock;
    struct timespec used;
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &used) != 0)
        return 0;
    return used.tv_sec * 1000000000LL + used.tv_nsec;
}

void hurry(void)
{
    prctl(PR_SET_TIMERSLACK, 1);
    setpriority(PRIO_PROCESS, 0, -20);
}

struct options options_of(int argc, char **argv, int first)
{
    struct options options = { .axes = 1 };
    for (int i = first; i < argc; i++) {
        if (strcmp(argv[i], "2") == 0)
            options.axes = 2;
        else if (strcmp(argv[i], "rest") == 0)
            options.is_at_rest = true;
        else if (strcmp(argv[i], "swapped") == 0)
            options.are_swapped = true;
    }
    return options;
}

bool next_order(char order[ORDER_BYTES], int wait_ms)
{
    struct pollfd input = { .fd = 0, .events = POLLIN };
    order[0] = 0;
    if (poll(&input, 1, wait_ms) <= 0)
        return true;
    if (!fgets(order, ORDER_BYTES, stdin))
        return false;
    order[strcspn(order, "\n")] = 0;
    return true;
}
