#include "plant.h"

#include <math.h>

#define BEGIN_S 0.5
/* The hand starts gently: over its first seconds its amplitude grows. */
#define GROWTH_S 1.0

static void hand_at(const struct hand *hand, double time_s, double *position_m, double *velocity_mps)
{
    double since = time_s - BEGIN_S, omega = 2 * M_PI * hand->frequency_hz;
    if (since <= 0) {
        *position_m = *velocity_mps = 0;
        return;
    }
    double growth = since < GROWTH_S ? since / GROWTH_S : 1, growing = since < GROWTH_S ? 1 / GROWTH_S : 0;
    *position_m = hand->amplitude_m * growth * sin(omega * since);
    *velocity_mps = hand->amplitude_m * (growing * sin(omega * since) + growth * omega * cos(omega * since));
}

/* The implicit midpoint rule: stable for any arm. Friction is an inequality, so that a handle at rest truly rests. */
void plant_step(struct plant *plant, double h, double motor_force_n)
{
    const struct hand *hand = &plant->hand;
    double wanted, speed;
    hand_at(hand, plant->time_s + 0.5 * h, &wanted, &speed);
    double pull = hand->stiffness_n_per_m * (wanted - plant->position_m) + hand->damping_ns_per_m * speed;
    double drag = 0.5 * hand->stiffness_n_per_m * h + hand->damping_ns_per_m + plant->viscous_ns_per_m;
    double inertia = 2 * plant->mass_kg / h;
    double drive = inertia * plant->velocity_mps + motor_force_n + pull;
    double middle = 0;
    if (fabs(drive) > plant->coulomb_n)
        middle = (drive - copysign(plant->coulomb_n, drive)) / (inertia + drag);
    double end = 2 * middle - plant->velocity_mps;
    plant->velocity_mps = end * middle < 0 || middle == 0 ? 0 : end;
    plant->position_m += h * middle;
    plant->hand_force_n = pull - (0.5 * hand->stiffness_n_per_m * h + hand->damping_ns_per_m) * middle;
    plant->motor_work_j += motor_force_n * middle * h;
    plant->hand_work_j += plant->hand_force_n * middle * h;
    plant->travel_m += fabs(middle) * h;
    plant->time_s += h;
}
