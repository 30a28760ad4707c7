/* What differs from rig to rig. A value can also be given to make: make DEFINES='-DFORCE_LIMIT_N=3.0'. */
#ifndef CONFIG_H
#define CONFIG_H

/* The paddle, m: from its pivot to where the hand holds it (65 to 89 mm by handle), and the capstan drive between motor and paddle. */
#ifndef HANDLE_RADIUS_M
#define HANDLE_RADIUS_M 0.070
#endif
#ifndef PULLEY_RADIUS_M
#define PULLEY_RADIUS_M 0.005
#endif
#ifndef SECTOR_RADIUS_M
#define SECTOR_RADIUS_M 0.074
#endif

/* Travel of the handle to a turn of the motor, m. */
#define TRAVEL_PER_TURN_M (2 * 3.14159265358979 * PULLEY_RADIUS_M / SECTOR_RADIUS_M * HANDLE_RADIUS_M)

/* The motor behind its amplifier: torque = FULL_TORQUE_NM * duty^2. */
#ifndef FULL_TORQUE_NM
#define FULL_TORQUE_NM 0.03
#endif

/* The force on the hand at a duty of 1, N. Better than this formula is a spring scale at the handle. */
#ifndef FULL_FORCE_N
#define FULL_FORCE_N (FULL_TORQUE_NM * SECTOR_RADIUS_M / (PULLEY_RADIUS_M * HANDLE_RADIUS_M))
#endif

/* The largest force on the hand, N. It goes into the hello, and every command is cut to it. */
#ifndef FORCE_LIMIT_N
#define FORCE_LIMIT_N 5.0
#endif

/* 1 where a positive force drives D8 low; check_rig.py --push finds out. */
#ifndef MOTOR_REVERSED
#define MOTOR_REVERSED 0
#endif

/* Quadrature encoder on the motor's shaft: lines to a turn; each is four counts. */
#ifndef ENCODER_LINES
#define ENCODER_LINES 512
#endif

/* Its counts to a metre of the handle. Better than this formula is a ruler; and a rig without a paddle has its own. */
#ifndef COUNTS_PER_METRE
#define COUNTS_PER_METRE (4.0 * ENCODER_LINES / TRAVEL_PER_TURN_M)
#endif

/* Magneto-resistive sensor under a magnet on the motor's shaft: it goes through its range twice a turn, and flips. Readings, of 1023, at the ends
 * of the range. A reading closer than the margin to 0 or 1023 is a wire that is off. */
#ifndef SENSOR_LOW
#define SENSOR_LOW 51
#endif
#ifndef SENSOR_HIGH
#define SENSOR_HIGH 972
#endif
#ifndef SENSOR_FAULT_MARGIN
#define SENSOR_FAULT_MARGIN 20
#endif

/* Samples a second, Hz. The processor has time for no more than 2000. */
#ifndef SAMPLE_RATE_HZ
#define SAMPLE_RATE_HZ 1000L
#endif

/* Bits a second. A divisor of F_CPU / 8. */
#ifndef BAUD_HZ
#define BAUD_HZ 1000000UL
#endif

#endif
