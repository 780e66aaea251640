/* A program that lets a controller decide for the robots that come in, and keeps none of them.
 *
 * It tells the sizes of a robot, a row and a command, the period and the stream. Then it reads
 * requests until its input ends: what to do, for how many robots, and the seed.
 *
 * To reset: it answers with the robots. To step: robots and rows follow; it answers with the robots
 * and their commands. To time: the same follow; it answers with the seconds that the steps took.
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
double host_period(void);
const char *host_stream(void);
void host_reset(void *robot, uint64_t seed, uint32_t number);
void host_step(void *robot, const float *row, float *command);

#define LONGEST 60 /* [s] that an answer may take: a controller that never ends is ended */

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

static void answer(FILE *answers, const request_of_host *request) {
    const size_t n = request->n_robots;
    char *robots = room_for(n, host_robot_size());
    float *rows = room_for(n, host_row() * sizeof(float));
    float *commands = room_for(n, host_command() * sizeof(float));
    if (request->what != RESET) {
        read_into(robots, n, host_robot_size());
        read_into(rows, n, host_row() * sizeof(float));
    }
    const clock_t start = clock();
    for (size_t number = 0; number < n; number++) {
        void *robot = robots + number * host_robot_size();
        if (request->what == RESET) {
            host_reset(robot, request->seed, (uint32_t)number);
        } else {
            host_step(robot, rows + number * host_row(), commands + number * host_command());
        }
    }
    if (request->what == TIME) {
        const double seconds = (double)(clock() - start) / (double)CLOCKS_PER_SEC;
        fwrite(&seconds, sizeof seconds, 1, answers);
    } else {
        fwrite(robots, host_robot_size(), n, answers);
    }
    if (request->what == STEP) {
        fwrite(commands, host_command() * sizeof(float), n, answers);
    }
    fflush(answers);
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
