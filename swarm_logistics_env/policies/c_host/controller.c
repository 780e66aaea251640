/* What the host has to know of a controller, whose own file the compiler includes before this. */
#include <stddef.h>
#include <stdint.h>

#ifndef SWARM_ROW
#define SWARM_ROW 141
#endif
#ifndef SWARM_COMMAND
#define SWARM_COMMAND 4
#endif
#ifndef SWARM_NUMBER
#define SWARM_NUMBER float
#endif
#ifndef SWARM_PERIOD
#define SWARM_PERIOD 0.0
#endif
#ifndef SWARM_STREAM
#define SWARM_STREAM "C controller"
#endif

#ifdef __cplusplus
extern "C" {
#endif

size_t host_robot_size(void) {
    return sizeof(swarm_robot);
}

size_t host_row(void) {
    return SWARM_ROW;
}

size_t host_command(void) {
    return SWARM_COMMAND;
}

size_t host_number_size(void) {
    return sizeof(SWARM_NUMBER);
}

double host_period(void) {
    return (double)SWARM_PERIOD;
}

const char *host_stream(void) {
    return SWARM_STREAM;
}

void host_reset(void *robot, uint64_t seed, uint32_t number) {
    swarm_reset((swarm_robot *)robot, seed, number);
}

void host_step(void *robot, const float *row, void *command) {
    swarm_step((swarm_robot *)robot, row, (SWARM_NUMBER *)command);
}

#ifdef __cplusplus
}
#endif
