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

/* The motor behind its amplifier: torque = FULL_TORQUE_NM * duty^2. */
#ifndef FULL_TORQUE_NM
#define FULL_TORQUE_NM 0.03
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

/* Magneto-resistive sensor under a magnet on the motor's shaft: it goes through its range twice a turn, and flips. Readings, of 1023, at the ends
 * of the range; a reading outside of 1..FAULT_MARGIN from the supply rails is a broken wire. */
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
