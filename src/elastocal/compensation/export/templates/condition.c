
/* ---- From a raw reading to the wrench on the robot ------------------------------------ */

@MEDIAN_CODE@

/* 1 for a number, 0 for a NaN or an infinity. By its bits (IEEE 754: the exponent is all ones) and
 * from memory: compilers may be told that no double is one, and drop a comparison. */
static int is_number(const double *value)
{
    uint64_t bits;
    (void)memcpy(&bits, value, sizeof bits);
    return ((bits & UINT64_C(0x7FF0000000000000)) != UINT64_C(0x7FF0000000000000)) ? 1 : 0;
}

static unsigned int out_of(const double *value, double range)
{
    unsigned int problem = 0U;
    if (is_number(value) == 0) {
        problem = ELASTOCAL_INVALID;
    } else if (!((*value > -range) && (*value < range))) {
        problem = ELASTOCAL_SATURATED;
    } else {
        problem = 0U;
    }
    return problem;
}

/* 1 for joint positions, 0 where one is none. */
static int are_joints(const double q[])
{
    int all = 1;
    int i;
    for (i = 0; i < ELASTOCAL_JOINTS; i++) {
        if ((is_number(&q[i]) == 0) || !((q[i] > -JOINT_RANGE) && (q[i] < JOINT_RANGE))) {
            all = 0;
        }
    }
    return all;
}

/* Why a reading cannot be used; 0 if it can. */
static unsigned int problem_of(const elastocal_state *state, const elastocal_reading *reading)
{
    unsigned int problem = ELASTOCAL_STALE;
    int i;
    if (is_number(&reading->time) != 0) {
        const double passed = reading->time - state->time;
        problem = ((passed > 0.0) && (passed <= LONGEST_GAP)) ? 0U : ELASTOCAL_STALE;
    }
    if (reading->ok == 0) {
        problem |= ELASTOCAL_SENSOR;
    }
    for (i = 0; i < 3; i++) {
        problem |= out_of(&reading->force[i], RANGE[i]);
        problem |= out_of(&reading->moment[i], RANGE[i + 3]);
    }
    if (are_joints(reading->q) == 0) {
        problem |= ELASTOCAL_INVALID;
    }
    return problem;
}

/* Bias and tool weight removed, calibration matrix applied, moved to the tool centre point, in
 * the tcp frame. */
static void at_tcp(const elastocal_reading *reading, double wrench[6])
{
    double r[9];
    double g[3];
    double x[6];
    double y[6];
    int i;
    orientation(reading->q, r);
    for (i = 0; i < 3; i++) {
        g[i] = (r[i] * GRAVITY[0]) + (r[i + 3] * GRAVITY[1]) + (r[i + 6] * GRAVITY[2]);
        x[i] = reading->force[i] - BIAS[i];
        x[i + 3] = reading->moment[i] - BIAS[i + 3];
    }
    for (i = 0; i < 6; i++) {
        const double *const s = SENSOR_MATRIX[i];
        const double *const k = WEIGHT[i];
        y[i] = ((s[0] * x[0]) + (s[1] * x[1]) + (s[2] * x[2]) + (s[3] * x[3]) + (s[4] * x[4]) +
                (s[5] * x[5])) - ((k[0] * g[0]) + (k[1] * g[1]) + (k[2] * g[2]));
    }
    for (i = 0; i < 3; i++) {
        wrench[i] = y[i];
    }
    wrench[3] = y[3] + ((ORIGIN[1] * y[2]) - (ORIGIN[2] * y[1]));
    wrench[4] = y[4] + ((ORIGIN[2] * y[0]) - (ORIGIN[0] * y[2]));
    wrench[5] = y[5] + ((ORIGIN[0] * y[1]) - (ORIGIN[1] * y[0]));
}

/* Second-order sections, transposed direct form II. */
static double filtered(elastocal_state *state, double x, int i)
{
    double u = x;
    int s;
    for (s = 0; s < ELASTOCAL_SECTIONS; s++) {
        const double *const a = SECTION[s];
        const double y = (a[0] * u) + state->z1[s][i];
        state->z1[s][i] = ((a[1] * u) - (a[3] * y)) + state->z2[s][i];
        state->z2[s][i] = (a[2] * u) - (a[4] * y);
        u = y;
    }
    return u;
}

void elastocal_start(elastocal_state *state)
{
    int i;
    int s;
    state->time = LONG_AGO;
    state->fresh = 0;
    state->problem = ELASTOCAL_STALE;
    state->missed = HOLD_CYCLES + 1;
    state->half_width = 0.0;
@FRICTION@    state->unloaded = FREE_CYCLES;
@FRICTION@    for (i = 0; i < ELASTOCAL_MEMORY; i++) {
@FRICTION@        state->memory[i] = 0.0;
@FRICTION@    }
    for (i = 0; i < 6; i++) {
        state->wrench[i] = 0.0;
        for (s = 0; s < 5; s++) {
            state->window[s][i] = 0.0;
        }
        for (s = 0; s <= ELASTOCAL_SECTIONS; s++) {
            state->z1[s][i] = 0.0;
            state->z2[s][i] = 0.0;
        }
    }
    for (i = 0; i < 3; i++) {
        state->correction[i] = 0.0;
        state->deflection[i] = 0.0;
        state->offset[i] = 0.0;
    }
    state->refused = 0U;
@LINKS@    state->seen = 0;
@LINKS@    state->zeroed = 0;
@LINKS@    for (i = 0; i < ELASTOCAL_ENCODERS; i++) {
@LINKS@        state->beyond[i] = 0.0;
@LINKS@        state->zero[i] = 0.0;
@LINKS@    }
}

void elastocal_condition(elastocal_state *state, const elastocal_reading *reading)
{
    const unsigned int problem = problem_of(state, reading);
    double wrench[6];
    int i;
    /* A clock that was set anew costs one reading, not all that follow. */
    if (is_number(&reading->time) != 0) {
        state->time = reading->time;
    }
    state->problem = problem;
    if (problem == 0U) {
        at_tcp(reading, wrench);
        for (i = 0; i < 6; i++) {
            state->wrench[i] = filtered(state, middle(wrench[i], state->window, i), i);
        }
        state->fresh = 1;
    }
}
