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

static double from_edge = FIRST_TURN * 4 * ENCODER_LINES;

void sensor_start(void)
{
    set_magneto(FIRST_TURN);
    set_quadrature((long)floor(from_edge));
}

_Bool sensor_run(uint64_t cycle, double position_m)
{
    double at = turns(position_m);
    set_magneto(at);
    double to_edge = at * 4 * ENCODER_LINES;
    long count = (long)floor(from_edge), target = (long)floor(to_edge);
    uint64_t from = board_cycle();
    while (count != target) {
        /* Each edge in its moment, of a motion that is even within the step. */
        double edge = target > count ? count + 1 : count;
        double part = (edge - from_edge) / (to_edge - from_edge);
        if (!board_run(from + (uint64_t)(part * (double)(cycle - from))))
            return 0;
        count += target > count ? 1 : -1;
        set_quadrature(count);
    }
    from_edge = to_edge;
    return board_run(cycle);
}

void sensor_cut(void)
{
    is_cut = 1;
}
