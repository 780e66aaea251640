/* Rows that no robot has, for a controller whose file the compiler includes before this. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static uint64_t state = 1;

/* Return the next number of xorshift64 (Marsaglia 2003). */
static uint64_t next_number(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static float next_share(void) {
    return (float)(next_number() >> 40) / 16777216.0f;
}

/* Return a number as a row has it, and now and then one that it cannot have. */
static float next_value(int kind) {
    static const float odd[] = {NAN, INFINITY, -INFINITY, 1e38f, -1e38f, 1e6f, -1e6f, 1e-42f};
    switch (kind) {
    case 0:
        return 0.0f;
    case 1:
        return next_number() % 64 == 0 ? odd[next_number() % 8] : next_share();
    case 2:
        return next_number() % 2 == 0 ? 1e6f : -1e6f;
    case 3:
        return next_share() < 0.5f ? 0.0f : 1.0f;
    default:
        return 4.0f * next_share() - 2.0f;
    }
}

int main(int argc, char **argv) {
    const long n_steps = argc > 1 ? atol(argv[1]) : 1000;
    swarm_robot robot;
    float row[SWARM_ROW];
    SWARM_NUMBER command[SWARM_COMMAND];
    for (long step = 0; step < n_steps; step++) {
        if (step % 5000 == 0) {
            swarm_reset(&robot, next_number(), (uint32_t)step);
        }
        const int kind = (int)(next_number() % 16);
        for (int column = 0; column < SWARM_ROW; column++) {
            /* Flags are set more often than any number is exactly 1. */
            row[column] = next_number() % 4 == 0 ? next_value(3) : next_value(kind);
        }
        swarm_step(&robot, row, command);
        for (int part = 0; part < SWARM_COMMAND; part++) {
            if (!(fabsf(command[part]) <= 1.00001f)) {
                printf("step %ld: command[%d] = %g\n", step, part, (double)command[part]);
                return 1;
            }
        }
    }
    return 0;
}
