
/* ---- From the wrench to the correction ------------------------------------------------ */

@ALONE@@PLAIN@double elastocal_half_width(const double q[], const double force[3], const double moment[3])
@ALONE@@FRICTION@double elastocal_half_width(const double q[], const double force[3], const double moment[3],
@ALONE@@FRICTION@                            const double memory[ELASTOCAL_MEMORY])
@LINKS@/* Half the interval; where encoders are zeroed, of what they do not see. */
@LINKS@@PLAIN@static double width(const double q[], const double force[3], const double moment[3],
@LINKS@@FRICTION@static double width(const double q[], const double force[3], const double moment[3],
@LINKS@@FRICTION@                    const double memory[ELASTOCAL_MEMORY],
@LINKS@                    int zeroed)
{
    double block[3][ELASTOCAL_SPRINGS];
@FRICTION@    double unknown[3];
    double largest = 0.0;
    int row;
    int direction;
    int spring;
@PLAIN@    elastocal_block(q, force, moment, block);
@FRICTION@    elastocal_block(q, force, moment, memory, block, unknown);
    for (row = 0; row < 3; row++) {
        double variance = 0.0;
        for (direction = 0; direction < DIRECTIONS; direction++) {
            double part = 0.0;
            for (spring = 0; spring < ELASTOCAL_SPRINGS; spring++) {
@ALONE@                part += block[row][spring] * SPREAD[spring][direction];
@LINKS@                part += block[row][spring] * ((zeroed != 0) ? REST_SPREAD[spring][direction]
@LINKS@                                                            : SPREAD[spring][direction]);
            }
            variance += part * part;
        }
@PLAIN@        largest = (variance > largest) ? variance : largest;
@ALONE@@FRICTION@        variance = sqrt(variance) + unknown[row];
@LINKS@@FRICTION@        variance = sqrt(variance)
@LINKS@@FRICTION@                   + (((zeroed != 0) && (SEES_FRICTION != 0)) ? 0.0 : unknown[row]);
@FRICTION@        largest = (variance > largest) ? variance : largest;
    }
@PLAIN@    return sqrt(largest);
@FRICTION@    return largest;
}
@LINKS@
@LINKS@@PLAIN@double elastocal_half_width(const double q[], const double force[3], const double moment[3])
@LINKS@@FRICTION@double elastocal_half_width(const double q[], const double force[3], const double moment[3],
@LINKS@@FRICTION@                            const double memory[ELASTOCAL_MEMORY])
@LINKS@{
@LINKS@@PLAIN@    return width(q, force, moment, 0);
@LINKS@@FRICTION@    return width(q, force, moment, memory, 0);
@LINKS@}

/* Move the correction towards a target by no more than a step; whether it came late. */
static unsigned int move(double correction[3], const double target[3], double step)
{
    const double x = target[0] - correction[0];
    const double y = target[1] - correction[1];
    const double z = target[2] - correction[2];
    const double distance = sqrt((x * x) + (y * y) + (z * z));
    unsigned int late = 0U;
    if (distance > step) {
        const double share = step / distance;
        correction[0] += share * x;
        correction[1] += share * y;
        correction[2] += share * z;
        late = ELASTOCAL_RATE;
    } else {
        correction[0] = target[0];
        correction[1] = target[1];
        correction[2] = target[2];
    }
    return late;
}

/* Minus what the tool is off by, in the correction's frame, within deadband and limit. */
static unsigned int aim(const double d[3], const double rotation[9], double target[3])
{
    const double length = sqrt((d[0] * d[0]) + (d[1] * d[1]) + (d[2] * d[2]));
    double share = (length - DEADBAND) * DEADBAND_SLOPE;
    const double *const r = (FRAME_IS_TCP != 0) ? rotation : FRAME;
    unsigned int status = 0U;
    int i;
    if (share < 1.0) {
        status |= ELASTOCAL_DEADBAND;
    }
    share = (share > 0.0) ? share : 0.0;
    share = ((share < 1.0) ? share : 1.0) * GAIN;
    if ((length * share) > LARGEST_CORRECTION) {
        share = LARGEST_CORRECTION / length;
        status |= ELASTOCAL_LIMITED;
    }
    for (i = 0; i < 3; i++) {
        target[i] = -share * ((r[i] * d[0]) + (r[i + 3] * d[1]) + (r[i + 6] * d[2]));
    }
    return status;
}

@FRICTION@/* Count the corrections in a row that load no gear: in the air friction wears off. */
@FRICTION@static void watch(elastocal_state *state)
@FRICTION@{
@FRICTION@    const double *const load = &state->memory[ELASTOCAL_MEMORY - RUBBING];
@FRICTION@    int loaded = 0;
@FRICTION@    int i;
@FRICTION@    for (i = 0; i < RUBBING; i++) {
@FRICTION@        loaded |= ((load[i] > -LIGHT[i]) && (load[i] < LIGHT[i])) ? 0 : 1;
@FRICTION@    }
@FRICTION@    if (loaded != 0) {
@FRICTION@        state->unloaded = 0;
@FRICTION@    } else if (state->unloaded < FREE_CYCLES) {
@FRICTION@        state->unloaded += 1;
@FRICTION@    } else {
@FRICTION@        state->unloaded = FREE_CYCLES;
@FRICTION@    }
@FRICTION@}
@FRICTION@
/* How far the tool is off: by the load, in this course, and as the arm has grown. */
static void off_by(const double q[], const double deflection[3], const double offset[3],
                   double off[3])
{
    int i;
@GROWN@    double grown[3];
@GROWN@    growth(q, grown);
@COLD@    (void)q;
    for (i = 0; i < 3; i++) {
        off[i] = deflection[i] + offset[i];
@GROWN@        off[i] = off[i] + grown[i];
    }
}

@LINKS@/* What encoders see beyond the model, smoothed, and how that moves the tool since they were zeroed. */
@LINKS@static unsigned int look(elastocal_state *state, const double q[], const double links[],
@LINKS@                         const double force[3], const double moment[3], double shift[3])
@LINKS@{
@LINKS@    double out[4 * ELASTOCAL_ENCODERS];
@LINKS@    double seen[ELASTOCAL_ENCODERS];
@LINKS@    unsigned int status = 0U;
@LINKS@    int usable = (links == NULL) ? 0 : 1;
@LINKS@    int i;
@LINKS@    int k;
@LINKS@@PLAIN@    yielding(q, force, moment, out);
@LINKS@@FRICTION@    yielding(q, force, moment, state->memory, out);
@LINKS@    for (k = 0; (k < ELASTOCAL_ENCODERS) && (usable != 0); k++) {
@LINKS@        usable = ((links[k] > -JOINT_RANGE) && (links[k] < JOINT_RANGE)) ? 1 : 0;
@LINKS@    }
@LINKS@    for (k = 0; (k < ELASTOCAL_ENCODERS) && (usable != 0); k++) {
@LINKS@        seen[k] = (links[k] - q[ENCODER_JOINT[k]]) - out[k];
@LINKS@        if (state->zeroed != 0) {
@LINKS@            const double change = seen[k] - state->zero[k];
@LINKS@            usable = ((change >= -MOST_BEYOND) && (change <= MOST_BEYOND)) ? 1 : 0;
@LINKS@        }
@LINKS@    }
@LINKS@    if (usable != 0) {
@LINKS@        for (k = 0; k < ELASTOCAL_ENCODERS; k++) {
@LINKS@            const double before = (state->seen != 0) ? state->beyond[k] : seen[k];
@LINKS@            state->beyond[k] = before + (ENCODER_SHARE * (seen[k] - before));
@LINKS@        }
@LINKS@        state->seen = 1;
@LINKS@    } else {
@LINKS@        status = ELASTOCAL_ENCODER;
@LINKS@    }
@LINKS@    for (i = 0; i < 3; i++) {
@LINKS@        shift[i] = 0.0;
@LINKS@    }
@LINKS@    for (k = 0; (k < ELASTOCAL_ENCODERS) && (state->zeroed != 0); k++) {
@LINKS@        const double change = state->beyond[k] - state->zero[k];
@LINKS@        for (i = 0; i < 3; i++) {
@LINKS@            shift[i] += change * out[ELASTOCAL_ENCODERS + (3 * k) + i];
@LINKS@        }
@LINKS@    }
@LINKS@    return status;
@LINKS@}
@LINKS@
@ALONE@static unsigned int follow(elastocal_state *state, const double q[])
@LINKS@static unsigned int follow(elastocal_state *state, const double q[], const double links[])
{
@LINKS@    double shift[3];
@LINKS@    unsigned int unread;
    double r[9];
    double force[3];
    double moment[3];
    double off[3];
    double target[3];
    unsigned int status;
    int i;
    orientation(q, r);
    for (i = 0; i < 3; i++) {
        const double *const w = state->wrench;
        const double *const row = &r[3 * i];
        force[i] = (row[0] * w[0]) + (row[1] * w[1]) + (row[2] * w[2]);
        moment[i] = (row[0] * w[3]) + (row[1] * w[4]) + (row[2] * w[5]);
    }
@LINKS@@PLAIN@    unread = look(state, q, links, force, moment, shift);
@PLAIN@    elastocal_deflection(q, force, moment, state->deflection);
@ALONE@@PLAIN@    state->half_width = elastocal_half_width(q, force, moment);
@LINKS@@PLAIN@    state->half_width = width(q, force, moment, state->zeroed);
@FRICTION@    if (state->unloaded >= FREE_CYCLES) {
@FRICTION@        elastocal_rest(q, state->memory);
@FRICTION@    }
@LINKS@@FRICTION@    unread = look(state, q, links, force, moment, shift);
@FRICTION@    elastocal_deflection(q, force, moment, state->memory, state->deflection);
@ALONE@@FRICTION@    state->half_width = elastocal_half_width(q, force, moment, state->memory);
@LINKS@@FRICTION@    state->half_width = width(q, force, moment, state->memory, state->zeroed);
@FRICTION@    watch(state);
@LINKS@    for (i = 0; i < 3; i++) {
@LINKS@        state->deflection[i] = state->deflection[i] + shift[i];
@LINKS@    }
    off_by(q, state->deflection, state->offset, off);
    status = aim(off, r, target);
@LINKS@    status |= unread;
    if (state->half_width > UNCERTAIN_ABOVE) {
        status |= ELASTOCAL_UNCERTAIN;
    }
    status |= move(state->correction, target, LARGEST_STEP);
    state->missed = 0;
    return status;
}

/* Let the correction, and with it what the filters remember, shrink by a step: otherwise the first
 * readings after a gap would be corrected by the wrench before it. */
static void fade(elastocal_state *state)
{
    const double *const c = state->correction;
    const double distance = sqrt((c[0] * c[0]) + (c[1] * c[1]) + (c[2] * c[2]));
    const double share = (distance > FADE_STEP) ? ((distance - FADE_STEP) / distance) : 0.0;
    int i;
    int s;
    for (i = 0; i < 3; i++) {
        state->correction[i] *= share;
    }
    for (i = 0; i < 6; i++) {
        state->wrench[i] *= share;
        for (s = 0; s < 5; s++) {
            state->window[s][i] *= share;
        }
        for (s = 0; s <= ELASTOCAL_SECTIONS; s++) {
            state->z1[s][i] *= share;
            state->z2[s][i] *= share;
        }
    }
}

/* Hold, then fade. */
static unsigned int go_without(elastocal_state *state)
{
    unsigned int status = ELASTOCAL_HELD;
    if (state->missed <= HOLD_CYCLES) {
        state->missed += 1;
    }
    if (state->missed > HOLD_CYCLES) {
        fade(state);
        /* Where the arm is when readings come again is not known: its course may be over. */
        state->offset[0] = 0.0;
        state->offset[1] = 0.0;
        state->offset[2] = 0.0;
@FRICTION@        /* What acted meanwhile is not known: friction is as unknown as at the start. */
@FRICTION@        state->unloaded = FREE_CYCLES;
        status = ELASTOCAL_FADED;
    }
    return status;
}

@ALONE@void elastocal_correct(elastocal_state *state, const double q[], elastocal_correction *out)
@LINKS@void elastocal_correct_with_links(elastocal_state *state, const double q[], const double links[],
@LINKS@                                  elastocal_correction *out)
{
    int usable = state->fresh;
    int i;
    out->status = state->problem | state->refused;
    if (are_joints(q) == 0) {
        usable = 0;
        out->status |= ELASTOCAL_INVALID;
    }
    if (usable != 0) {
@ALONE@        out->status |= follow(state, q);
@LINKS@        out->status |= follow(state, q, links);
    } else {
        out->status |= go_without(state);
    }
    state->fresh = 0;
    for (i = 0; i < 3; i++) {
        out->correction[i] = state->correction[i];
        out->deflection[i] = state->deflection[i];
    }
    out->half_width = state->half_width;
}
@LINKS@
@LINKS@void elastocal_correct(elastocal_state *state, const double q[], elastocal_correction *out)
@LINKS@{
@LINKS@    elastocal_correct_with_links(state, q, NULL, out);
@LINKS@}
@LINKS@
@LINKS@void elastocal_zero_encoders(elastocal_state *state)
@LINKS@{
@LINKS@    if ((state->seen != 0) && (state->missed == 0) && (state->problem == 0U)) {
@LINKS@        (void)memcpy(state->zero, state->beyond, sizeof state->zero);
@LINKS@        state->zeroed = 1;
@LINKS@    }
@LINKS@}

void elastocal_step(elastocal_state *state, const elastocal_reading *reading,
                    elastocal_correction *out)
{
    elastocal_condition(state, reading);
@ALONE@    elastocal_correct(state, reading->q, out);
@LINKS@    elastocal_correct_with_links(state, reading->q, (reading->linked != 0) ? reading->links : NULL,
@LINKS@                                 out);
}

unsigned int elastocal_begin_course(elastocal_state *state, const double q[],
                                    const double deviation[3])
{
    static const double nothing[3] = {0.0, 0.0, 0.0};
    double o[3] = {0.0, 0.0, 0.0};
    int known = are_joints(q);
    int i;
    if ((state->missed != 0) || (state->problem != 0U)) {
        known = 0;
    }
    for (i = 0; i < 3; i++) {
        known = (is_number(&deviation[i]) != 0) ? known : 0;
    }
    if (known != 0) {
        off_by(q, state->deflection, nothing, o);
        for (i = 0; i < 3; i++) {
            o[i] = deviation[i] - o[i];
        }
        if (!(sqrt((o[0] * o[0]) + (o[1] * o[1]) + (o[2] * o[2])) <= LARGEST_OFFSET)) {
            known = 0;
        }
    }
    state->refused = ELASTOCAL_OFFSET;
    if (known != 0) {
        (void)memcpy(state->offset, o, sizeof o);
        state->refused = 0U;
    }
    return state->refused;
}

void elastocal_end_course(elastocal_state *state)
{
    int i;
    for (i = 0; i < 3; i++) {
        state->offset[i] = 0.0;
    }
    state->refused = 0U;
}

void elastocal_rkorr(const double correction[3], double rkorr[6])
{
    int i;
    for (i = 0; i < 3; i++) {
        rkorr[i] = 1000.0 * correction[i];
        rkorr[i + 3] = 0.0;
    }
}
