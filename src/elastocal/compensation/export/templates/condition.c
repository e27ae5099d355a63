
/* ---- From a raw reading to the wrench on the robot ------------------------------------ */

@MEDIAN_CODE@

static unsigned int out_of(double value, double range)
{
    unsigned int problem = 0U;
    if (!((value > -range) && (value < range))) {
        problem = (isfinite(value) != 0) ? ELASTOCAL_SATURATED : ELASTOCAL_INVALID;
    }
    return problem;
}

/* Why a reading cannot be used; 0 if it can. */
static unsigned int problem_of(const elastocal_state *state, const elastocal_reading *reading)
{
    const double passed = reading->time - state->time;
    unsigned int problem = 0U;
    int i;
    if (!((passed > 0.0) && (passed <= LONGEST_GAP))) {
        problem |= ELASTOCAL_STALE;
    }
    if (reading->ok == 0) {
        problem |= ELASTOCAL_SENSOR;
    }
    for (i = 0; i < 3; i++) {
        problem |= out_of(reading->force[i], RANGE[i]);
        problem |= out_of(reading->moment[i], RANGE[i + 3]);
    }
    for (i = 0; i < ELASTOCAL_JOINTS; i++) {
        if (!((reading->q[i] > -JOINT_RANGE) && (reading->q[i] < JOINT_RANGE))) {
            problem |= ELASTOCAL_INVALID;
        }
    }
    return problem;
}

/* Bias and tool weight removed, moved to the tool centre point, in the tcp frame. */
static void at_tcp(const elastocal_reading *reading, double wrench[6])
{
    double r[9];
    double weight[3];
    double n[3];
    double *const f = wrench;
    int i;
    orientation(reading->q, r);
    for (i = 0; i < 3; i++) {
        weight[i] = (r[i] * WEIGHT[0]) + (r[i + 3] * WEIGHT[1]) + (r[i + 6] * WEIGHT[2]);
    }
    for (i = 0; i < 3; i++) {
        const double *const s = &SENSOR_ROTATION[3 * i];
        f[i] = (s[0] * (reading->force[0] - BIAS[0])) + (s[1] * (reading->force[1] - BIAS[1])) +
               (s[2] * (reading->force[2] - BIAS[2])) - weight[i];
        n[i] = (s[0] * (reading->moment[0] - BIAS[3])) + (s[1] * (reading->moment[1] - BIAS[4])) +
               (s[2] * (reading->moment[2] - BIAS[5]));
    }
    wrench[3] = n[0] - ((CENTRE[1] * weight[2]) - (CENTRE[2] * weight[1])) +
                ((ORIGIN[1] * f[2]) - (ORIGIN[2] * f[1]));
    wrench[4] = n[1] - ((CENTRE[2] * weight[0]) - (CENTRE[0] * weight[2])) +
                ((ORIGIN[2] * f[0]) - (ORIGIN[0] * f[2]));
    wrench[5] = n[2] - ((CENTRE[0] * weight[1]) - (CENTRE[1] * weight[0])) +
                ((ORIGIN[0] * f[1]) - (ORIGIN[1] * f[0]));
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
    }
}

void elastocal_condition(elastocal_state *state, const elastocal_reading *reading)
{
    const unsigned int problem = problem_of(state, reading);
    double wrench[6];
    int i;
    /* A clock that was set anew costs one reading, not all that follow. */
    if (isfinite(reading->time) != 0) {
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
