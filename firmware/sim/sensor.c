#include "sensor.h"

#include "board.h"
#include "config.h"

#include <math.h>
#include <stdlib.h>

#define CHANNEL 2
#define SUPPLY_V 5.0
/* As the shaft happened to stand at power-on, turns. */
#define FIRST_TURN 0.13

static _Bool is_cut;

static double turns(double position_m)
{
    double sector_angle = position_m / HANDLE_RADIUS_M;
    return FIRST_TURN + sector_angle * SECTOR_RADIUS_M / PULLEY_RADIUS_M / (2 * M_PI);
}

/* The voltage rises through half a turn, between the marks of a ratiometric sensor. */
static void set_magneto(double at_turns)
{
    double part = 2 * at_turns - floor(2 * at_turns);
    double reading = SENSOR_LOW + part * (SENSOR_HIGH + 1 - SENSOR_LOW);
    board_set_analogue(CHANNEL, is_cut ? 0.0 : (reading + 0.5) / 1023.0 * SUPPLY_V);
}

/* A leads B by a quarter of a line. */
static void set_quadrature(long count)
{
    unsigned phase = (unsigned)count & 3;
    board_set_pin('D', 2, phase == 1 || phase == 2);
    if (!is_cut)
        board_set_pin('D', 3, phase == 2 || phase == 3);
}

_Bool sensor_run(uint64_t cycle, double position_m)
{
    static long count;
    double at = turns(position_m);
    set_magneto(at);
    long target = lround(floor(at * 4 * ENCODER_LINES)), edges = labs(target - count);
    uint64_t from = board_cycle();
    for (long edge = 1; edge <= edges; edge++) {
        if (!board_run(from + (cycle - from) * (uint64_t)edge / (uint64_t)(edges + 1)))
            return 0;
        count += target > count ? 1 : -1;
        set_quadrature(count);
    }
    return board_run(cycle);
}

void sensor_cut(void)
{
    is_cut = 1;
}
