/* The controller of wanderer.py in C: what a robot commands upon a row of what it senses.
 *
 * swarm-logistics judge c:examples/wanderer.c */
#include <stdint.h>

enum { ROBOTS = 0, WALLS = 16, ITEMS = 32, VIEW = 48, CARRYING = 132, CARRYING_REQUESTED = 133 };

typedef struct {
    uint32_t number; /* what a robot remembers; this one needs nothing */
} swarm_robot;

static float smaller(float a, float b) {
    return a < b ? a : b;
}

void swarm_reset(swarm_robot *robot, uint64_t seed, uint32_t number) {
    (void)seed;
    robot->number = number;
}

void swarm_step(swarm_robot *robot, const float row[141], float command[4]) {
    (void)robot;
    float clearance = smaller(row[WALLS], row[ROBOTS]); /* [m] ahead */
    /* An unladen robot drives under items, a laden one bumps into them. */
    if (row[CARRYING] > 0.0f) {
        clearance = smaller(clearance, row[ITEMS]);
    }
    int holds = row[CARRYING_REQUESTED] > 0.0f;
    for (int item = 0; item < 8; item++) {
        holds = holds || row[VIEW + 5 * item + 3] != 0.0f; /* it is a requested one */
    }
    const float speed = clearance - 0.2f;
    command[0] = speed < 0.1f ? 0.1f : smaller(speed, 1.0f); /* forward */
    command[1] = 0.0f;                                       /* left */
    command[2] = clearance < 0.6f ? 0.5f : 0.0f;             /* turn left */
    command[3] = holds ? 1.0f : -1.0f;                       /* gripper: hold, open */
}
