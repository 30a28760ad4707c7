/* The rig around a firmware in QEMU: handles, encoders, line and the board's clock.
 *
 *     build/cortexm-rig MEMORY LINK [1 or 2] [rest] [swapped]
 *
 * MEMORY is the file that QEMU maps, LINK a pseudo-terminal. The board's time goes on in slices, and waits for the board:
 * a microcontroller is never late, however busy this computer. Orders and answers are those of ports/native. */
#define _GNU_SOURCE
#include "shared.h"

#include "host.h"
#include "plant.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define COUNTS_PER_METRE 100000
#define SLICE_US 200
/* At 1 Mbaud, ten bits each. */
#define BYTES_PER_SLICE 20
/* So much of the computer's time a board has for a slice before it counts as hung. */
#define PATIENCE_NS 1000000
#define MAX_LAG_NS 500000000LL

/* By enum fault. */
static const char *const fault_names[] = { "mend", "hang loop", "hang write", "hang clock", "hang deaf", "hang kicking",
                                           "reset" };
static struct shared *board;
static struct plant plants[2];
static uint32_t last_bytes_us, last_on_us, last_order_us;

static void report(void)
{
    printf("{\"resets\":%d,\"off_after_command_ms\":%.2f,\"off_after_order_ms\":%.2f,\"axes\":[", (int)board->boots - 1,
           (int32_t)(last_on_us - last_bytes_us) / 1e3, (int32_t)(last_on_us - last_order_us) / 1e3);
    plant_print(plants, board->force_mn, (int)board->axes);
    printf("]}\n");
    fflush(stdout);
}

static void obey(const char *order)
{
    if (strcmp(order, "stats") != 0)
        last_order_us = board->time_us;
    if (strcmp(order, "clear") == 0)
        for (int i = 0; i < 2; i++)
            plants[i].motor_work_j = plants[i].travel_m = 0;
    if (strcmp(order, "cut") == 0 || strcmp(order, "mend") == 0)
        board->is_cut = *order == 'c';
    for (uint32_t i = NONE; i <= RESET; i++)
        if (strcmp(order, fault_names[i]) == 0)
            board->fault = i;
    report();
}

static void exchange(int line)
{
    struct ring *in = &board->to_board, *out = &board->from_board;
    uint8_t bytes[256];
    size_t length = 0;
    ssize_t got = RING_BYTES - (in->head - in->tail) >= BYTES_PER_SLICE ? read(line, bytes, BYTES_PER_SLICE) : 0;
    for (ssize_t i = 0; i < got; i++, in->head++)
        in->bytes[in->head % RING_BYTES] = bytes[i];
    if (got > 0)
        last_bytes_us = board->time_us;
    for (; out->tail != out->head && length < sizeof bytes; out->tail++)
        bytes[length++] = out->bytes[out->tail % RING_BYTES];
    /* Bytes that nobody reads are lost, as on a wire. */
    if (length > 0 && write(line, bytes, length) < 0)
        return;
}

static void live(bool are_swapped)
{
    for (uint32_t i = 0; i < board->axes; i++) {
        for (int step = 0; step < 4; step++)
            plant_step(&plants[i], SLICE_US * 1e-6 / 4, board->force_mn[i] / 1000.0);
        board->count[are_swapped ? 1 - i : i] = (int32_t)lrint(plants[i].position_m * COUNTS_PER_METRE);
    }
    if (board->force_mn[0] != 0 || board->force_mn[1] != 0)
        last_on_us = board->time_us;
    board->time_us += SLICE_US;
    for (long long from = now_ns(); board->seen_us != board->time_us && now_ns() - from < PATIENCE_NS;)
        usleep(20);
}

int main(int argc, char **argv)
{
    struct options options = options_of(argc, argv, 3);
    char order[ORDER_BYTES];
    int file = argc < 3 ? -1 : open(argv[1], O_RDWR | O_CREAT | O_TRUNC, 0600);
    if (file < 0 || ftruncate(file, 16 << 20) != 0)
        die("the file of the memory");
    board = mmap(NULL, sizeof *board, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (board == MAP_FAILED)
        die("shared memory");
    board->axes = (uint32_t)options.axes;
    for (int i = 0; i < 2; i++)
        plants[i] = plant_of_axis(i, options.is_at_rest);
    int line = open_line(argv[2]);
    hurry();
    setvbuf(stdin, NULL, _IONBF, 0);
    for (long long due_ns = now_ns(); next_order(order, 0);) {
        if (*order)
            obey(order);
        exchange(line);
        live(options.are_swapped);
        due_ns += SLICE_US * 1000;
        if (now_ns() - due_ns > MAX_LAG_NS)
            due_ns = now_ns();
        sleep_until(due_ns);
    }
    unlink(argv[2]);
    return 0;
}
