#define _GNU_SOURCE
#include "host.h"

#include <errno.h>
#include <fcntl.h>
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

void hurry(void)
{
    prctl(PR_SET_TIMERSLACK, 1);
    setpriority(PRIO_PROCESS, 0, -20);
}
