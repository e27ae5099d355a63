/* Runs an exported model over rows of doubles from standard input; see support/exported.py. */
#include "elastocal_model.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#ifdef COUNT
#include <valgrind/callgrind.h>
#endif

#define N ELASTOCAL_JOINTS
/* A model with friction remembers: its functions take the memory, too. */
#ifdef ELASTOCAL_MEMORY
#define REMEMBERED memory,
#define THEN_REMEMBERED , memory
#else
#define REMEMBERED
#define THEN_REMEMBERED
#endif

static int loads(void)
{
    double row[N + 6];
    double out[4];
#ifdef ELASTOCAL_MEMORY
    double memory[ELASTOCAL_MEMORY];
    int begun = 0;
#endif
    while (fread(row, sizeof(double), N + 6, stdin) == N + 6) {
#ifdef ELASTOCAL_MEMORY
        if (begun == 0) {
            elastocal_rest(row, memory);
            begun = 1;
        }
#endif
        elastocal_deflection(row, &row[N], &row[N + 3], REMEMBERED out);
        out[3] = elastocal_half_width(row, &row[N], &row[N + 3] THEN_REMEMBERED);
        (void)fwrite(out, sizeof(double), 4, stdout);
    }
    return 0;
}

#ifdef ELASTOCAL_ARM_ERROR
static int arm_errors(void)
{
    double row[N];
    double out[3];
    while (fread(row, sizeof(double), N, stdin) == N) {
        elastocal_arm_error(row, out);
        (void)fwrite(out, sizeof(double), 3, stdout);
    }
    return 0;
}
#endif

static elastocal_reading reading_of(const double row[])
{
    elastocal_reading reading;
    reading.time = row[0];
    (void)memcpy(reading.q, &row[1], sizeof reading.q);
    (void)memcpy(reading.force, &row[N + 1], sizeof reading.force);
    (void)memcpy(reading.moment, &row[N + 4], sizeof reading.moment);
    reading.ok = (row[N + 7] != 0.0) ? 1 : 0;
    return reading;
}

static int steps(void)
{
    double row[N + 8];
    double out[8];
    elastocal_state state;
    elastocal_start(&state);
    while (fread(row, sizeof(double), N + 8, stdin) == N + 8) {
        const elastocal_reading reading = reading_of(row);
        elastocal_correction told;
        elastocal_step(&state, &reading, &told);
        (void)memcpy(out, told.correction, sizeof told.correction);
        (void)memcpy(&out[3], told.deflection, sizeof told.deflection);
        out[6] = told.half_width;
        out[7] = (double)told.status;
        (void)fwrite(out, sizeof(double), 8, stdout);
    }
    return 0;
}

/* As steps, with what comes before the reading: 1 a course begins with a deviation, 2 it ends. */
static int courses(void)
{
    double row[N + 12];
    double out[5];
    elastocal_state state;
    elastocal_start(&state);
    while (fread(row, sizeof(double), N + 12, stdin) == N + 12) {
        const elastocal_reading reading = reading_of(row);
        elastocal_correction told;
        out[4] = 0.0;
        if (row[N + 8] == 1.0) {
            out[4] = (double)elastocal_begin_course(&state, reading.q, &row[N + 9]);
        } else if (row[N + 8] == 2.0) {
            elastocal_end_course(&state);
        }
        elastocal_step(&state, &reading, &told);
        (void)memcpy(out, told.correction, sizeof told.correction);
        out[3] = (double)told.status;
        (void)fwrite(out, sizeof(double), 5, stdout);
    }
    return 0;
}

static double now(void)
{
    return (double)clock() / CLOCKS_PER_SEC;
}

/* Prints seconds a call of deflection and step, over rows of loads. */
static int timing(void)
{
    static double rows[1000][N + 6];
    const size_t read = fread(rows, sizeof rows[0], 1000, stdin);
    double out[3];
    double sum = 0.0;
    elastocal_state state;
    double start = now();
    long i;
    const long calls = 1000000;
#ifdef ELASTOCAL_MEMORY
    double memory[ELASTOCAL_MEMORY];
    elastocal_rest(rows[0], memory);
#endif
    for (i = 0; i < calls; i++) {
        const double *const row = rows[(size_t)i % read];
        elastocal_deflection(row, &row[N], &row[N + 3], REMEMBERED out);
        sum += out[0];
    }
    printf("%.6g ", (now() - start) / (double)calls);
    elastocal_start(&state);
    start = now();
    for (i = 0; i < calls / 10; i++) {
        const double *const row = rows[(size_t)i % read];
        elastocal_reading reading;
        elastocal_correction told;
        reading.time = ELASTOCAL_SAMPLE * (double)i;
        (void)memcpy(reading.q, row, sizeof reading.q);
        (void)memcpy(reading.force, &row[N], sizeof reading.force);
        (void)memcpy(reading.moment, &row[N + 3], sizeof reading.moment);
        reading.ok = 1;
        elastocal_step(&state, &reading, &told);
        sum += told.correction[0];
    }
    printf("%.6g %.3g\n", 10.0 * (now() - start) / (double)calls, sum);
    return 0;
}

#ifdef COUNT
/* Leaves a callgrind dump for every call. */
static int count(void)
{
    double row[N + 6];
    double time = 0.0;
    double out[3];
    elastocal_state state;
#ifdef ELASTOCAL_MEMORY
    double memory[ELASTOCAL_MEMORY] = {0.0};
#endif
    elastocal_start(&state);
    while (fread(row, sizeof(double), N + 6, stdin) == N + 6) {
        elastocal_reading reading;
        elastocal_correction told;
        CALLGRIND_ZERO_STATS;
        elastocal_deflection(row, &row[N], &row[N + 3], REMEMBERED out);
        CALLGRIND_DUMP_STATS_AT("deflection");
        time += ELASTOCAL_SAMPLE;
        reading.time = time;
        (void)memcpy(reading.q, row, sizeof reading.q);
        (void)memcpy(reading.force, &row[N], sizeof reading.force);
        (void)memcpy(reading.moment, &row[N + 3], sizeof reading.moment);
        reading.ok = 1;
        CALLGRIND_ZERO_STATS;
        elastocal_step(&state, &reading, &told);
        CALLGRIND_DUMP_STATS_AT("step");
    }
    return 0;
}
#endif

int main(int argc, char **argv)
{
    int result = 2;
    const char *const mode = (argc > 1) ? argv[1] : "selftest";
#ifdef ELASTOCAL_ARM_ERROR
    if (strcmp(mode, "arm") == 0) {
        return arm_errors();
    }
#endif
    if (strcmp(mode, "loads") == 0) {
        result = loads();
    } else if (strcmp(mode, "steps") == 0) {
        result = steps();
    } else if (strcmp(mode, "courses") == 0) {
        result = courses();
    } else if (strcmp(mode, "timing") == 0) {
        result = timing();
#ifdef COUNT
    } else if (strcmp(mode, "count") == 0) {
        result = count();
#endif
    } else {
        result = elastocal_selftest();
    }
    return result;
}
