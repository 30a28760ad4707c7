/* A board of one or two axes that runs on this computer, for tests of the library and of what is at the other end:
 *
 *     build/native LINK [1 or 2] [rest] [swapped]       number of axes; hands at rest; the encoders' plugs are swapped
 *
 * One process is the processor, with SIGALRM as its timer. Its parent is the operator, and the hardware watchdog, which
 * kills the processor and starts it again. Orders on standard input, each answered by the statistics: stats, clear, hang
 * loop|write|clock|deaf|kicking, cut (the encoder's wire), mend, reset. */
#define _GNU_SOURCE
#include "haptic_device.h"
#include "host.h"
#include "plant.h"
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define COUNTS_PER_METRE 100000
#define STEP_NS 100000LL
/* Of the processor's own time: it is not hung where this computer holds it up. */
#define WATCHDOG_NS 20000000
enum fault { NONE, HANG_LOOP, HANG_WRITE, HANG_CLOCK, HANG_DEAF, HANG_KICKING };
static const char *const fault_names[] = { "", "hang loop", "hang write", "hang clock", "hang deaf", "hang kicking" };

/* The registers and pins of the board. */
static struct board {
    volatile int32_t force_mn[2];
    volatile int fault;
    volatile bool is_cut, is_kicked, are_swapped;
    volatile long long last_on_ns, last_order_ns;
    struct plant plants[2];
} *board;

static struct haptic_device device;
static struct haptic_device_config config;
static int line;
static long long board_ns, plant_ns;
static volatile sig_atomic_t has_ticked;

static void live(void)
{
    for (; plant_ns < board_ns; plant_ns += STEP_NS)
        for (int i = 0; i < config.axes; i++)
            plant_step(&board->plants[i], STEP_NS * 1e-9, board->force_mn[i] / 1000.0);
}

static uint32_t clock_us(void *context)
{
    static uint32_t us;
    (void)context;
    if (board->fault != HANG_CLOCK)
        us = (uint32_t)(board_ns / 1000);
    return us;
}

static void measure(void *context, struct haptic_sample *sample)
{
    (void)context;
    live();
    for (int i = 0; i < config.axes; i++)
        sample->count[i] = (int32_t)lrint(board->plants[board->are_swapped ? 1 - i : i].position_m * COUNTS_PER_METRE);
    sample->lost = board->is_cut;
}

static void motor_force(void *context, const int32_t force_mn[])
{
    (void)context;
    live();
    for (int i = 0; i < config.axes; i++)
        board->force_mn[i] = force_mn[i];
}

static void motor_off(void *context)
{
    (void)context;
    if (board->force_mn[0] != 0 || board->force_mn[1] != 0)
        board->last_on_ns = now_ns();
    board->force_mn[0] = board->force_mn[1] = 0;
}

static uint8_t take(void *context, uint8_t *bytes, uint8_t room)
{
    ssize_t got = read(line, bytes, room);
    (void)context;
    return got > 0 ? (uint8_t)got : 0;
}

static bool give(void *context, const uint8_t *bytes, uint8_t length)
{
    (void)context;
    while (board->fault == HANG_WRITE)
        ;
    return write(line, bytes, length) == length;
}

static void on_tick(int signal)
{
    (void)signal;
    has_ticked = true;
    haptic_device_watchdog_from_isr(&device, 1000);
}

static void hang(void)
{
    sigset_t all;
    sigfillset(&all);
    if (board->fault == HANG_DEAF)
        sigprocmask(SIG_BLOCK, &all, NULL);
    while (board->fault == HANG_LOOP || board->fault >= HANG_DEAF)
        board->is_kicked |= board->fault == HANG_KICKING;
}

/* The firmware. */
static _Noreturn void processor(void)
{
    struct sigaction tick = { .sa_handler = on_tick, .sa_flags = SA_RESTART };
    struct itimerval each = { { 0, 1000 }, { 0, 1000 } };
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    hurry();
    plant_ns = board_ns = now_ns();
    if (!haptic_device_init(&device, &config))
        _exit(2);
    sigaction(SIGALRM, &tick, NULL);
    setitimer(ITIMER_REAL, &each, NULL);
    for (;;) {
        board_ns += STEP_NS;
        if (now_ns() - board_ns > 500000000)
            plant_ns = board_ns = now_ns();
        sleep_until(board_ns);
        haptic_device_poll(&device);
        hang();
        board->is_kicked |= has_ticked;
        has_ticked = false;
    }
}

static void report(unsigned resets)
{
    double off_after_ms = (double)(board->last_on_ns - board->last_order_ns) / 1e6;
    printf("{\"resets\":%u,\"off_after_order_ms\":%.2f,\"axes\":[", resets, off_after_ms);
    plant_print(board->plants, board->force_mn, config.axes);
    printf("]}\n");
    fflush(stdout);
}

static void obey(const char *order, pid_t child, unsigned resets)
{
    if (strcmp(order, "stats") != 0)
        board->last_order_ns = now_ns();
    if (strcmp(order, "clear") == 0)
        for (int i = 0; i < 2; i++)
            board->plants[i].motor_work_j = board->plants[i].travel_m = 0;
    if (strcmp(order, "cut") == 0 || strcmp(order, "mend") == 0) {
        board->is_cut = *order == 'c';
        board->fault = NONE;
    }
    if (strcmp(order, "reset") == 0)
        kill(child, SIGKILL);
    for (int i = HANG_LOOP; i <= HANG_KICKING; i++)
        if (strcmp(order, fault_names[i]) == 0)
            board->fault = i;
    report(resets);
}

int main(int argc, char **argv)
{
    struct options options = options_of(argc, argv, 2);
    char order[ORDER_BYTES];
    int status;
    if (argc < 2)
        return 2;
    board = mmap(NULL, sizeof *board, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (board == MAP_FAILED)
        die("shared memory");
    config = (struct haptic_device_config){ .name = "native 0.2.0", .axes = (uint8_t)options.axes,
        .counts_per_metre = { COUNTS_PER_METRE, COUNTS_PER_METRE }, .force_limit_mn = { 20000, 20000 },
        .buttons_there = 1, .sample_rate_hz = 1000, .clock_us = clock_us, .measure = measure, .motor_force = motor_force,
        .motor_off = motor_off, .read = take, .write = give };
    board->are_swapped = options.are_swapped;
    for (int i = 0; i < 2; i++)
        board->plants[i] = plant_of_axis(i, options.is_at_rest);
    line = open_line(argv[1]);
    hurry();
    setvbuf(stdin, NULL, _IONBF, 0);
    pid_t child = 0;
    long long kicked_ns = 0;
    for (unsigned resets = 0;;) {
        if (child == 0 && (child = fork()) == 0)
            processor();
        if (!next_order(order, 1))
            break;
        if (*order)
            obey(order, child, resets);
        if (board->is_kicked) {
            board->is_kicked = false;
            kicked_ns = used_ns(child);
        }
        bool is_hung = used_ns(child) - kicked_ns > WATCHDOG_NS;
        if (is_hung)
            kill(child, SIGKILL);
        if (waitpid(child, &status, is_hung ? 0 : WNOHANG) == child) {
            motor_off(NULL); /* as the resistor at the power stage, while the pins float */
            board->fault = NONE;
            kicked_ns = 0;
            child = 0;
            resets++;
            if (WIFEXITED(status))
                return 2;
        }
    }
    kill(child, SIGKILL);
    unlink(argv[1]);
    return 0;
}
