
/* ---- Self-test ------------------------------------------------------------------------ */

/* A load, with the deflection and the half width that elastocal gave. */
typedef struct {
    double q[ELASTOCAL_JOINTS];
    double force[3];
    double moment[3];
    double deflection[3];
    double half_width;
} load_case;

/* A reading that comes some times in a row, with the last correction that elastocal gave; before it
 * a course may begin or end. One of the numbers may be a NaN or an infinity, made from bits: C has
 * no literal that every compiler leaves alone. */
typedef struct {
    int times;
    elastocal_reading reading;
@ALONE@    int course; /* 0 goes on, 1 begins, 2 ends */
@LINKS@    int course; /* 0 goes on, 1 begins, 2 ends, 3: encoders are zeroed */
    double deviation[3];
    int place; /* of that number: 0 none, 1 time, then q, force, moment, deviation */
    uint64_t bits;
    double correction[3];
    unsigned int status;
} episode;

static const load_case LOADS[@LOADS@] = {
@LOAD_DATA@
};

static const episode EPISODES[@EPISODES@] = {
@EPISODE_DATA@
};

/* FNV-1a over the bits of a number. */
static uint64_t mixed(uint64_t sum, double number)
{
    uint64_t bits;
    (void)memcpy(&bits, &number, sizeof bits);
    return (sum ^ bits) * UINT64_C(1099511628211);
}

static uint64_t sum_of_constants(void)
{
    uint64_t sum = UINT64_C(14695981039346656037);
    int i;
    int k;
@MIXING@
    return sum;
}

/* Whether a number agrees with another within a tolerance; a NaN never does. */
static int agree(const double *found, double expected, double tolerance)
{
    return ((is_number(found) != 0) && (fabs(*found - expected) <= tolerance)) ? 1 : 0;
}

/* Put bits in the place of a number of a reading or a deviation. */
static void spoil(elastocal_reading *reading, double deviation[3], int place, uint64_t bits)
{
    double *number;
    if (place > (ELASTOCAL_JOINTS + 7)) {
        number = &deviation[place - (ELASTOCAL_JOINTS + 8)];
    } else if (place > (ELASTOCAL_JOINTS + 4)) {
        number = &reading->moment[place - (ELASTOCAL_JOINTS + 5)];
    } else if (place > (ELASTOCAL_JOINTS + 1)) {
        number = &reading->force[place - (ELASTOCAL_JOINTS + 2)];
    } else if (place > 1) {
        number = &reading->q[place - 2];
    } else {
        number = &reading->time;
    }
    if (place > 0) {
        (void)memcpy(number, &bits, sizeof bits);
    }
}

static int loads_agree(void)
{
    int all = 1;
    int k;
    int i;
@FRICTION@    double memory[ELASTOCAL_MEMORY];
@FRICTION@    elastocal_rest(LOADS[0].q, memory);
    for (k = 0; k < @LOADS@; k++) {
        const load_case *const load = &LOADS[k];
        double found[3];
        double half_width;
        double size = 0.0;
@PLAIN@        elastocal_deflection(load->q, load->force, load->moment, found);
@FRICTION@        elastocal_deflection(load->q, load->force, load->moment, memory, found);
        for (i = 0; i < 3; i++) {
            size += fabs(load->deflection[i]);
        }
        for (i = 0; i < 3; i++) {
            all &= agree(&found[i], load->deflection[i], TOLERANCE * size);
        }
@PLAIN@        half_width = elastocal_half_width(load->q, load->force, load->moment);
@FRICTION@        half_width = elastocal_half_width(load->q, load->force, load->moment, memory);
        all &= agree(&half_width, load->half_width, TOLERANCE * (load->half_width + size));
    }
    return all;
}

static int episodes_agree(void)
{
    elastocal_state state;
    elastocal_correction out;
    double time = 0.0;
    int all = 1;
    int k;
    int i;
    elastocal_start(&state);
    for (k = 0; k < @EPISODES@; k++) {
        elastocal_reading reading = EPISODES[k].reading;
        double deviation[3];
        (void)memcpy(deviation, EPISODES[k].deviation, sizeof deviation);
        spoil(&reading, deviation, EPISODES[k].place, EPISODES[k].bits);
        if (EPISODES[k].course == 1) {
            (void)elastocal_begin_course(&state, reading.q, deviation);
        }
        if (EPISODES[k].course == 2) {
            elastocal_end_course(&state);
        }
@LINKS@        if (EPISODES[k].course == 3) {
@LINKS@            elastocal_zero_encoders(&state);
@LINKS@        }
        reading.time = EPISODES[k].reading.time;
        for (i = 0; i < EPISODES[k].times; i++) {
            time += ELASTOCAL_SAMPLE;
            reading.time += time;
            spoil(&reading, deviation, EPISODES[k].place, EPISODES[k].bits);
            elastocal_step(&state, &reading, &out);
            reading.time = EPISODES[k].reading.time;
        }
        for (i = 0; i < 3; i++) {
            all &= agree(&out.correction[i], EPISODES[k].correction[i],
                         TOLERANCE * LARGEST_CORRECTION);
        }
        all &= (out.status == EPISODES[k].status) ? 1 : 0;
    }
    return all;
}

static int rkorr_agrees(void)
{
    static const double correction[3] = {0.001, -0.002, 0.003};
    static const double expected[6] = {1.0, -2.0, 3.0, 0.0, 0.0, 0.0};
    double found[6];
    int all = 1;
    int i;
    elastocal_rkorr(correction, found);
    for (i = 0; i < 6; i++) {
        all &= agree(&found[i], expected[i], TOLERANCE);
    }
    return all;
}

int elastocal_selftest(void)
{
    int result = 0;
    if (sum_of_constants() != UINT64_C(@CHECKSUM@)) {
        result = 1;
    } else if (loads_agree() == 0) {
        result = 2;
    } else if ((episodes_agree() == 0) || (rkorr_agrees() == 0)) {
        result = 3;
    } else {
        result = 0;
    }
    return result;
}
