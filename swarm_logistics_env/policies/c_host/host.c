/* A program that lets a controller decide for the robots that come in, and keeps none of them.
 *
 * It tells the sizes of a robot, a row, a command and its numbers, the period and the stream. Then
 * it reads requests until its input ends: what to do, for how many robots, and the seed.
 *
 * To reset: it answers with the robots. To step: robots and rows follow; it answers with the robots
 * and their commands. To time: the same follow; it answers with the seconds of each robot's step,
 * the least of some, as the machine interrupts others.
 * All numbers are as this machine has them.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#define dup _dup
#define dup2 _dup2
#define fdopen _fdopen
#define alarm(seconds) ((void)0)
#else
#include <unistd.h>
#endif

size_t host_robot_size(void);
size_t host_row(void);
size_t host_command(void);
size_t host_number_size(void);
double host_period(void);
const char *host_stream(void);
void host_reset(void *robot, uint64_t seed, uint32_t number);
void host_step(void *robot, const float *row, void *command);

#define LONGEST 60 /* [s] that an answer may take: a controller that never ends is ended */

#define N_TIMES 5 /* that a step is timed */

enum { RESET, STEP, TIME };

typedef struct {
    uint32_t what;
    uint32_t n_robots;
    uint64_t seed;
} request_of_host;

typedef struct {
    uint64_t robot_size;
    uint64_t row;
    uint64_t command;
    uint64_t number_size;
    double period;
    char stream[64];
} facts_of_controller;

static void *room_for(size_t count, size_t size) {
    /* Of zeros, so that a robot is the same bytes each time. */
    void *room = calloc(count ? count : 1, size ? size : 1);
    if (room == NULL) {
        fprintf(stderr, "no memory for %zu robots\n", count);
        exit(1);
    }
    return room;
}

static void read_into(void *room, size_t count, size_t size) {
    if (fread(room, size, count, stdin) != count) {
        exit(1);
    }
}

static double seconds_of_step(const void *robot, const float *row, void *command, void *copy) {
    double least = 0.0;
    for (int time = 0; time < N_TIMES; time++) {
        struct timespec start, end;
        memcpy(copy, robot, host_robot_size());
        timespec_get(&start, TIME_UTC);
        host_step(copy, row, command);
        timespec_get(&end, TIME_UTC);
        const double nanoseconds = (double)(end.tv_nsec - start.tv_nsec);
        const double seconds = difftime(end.tv_sec, start.tv_sec) + 1e-9 * nanoseconds;
        least = time == 0 || seconds < least ? seconds : least;
    }
    return least;
}

static void answer(FILE *answers, const request_of_host *request) {
    const size_t n = request->n_robots;
    const size_t command_size = host_command() * host_number_size();
    char *robots = room_for(n, host_robot_size());
    float *rows = room_for(n, host_row() * sizeof(float));
    char *commands = room_for(n, command_size);
    double *seconds = room_for(n, sizeof(double));
    char *copy = room_for(1, host_robot_size());
    if (request->what != RESET) {
        read_into(robots, n, host_robot_size());
        read_into(rows, n, host_row() * sizeof(float));
    }
    for (size_t number = 0; number < n; number++) {
        void *robot = robots + number * host_robot_size();
        const float *row = rows + number * host_row();
        void *command = commands + number * command_size;
        if (request->what == RESET) {
            host_reset(robot, request->seed, (uint32_t)number);
        } else if (request->what == STEP) {
            host_step(robot, row, command);
        } else {
            seconds[number] = seconds_of_step(robot, row, command, copy);
        }
    }
    if (request->what == TIME) {
        fwrite(seconds, sizeof(double), n, answers);
    } else {
        fwrite(robots, host_robot_size(), n, answers);
    }
    if (request->what == STEP) {
        fwrite(commands, command_size, n, answers);
    }
    fflush(answers);
    free(copy);
    free(seconds);
    free(commands);
    free(rows);
    free(robots);
}

int main(void) {
    /* What a controller prints goes where errors go, not between the answers. */
    FILE *answers = fdopen(dup(1), "wb");
    dup2(2, 1);
#ifdef _WIN32
    _setmode(_fileno(stdin), _O_BINARY);
#endif
    if (answers == NULL) {
        return 1;
    }
    facts_of_controller facts;
    memset(&facts, 0, sizeof facts);
    facts.robot_size = host_robot_size();
    facts.row = host_row();
    facts.command = host_command();
    facts.number_size = host_number_size();
    facts.period = host_period();
    strncpy(facts.stream, host_stream(), sizeof facts.stream - 1);
    fwrite(&facts, sizeof facts, 1, answers);
    fflush(answers);
    request_of_host request;
    while (fread(&request, sizeof request, 1, stdin) == 1) {
        alarm(LONGEST);
        answer(answers, &request);
        alarm(0);
    }
    return 0;
}
