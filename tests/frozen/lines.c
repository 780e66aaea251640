// return x + 0.1
static real kernel(float x) {
    return (real)x + REAL(0.1);
}

// return WIDE * x - GAP
static real kernel(float x) {
    return WIDE * (real)x - GAP;
}

// return -(x + GAP) * -WIDE
static real kernel(float x) {
    return -((real)x + GAP) * -WIDE;
}

// return x - (n - 1) - n
static float kernel(float x, int32_t n) {
    return x - (float)(n - 1) - (float)n;
}

// return (x + n) / COUNT
static float kernel(float x, int32_t n) {
    return (x + (float)n) / (float)COUNT;
}

// return n / COUNT
static real kernel(int32_t n) {
    return (real)n / (real)COUNT;
}

// return n // COUNT + n % COUNT
static int32_t kernel(int32_t n) {
    return quotient_of(n, COUNT) + remainder_of(n, COUNT);
}

// return x % 2.0 + n
static real kernel(float x, int32_t n) {
    return modulo(x, 2.0f) + (real)n;
}

// return x ** 2 + 3 ** 2 + 1.5 ** 2
static real kernel(float x) {
    return squared(x) + 9.0f + 2.25f;
}

// return 2 * 3 + COUNT
static int32_t kernel(void) {
    return 2 * 3 + COUNT;
}

// return not is_on
static bool kernel(bool is_on) {
    return !is_on;
}

// return not x
static bool kernel(float x) {
    return !(x != 0);
}

// return x - (x + x) / (x * x) * (x / x) - -n
static float kernel(float x, int32_t n) {
    return x - (x + x) / (x * x) * (x / x) - (float)-n;
}

// return not (n and is_on)
static bool kernel(int32_t n, bool is_on) {
    return !(n != 0 && is_on);
}

// return not WHITE
static bool kernel(void) {
    return true;
}

// return is_on and (x > 1.0 or n == 2)
static bool kernel(float x, int32_t n, bool is_on) {
    return is_on && (x > 1.0f || n == 2);
}

// return is_on or x > 1.0 and n != 2
static bool kernel(float x, int32_t n, bool is_on) {
    return is_on || (x > 1.0f && n != 2);
}

// return WHITE or x < 1.0
static bool kernel(float x) {
    return false || x < 1.0f;
}

// return 1 < COUNT <= 3
static bool kernel(void) {
    return true;
}

// return 0.0 < x <= n
static bool kernel(float x, int32_t n) {
    return 0.0f < x && x <= (float)n;
}

// return (x < 1.0) == is_on
static bool kernel(float x, bool is_on) {
    return (x < 1.0f) == is_on;
}

// return (1.0 if is_on else x) + 2.0
static real kernel(float x, bool is_on) {
    return (is_on ? 1.0f : x) + 2.0f;
}

// return 1.0 if (x if is_on else n) else (2.0 if n else 3.0)
static real kernel(float x, int32_t n, bool is_on) {
    return (is_on ? x : (float)n) != 0 ? 1.0f : (n != 0 ? 2.0f : 3.0f);
}

// return 1.0 if COUNT > 2 else x
static real kernel(float x) {
    return 1.0f;
}

// return 1.0 if (is_on if n else x > 2.0) else 2.0
static real kernel(float x, int32_t n, bool is_on) {
    return (n != 0 ? is_on : x > 2.0f) ? 1.0f : 2.0f;
}

// return n + stat.ST_SIZE
static int32_t kernel(int32_t n) {
    return n + ST_SIZE;
}

// return entry_of(TABLE, n)
static real kernel(int32_t n) {
    return entry_of(n);
}

// return numbers.max() + np.argmin(numbers) + len(numbers)
static float kernel(const float *numbers) {
    return largest_of(numbers, 4) + (float)place_of_smallest(numbers, 4) + 4.0f;
}

// return abs(x) + abs(n) + abs(-1.5)
static real kernel(float x, int32_t n) {
    return fabsf(x) + REAL(fabs)((real)n) + REAL(fabs)(-1.5f);
}

// return min(x, 1.0) + max(x, n, 2.5)
static real kernel(float x, int32_t n) {
    return smaller_of(x, 1.0f) + larger_of(x, (real)n, 2.5f);
}

// return round(x) + int(x) + int(n) + int(memory[0, 1])
static int32_t kernel(float x, int32_t n, const double *memory) {
    return whole_number(REAL(rint)(x)) + whole_number(x) + whole_number((real)n) +
            whole_number((real)memory[1]);
}

// return bool(n) or bool(x)
static bool kernel(float x, int32_t n) {
    return n != 0 || x != 0;
}

// return float(n) + np.float32(x) + np.float64(x) + float(x)
static real kernel(float x, int32_t n) {
    return (real)n + x + (real)x + (real)x;
}

// return np.float32(WIDE)
static float kernel(void) {
    return 0.1f;
}

// return np.uint64(3) ^ key
static uint64_t kernel(uint64_t key) {
    return 0x3u ^ key;
}

// return math.sqrt(x) + np.sqrt(x) + np.sqrt(n) + math.atan2(x, n) + math.tanh(0.5)
static real kernel(float x, int32_t n) {
    return REAL(sqrt)(x) + sqrtf(x) + REAL(sqrt)((real)n) + REAL(atan2)(x,
            (real)n) + REAL(tanh)(0.5f);
}

// return math.isnan(x) and math.pi > x
static bool kernel(float x) {
    return isnan(x) && REAL(3.141592653589793) > x;
}

// return numbers[n] + numbers[n - 1] + numbers[n + 1]
static float kernel(int32_t n, const float *numbers) {
    return numbers[n] + numbers[wrapped_index(n - 1, 4)] + numbers[n + 1];
}

// return TABLE[n, 1] + TABLE[n - 1, n] + TABLE[0, 1]
static real kernel(int32_t n) {
    return TABLE[n][1] + TABLE[wrapped_index(n - 1, 2)][n] + REAL(0.1);
}

// return TABLE.shape[0] + numbers.shape[0] + memory.shape[1]
static int32_t kernel(const float *numbers, const double *memory) {
    return 2 + 4 + 3;
}

// return memory[0, n] + memory[0, 2]
static real kernel(int32_t n, const double *memory) {
    return (real)memory[n] + (real)memory[2];
}

// return numbers[1:3].max() + numbers[AT.first : AT.last + 1].max()
static float kernel(const float *numbers) {
    return largest_of(&numbers[1], 2) + largest_of(&numbers[AT_FIRST], 3);
}

// return BODY.speed + BODY.arms + SIZES[1]
static real kernel(void) {
    return BODY_SPEED + (real)BODY_ARMS + 3.0f;
}

// return math.inf if is_on else -math.inf
static real kernel(bool is_on) {
    return is_on ? INFINITY : -INFINITY;
}

// return abs(-GAP) + np.sqrt(COUNT) + -COUNT
static real kernel(void) {
    return REAL(fabs)(-GAP) + REAL(sqrt)((real)COUNT) + -3.0f;
}

// return 2.0 * WIDE * x + COUNT * (n + 1)
static real kernel(float x, int32_t n) {
    return 2.0f * WIDE * (real)x + (real)(COUNT * (n + 1));
}

// return numbers[COUNT] + TABLE[0, COUNT - 2] + numbers[AT.last]
static real kernel(const float *numbers) {
    return (real)numbers[COUNT] + REAL(0.1) + numbers[AT_LAST];
}

// return GAP if BODY.is_round else x
static real kernel(float x) {
    return GAP;
}

// return math.cos(x) * math.exp(x) / math.log(x) + math.copysign(x, -1.0) + math.sin(n)
static real kernel(float x, int32_t n) {
    return REAL(cos)(x) * REAL(exp)(x) / REAL(log)(x) + REAL(copysign)(x,
            -1.0f) + REAL(sin)((real)n);
}

// pair = pair_of(x)
// return pair[1] + pair_of(n)[0]
static real kernel(float x, int32_t n) {
    reals2 pair = pair_of(x);
    return pair.at[1] + pair_of_2(n).at[0];
}

// first, last = pair_of(twice(x))
// return first - last
static real kernel(float x) {
    const reals2 result_1 = pair_of(twice(x));
    real first = result_1.at[0];
    real last = result_1.at[1];
    return first - last;
}

// fill(numbers, x)
// fill(memory[0], n)
// return first_of(memory[0]) + first_of(numbers[1:3])
static real kernel(float x, int32_t n, float *numbers, double *memory) {
    fill(numbers, x);
    fill_2(memory, n);
    return first_of(memory) + first_of_2(&numbers[1]);
}

// part = numbers[1:3]
// part[0] = 1
// rest = memory[0]
// return part[1] + rest[n]
static real kernel(int32_t n, float *numbers, const double *memory) {
    float *part = &numbers[1];
    part[0] = 1.0f;
    const double *rest = memory;
    return part[1] + (real)rest[n];
}

// numbers[1:3] = x
// numbers[0] = n
// numbers[n] += x
// numbers[2] *= 2.0
// memory[0, 1] = x
// memory[0, 2] -= WIDE
static void kernel(float x, int32_t n, float *numbers, double *memory) {
    for (int32_t nn = 0; nn < 2; nn++) {
        (&numbers[1])[nn] = x;
    }
    numbers[0] = (float)n;
    numbers[n] += x;
    numbers[2] *= 2.0f;
    memory[1] = (double)x;
    memory[2] -= (double)WIDE;
}

// total = 0.0
// for k in range(n):
//     if k == 2:
//         continue
//     total += k
// for k in range(1, COUNT):
//     total -= numbers[k]
// return total
static real kernel(int32_t n, const float *numbers) {
    real total = 0.0f;
    for (int32_t k = 0; k < n; k++) {
        if (k == 2) {
            continue;
        }
        total += (real)k;
    }
    for (int32_t k = 1; k < COUNT; k++) {
        total -= numbers[k];
    }
    return total;
}

// total = 0
// for k in (1, 2):
//     total += k * n
// for k in range(1):
//     total += k
// return total
static int32_t kernel(int32_t n) {
    int32_t total = 0;
    total += 1 * n;
    total += 2 * n;
    total += 0;
    return total;
}

// total = x
// if n > 1:
//     total = WIDE
// # one
// # two
// return total  # three
static real kernel(float x, int32_t n) {
    real total = x;
    if (n > 1) {
        total = WIDE;
    }
    /* one two three */
    return total;
}

// if is_on:
//     y = 1.0
// elif n:
//     y = x
// else:
//     y = 2.0
// return y
static real kernel(float x, int32_t n, bool is_on) {
    real y = 0;
    if (is_on) {
        y = 1.0f;
    } else if (n != 0) {
        y = x;
    } else {
        y = 2.0f;
    }
    return y;
}

// own = np.empty(3, np.float32)
// own[0:3] = x
// a, b, c = own
// return a + b * c
static float kernel(float x) {
    float own[3];
    for (int32_t nn = 0; nn < 3; nn++) {
        (&own[0])[nn] = x;
    }
    float a = own[0];
    float b = own[1];
    float c = own[2];
    return a + b * c;
}

// wide: float = n * WIDE
// return wide
static real kernel(int32_t n) {
    real wide = (real)n * WIDE;
    return wide;
}

// pair = (x, 1.0)
// if n:
//     pair = 2.0, x
// return pair[0]
static real kernel(float x, int32_t n) {
    reals2 pair = (reals2){{x, 1.0f}};
    if (n != 0) {
        pair = (reals2){{2.0f, x}};
    }
    return pair.at[0];
}

// return
static void kernel(void) {
    return;
}

// is_on |= n > 2
// return is_on
static bool kernel(int32_t n, bool is_on) {
    is_on = is_on || n > 2;
    return is_on;
}

// n ^= 3
// return n
static int32_t kernel(int32_t n) {
    n = n ^ 3;
    return n;
}

// pair = pair_of(x)
// first, last = pair
// return first * last
static real kernel(float x) {
    reals2 pair = pair_of(x);
    real first = pair.at[0];
    real last = pair.at[1];
    return first * last;
}

// part = numbers
// fill(part, 1.0)
// return part.max()
static float kernel(float *numbers) {
    float *part = numbers;
    fill(part, 1.0f);
    return largest_of(part, 4);
}

// if COUNT < 2:
//     return x
// elif n:
//     return 2.0
// return n
static real kernel(int32_t n) {
    if (n != 0) {
        return 2.0f;
    }
    return (real)n;
}

// if n:
//     return 1.0
// elif WHITE:
//     return 2.0
// else:
//     return 3.0
static real kernel(int32_t n) {
    if (n != 0) {
        return 1.0f;
    } else {
        return 3.0f;
    }
}

// y = 0.0
// while_not = 3
// if n:
//     z = x
//     y = z * z
// for k in range(n):
//     z = 2.0
//     y += z
// return y
static real kernel(float x, int32_t n) {
    real y = 0.0f;
    if (n != 0) {
        float z = x;
        y = z * z;
    }
    for (int32_t k = 0; k < n; k++) {
        real z = 2.0f;
        y += z;
    }
    return y;
}

// numbers[0] += 1
// numbers[1] -= n
// x += 1
// n += 2
// n *= n
// return x + n
static float kernel(float x, int32_t n, float *numbers) {
    numbers[0] += 1.0f;
    numbers[1] -= (float)n;
    x += 1.0f;
    n += 2;
    n *= n;
    return x + (float)n;
}
