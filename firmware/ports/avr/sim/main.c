/* A rig in simulation: the real firmware on libsimavr's ATmega328P, its motor pulling a handle that a hand moves, its UART
 * on a pseudo-terminal.
 *
 *     build/simulator build/quadrature.elf --pty rig
 *     hapticd --device serial:rig
 *
 * It keeps to real time. On standard input it takes: stats, until S (stats at that time), clear, hang
 * loop|deaf|kicking|clock, reset, cut, patience MS, quit; it answers each with one line of JSON. */
#define _GNU_SOURCE
#include "board.h"
#include "config.h"
#include "host.h"
#include "plant.h"
#include "sensor.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Two periods of the PWM: what the motor gives is the mean over it, and the handle moves by one step. */
#define STEP_CYCLES 512
#define STEP_S ((double)STEP_CYCLES / BOARD_HZ)
/* How much is simulated between two looks at the clock and the line: 192 us. */
#define STEPS_TO_A_SLICE 6
/* Largest lag that is made up for: to the host it is a line that was held up for so long, and then has all at once. Time
 * that is given up looks like a clock that runs too slowly, which hapticd refuses. */
#define MAX_LAG_NS 500000000LL

static struct plant plant = {
    .mass_kg = 1.4,
    .coulomb_n = 0.8,
    .viscous_ns_per_m = 2.0,
    .hand = { .amplitude_m = 0.03, .frequency_hz = 0.5, .stiffness_n_per_m = 400.0, .damping_ns_per_m = 20.0 },
};
static double motor_force_n, largest_force_n, sum_of_force_n;
static uint64_t steps_counted, lags, last_received;
static long patience_ms;
static double stats_at_s = INFINITY;
static FILE *log_file;
static const char *link_path;
static volatile sig_atomic_t ended;

static void on_signal(int signal)
{
    (void)signal;
    ended = 1;
}

/* On request time almost stands still while the host is silent: a host that a busy machine holds up then does not count as
 * silent. */
static void wait_for_host(int line)
{
    if (board_is_receiving())
        last_received = board_cycle();
    if (patience_ms == 0 || (board_cycle() - last_received) * 1000 < (uint64_t)patience_ms * BOARD_HZ)
        return;
    struct pollfd host = { .fd = line, .events = POLLIN };
    poll(&host, 1, 10);
}

/* Bytes that the line does not take are lost, as on a wire without a listener. */
static void exchange(int line)
{
    uint8_t bytes[1024];
    size_t room = board_room() < sizeof bytes ? board_room() : sizeof bytes;
    ssize_t got = room > 0 ? read(line, bytes, room) : 0;
    if (got > 0) {
        board_send(bytes, (size_t)got);
        last_received = board_cycle();
    }
    size_t length = board_receive(bytes, sizeof bytes);
    if (length > 0 && write(line, bytes, length) < 0 && errno != EAGAIN)
        die("the pseudo-terminal");
}

static double force_of(double duty, bool forward)
{
    double torque_nm = FULL_TORQUE_NM * (DUTY_EXPONENT == 2 ? duty * duty : duty);
    double force_n = torque_nm / PULLEY_RADIUS_M * SECTOR_RADIUS_M / HANDLE_RADIUS_M;
    return forward != MOTOR_REVERSED ? force_n : -force_n;
}

static bool step(void)
{
    static uint64_t cycle;
    cycle += STEP_CYCLES;
    if (!sensor_run(cycle, plant.position_m))
        return false;
    motor_force_n = force_of(board_duty(cycle), board_direction());
    plant_step(&plant, STEP_S, motor_force_n);
    double size = fabs(motor_force_n);
    largest_force_n = fmax(largest_force_n, size);
    sum_of_force_n += size;
    steps_counted++;
    if (log_file)
        fprintf(log_file, "%.6f,%.7f,%.5f,%.4f,%.4f\n", plant.time_s, plant.position_m, plant.velocity_mps, motor_force_n,
                plant.hand_force_n);
    return true;
}

static double seconds(uint64_t cycles)
{
    return (double)cycles / BOARD_HZ;
}

static void print_stats(void)
{
    struct board_stats stats = board_stats();
    double counted_s = (double)steps_counted * STEP_S;
    printf("{\"time_s\":%.6f,\"lags\":%llu,", seconds(board_cycle()), (unsigned long long)lags);
    printf("\"motor\":{\"force_n\":%.4f,\"largest_force_n\":%.4f,\"mean_force_n\":%.4f,\"work_j\":%.5f,", motor_force_n,
           largest_force_n, steps_counted ? sum_of_force_n / (double)steps_counted : 0, plant.motor_work_j);
    printf("\"last_on_s\":%.6f,\"last_frame_s\":%.6f},", seconds(board_last_high()), seconds(board_last_frame()));
    printf("\"handle\":{\"position_m\":%.6f,\"velocity_mps\":%.5f,\"travel_m\":%.5f,", plant.position_m,
           plant.velocity_mps, plant.travel_m);
    printf("\"hand_force_n\":%.4f,\"hand_work_j\":%.5f},", plant.hand_force_n, plant.hand_work_j);
    printf("\"uart\":{\"bytes_in\":%llu,\"bytes_out\":%llu,\"overruns\":%llu,\"longest_to_frame_cycles\":%llu},",
           (unsigned long long)stats.bytes_in, (unsigned long long)stats.bytes_out, (unsigned long long)stats.overruns,
           (unsigned long long)stats.longest_to_frame);
    printf("\"processor\":{\"resets\":%llu,\"load\":%.4f,\"longest_busy_cycles\":%llu,\"memory_never_used\":%zu},",
           (unsigned long long)stats.resets, counted_s > 0 ? seconds(stats.busy_cycles) / counted_s : 0,
           (unsigned long long)stats.longest_busy, stats.never_used);
    printf("\"interrupts\":{");
    size_t count;
    const struct interrupt *interrupts = board_interrupts(&count);
    for (size_t i = 0; i < count; i++)
        printf("%s\"%s\":{\"count\":%llu,\"longest_cycles\":%llu,\"longest_wait_cycles\":%llu}", i ? "," : "",
               interrupts[i].name, (unsigned long long)interrupts[i].count, (unsigned long long)interrupts[i].longest,
               (unsigned long long)interrupts[i].longest_wait);
    printf("}}\n");
    fflush(stdout);
}

static void clear_stats(void)
{
    board_clear_stats();
    largest_force_n = sum_of_force_n = 0;
    steps_counted = lags = 0;
    plant.motor_work_j = plant.hand_work_j = plant.travel_m = 0;
}

static void obey(const char *order)
{
    bool is_done = true;
    if (strcmp(order, "stats") == 0)
        return print_stats();
    if (strncmp(order, "until ", 6) == 0) {
        stats_at_s = atof(order + 6);
        return;
    }
    if (strcmp(order, "clear") == 0)
        clear_stats();
    else if (strncmp(order, "hang ", 5) == 0)
        is_done = board_hang(order + 5);
    else if (strncmp(order, "patience ", 9) == 0) {
        patience_ms = atol(order + 9);
        last_received = board_cycle();
    }
    else if (strcmp(order, "reset") == 0)
        board_reset();
    else if (strcmp(order, "cut") == 0)
        sensor_cut();
    else if (strcmp(order, "quit") == 0)
        ended = 1;
    else
        is_done = false;
    printf("{\"done\":%s}\n", is_done ? "true" : "false");
    fflush(stdout);
}

static void take_orders(void)
{
    static char order[64];
    static size_t length;
    struct pollfd input = { .fd = STDIN_FILENO, .events = POLLIN };
    while (poll(&input, 1, 0) > 0) {
        char byte;
        if (read(STDIN_FILENO, &byte, 1) <= 0) {
            /* The process that started it is gone. */
            ended = 1;
            return;
        }
        if (byte == '\n') {
            order[length] = 0;
            length = 0;
            obey(order);
        } else if (length < sizeof order - 1) {
            order[length++] = byte;
        }
    }
}

static void pace(void)
{
    static long long due_ns;
    long long now = now_ns();
    if (due_ns == 0)
        due_ns = now;
    due_ns += STEPS_TO_A_SLICE * STEP_CYCLES * 1000000000LL / BOARD_HZ;
    if (now - due_ns > MAX_LAG_NS) {
        due_ns = now;
        lags++;
    }
    sleep_until(due_ns);
}

static void usage(void)
{
    puts("usage: simulator FIRMWARE.elf [--pty LINK] [--log FILE.csv] [--mass KG] [--coulomb N] [--viscous NS/M]\n"
         "                 [--amplitude M] [--frequency HZ] [--arm-stiffness N/M] [--arm-damping NS/M]\n"
         "Defaults: 1.4 kg, 0.8 N, 2 N s/m; a hand that goes 0.03 m to either side at 0.5 Hz, by 400 N/m and 20 N s/m.\n"
         "Runs until standard input ends. The log has a row each 32 us: time_s, position_m, velocity_mps, motor_force_n,\n"
         "hand_force_n.");
    exit(2);
}

static const char *take_options(int argc, char **argv)
{
    static const struct option names[] = {
        { "pty", required_argument, NULL, 'p' },           { "log", required_argument, NULL, 'l' },
        { "mass", required_argument, NULL, 'm' },          { "coulomb", required_argument, NULL, 'c' },
        { "viscous", required_argument, NULL, 'v' },       { "amplitude", required_argument, NULL, 'a' },
        { "frequency", required_argument, NULL, 'f' },     { "arm-stiffness", required_argument, NULL, 'k' },
        { "arm-damping", required_argument, NULL, 'd' },   { NULL, 0, NULL, 0 },
    };
    int option;
    while ((option = getopt_long(argc, argv, "", names, NULL)) != -1) {
        double number = optarg ? atof(optarg) : 0;
        switch (option) {
        case 'p': link_path = optarg; break;
        case 'l':
            if (!(log_file = fopen(optarg, "w")))
                die(optarg);
            fputs("time_s,position_m,velocity_mps,motor_force_n,hand_force_n\n", log_file);
            break;
        case 'm': plant.mass_kg = number; break;
        case 'c': plant.coulomb_n = number; break;
        case 'v': plant.viscous_ns_per_m = number; break;
        case 'a': plant.hand.amplitude_m = number; break;
        case 'f': plant.hand.frequency_hz = number; break;
        case 'k': plant.hand.stiffness_n_per_m = number; break;
        case 'd': plant.hand.damping_ns_per_m = number; break;
        default: usage();
        }
    }
    if (optind != argc - 1)
        usage();
    return argv[optind];
}

int main(int argc, char **argv)
{
    board_start(take_options(argc, argv));
    sensor_start();
    int line = open_line(link_path);
    signal(SIGINT, on_signal);
    signal(SIGTERM, on_signal);
    hurry();
    bool runs = true;
    while (!ended && runs) {
        exchange(line);
        take_orders();
        if (plant.time_s >= stats_at_s) {
            print_stats();
            stats_at_s = INFINITY;
        }
        wait_for_host(line);
        for (int i = 0; i < STEPS_TO_A_SLICE && runs; i++)
            runs = step();
        pace();
    }
    print_stats();
    if (link_path)
        unlink(link_path);
    if (log_file)
        fclose(log_file);
    if (!runs)
        fputs("simulator: the processor has crashed\n", stderr);
    return runs ? 0 : 1;
}
