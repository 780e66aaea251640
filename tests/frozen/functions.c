#ifdef SWARM_DOUBLE
typedef double real;
#define REAL(name) name
#define REAL_BITS 53
#else
typedef float real;
#define REAL(name) name##f
#define REAL_BITS 24
#endif

#define STEP 0.25f
#define COLUMN_FIRST 1
#define COLUMN_SECOND 2
#define LEAST (-0.5f)
#define WIDE REAL(0.1)

typedef struct {
    real at[2];
} reals2;

/* Of a number that is none, and of one that is too large, the nearest that there is. */
static inline int32_t whole_number(real x) {
    if (isnan(x)) {
        return 0;
    }
    return x > 1e9f ? 1000000000 : x < -1e9f ? -1000000000 : (int32_t)x;
}

static inline real smaller_of(real a, real b) {
    return b < a ? b : a;
}

static inline real larger_of(real a, real b) {
    return b > a ? b : a;
}

static inline real squared(real x) {
    return x * x;
}

/* In [0, by). */
static inline real modulo(real x, real by) {
    const real rest = REAL(fmod)(x, by);
    return rest < 0.0f ? rest + by : rest;
}

/* In [0, by). */
static inline int32_t remainder_of(int32_t x, int32_t by) {
    const int32_t rest = x % by;
    return rest < 0 ? rest + by : rest;
}

/* Rounded down. */
static inline int32_t quotient_of(int32_t x, int32_t by) {
    return x / by - (x % by < 0 ? 1 : 0);
}

/* Below 0 it counts from the end. */
static inline int32_t wrapped_index(int32_t index, int32_t length) {
    return index < 0 ? index + length : index;
}

static inline int32_t place_of_smallest(const float *numbers, int32_t length) {
    int32_t place = 0;
    for (int32_t index = 1; index < length; index++) {
        if (numbers[index] < numbers[place]) {
            place = index;
        }
    }
    return place;
}

static inline float largest_of(const float *numbers, int32_t length) {
    float most = numbers[0];
    for (int32_t index = 1; index < length; index++) {
        if (numbers[index] > most) {
            most = numbers[index];
        }
    }
    return most;
}

static const real TABLE[4] = {
    0.5f, -1.5f, 2.5f,
    4.0f,
};

static const real SHARES[4] = {
    0.5f, -1.5f, 2.5f,
    4.0f,
};

static const real ROWS[2][2] = {
    {0.5f, REAL(0.1)},
    {2.0f, 3.0f},
};

static const struct {
    real speed;
    real arms;
    bool is_round;
} body = {
    .speed = REAL(0.1),
    .arms = 2.0f,
    .is_round = true,
};

static real whole_numbers(float x, int32_t n) {
    return (real)quotient_of(n, 3) + 10.0f * (real)remainder_of(n,
            3) + 100.0f * (real)whole_number(REAL(rint)(x)) + 1000.0f * (real)whole_number(x);
}

static real rest(float x, int32_t n) {
    return modulo(x, 0.75f) - (x - (real)(n - (2 - n)) * STEP) / -2.0f;
}

static real choices(float x, int32_t n) {
    real y = 0;
    if ((x > 0.5f && !(n == 2 || n > 7)) || x < -2.0f) {
        /* an integer */
        int32_t part = 3;
        y = x * (float)part;
    } else if (0.0f < x && x <= 0.5f) {
        real part = 2.5f;
        y = x - part;
    } else {
        y = remainder_of(n, 2) != 0 ? 7.0f : larger_of(x, -1.0f);
    }
    for (int32_t index = 0; index < 4; index++) {
        if (TABLE[index] < x) {
            continue;
        }
        y += TABLE[wrapped_index(index - 1, 4)];
        break;
    }
    return smaller_of(y, 5.0f);
}

static reals2 swapped(float x, real y) {
    return (reals2){{y - STEP, squared(x)}};
}

static real tuples(float x, int32_t n) {
    reals2 pair = swapped(x, 1.0f);
    real first = pair.at[0];
    real second = pair.at[1];
    if (n > 1) {
        pair = (reals2){{2.0f, 3.0f}};
    }
    first -= (real)COLUMN_FIRST * second;
    first -= (real)COLUMN_SECOND * second;
    return first + SHARES[n] + pair.at[1] * REAL(copysign)(fabsf(x), second - 1.0f);
}

static real arrays(float x, int32_t n) {
    float numbers[4];
    /* C counts by another name */
    for (int32_t nn = 0; nn < 4; nn++) {
        (&numbers[0])[nn] = x * (float)n;
    }
    numbers[n] += 1.0f;
    float *part = &numbers[COLUMN_FIRST];
    part[1] -= 4.0f;
    bool is_odd = false;
    is_odd = is_odd || remainder_of(n, 2) == 1;
    real rest = largest_of(part, 2) + (float)place_of_smallest(part, 2) + (is_odd ? 1.0f : 0.0f);
    return (real)numbers[2] * 10.0f + rest;
}

/* Say what. */
static real described(float x, int32_t n) {
    /* First this. */
    if (n > COLUMN_SECOND && body.is_round) {
        return LEAST + STEP;
    }
    /* Then that. */
    return ROWS[n][1] * swapped(x, 1.0f).at[0] - WIDE * body.speed;
}

static void stepping(float *numbers, int32_t n) {
    numbers[n] = (float)(REAL(sqrt)((real)numbers[0] * STEP) + (n != 0 ? 1.5f : numbers[1]));
}

/* exact */
#ifdef SWARM_DOUBLE
typedef double real;
#define REAL(name) name
#define REAL_BITS 53
#else
typedef float real;
#define REAL(name) name##f
#define REAL_BITS 24
#endif

static void stepping(double *numbers, int32_t n) {
    numbers[n] = sqrt((double)(real)numbers[0] * 0.25) + (n != 0 ? 1.5 : (double)(real)numbers[1]);
}
