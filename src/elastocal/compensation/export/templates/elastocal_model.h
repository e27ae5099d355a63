/*
 * Deflection of a robot under load, and its compensation.
 *
@ABOUT@
 *
 * Written by elastocal @VERSION@; do not edit: export again instead. C99, no allocation, no
 * variables that live between calls but those of the caller. SI units and radians.
 *
 * Force and moment are those ON the robot at the tool centre point, in the base of the model.
 * Deflection is the real minus the commanded position of the tool centre point.
 */
#ifndef ELASTOCAL_MODEL_H
#define ELASTOCAL_MODEL_H

#ifdef __cplusplus
extern "C" {
#endif

#define ELASTOCAL_JOINTS @JOINTS@
#define ELASTOCAL_SPRINGS @SPRINGS@
#define ELASTOCAL_SECTIONS @SECTIONS@ /* second-order filter sections */
#define ELASTOCAL_MEDIAN @MEDIAN@ /* readings that the median takes */
@FRICTION@#define ELASTOCAL_MEMORY @MEMORY@ /* numbers that friction remembers */
@LINKS@#define ELASTOCAL_ENCODERS @ENCODERS@ /* joints with a secondary encoder */

#define ELASTOCAL_CYCLE @CYCLE@ /* s between two calls of elastocal_correct */
#define ELASTOCAL_SAMPLE @SAMPLE@ /* s between two calls of elastocal_condition */
#define ELASTOCAL_DELAY @DELAY@ /* s by which median and filters delay a slow wrench */

/* Joints, in the order of every array q:
@JOINT_NAMES@
 */
@LINKS@
@LINKS@/* Joints with a secondary encoder, in the order of every array links:
@LINKS@@ENCODER_NAMES@
@LINKS@ */

/* What a correction is to be read with: flags of `status`. */
#define ELASTOCAL_OK 0U
#define ELASTOCAL_HELD 1U /* no usable reading: the last correction is held */
#define ELASTOCAL_FADED 2U /* none for longer: the correction fades to zero, or has */
#define ELASTOCAL_LIMITED 4U /* the deflection asks for more than the largest correction */
#define ELASTOCAL_RATE 8U /* the correction is still on its way */
#define ELASTOCAL_DEADBAND 16U /* the deflection is small: not corrected, or not fully */
#define ELASTOCAL_UNCERTAIN 32U /* the interval of the deflection is too wide */
#define ELASTOCAL_STALE 64U /* the reading's time stood still, went back or jumped ahead */
#define ELASTOCAL_SATURATED 128U /* the reading is beyond the sensor's range */
#define ELASTOCAL_INVALID 256U /* the reading holds a NaN, an infinity or no joint position */
#define ELASTOCAL_SENSOR 512U /* the sensor called the reading bad */
#define ELASTOCAL_OFFSET 1024U /* the offset of the course was not taken: it is what it was */
@LINKS@#define ELASTOCAL_ENCODER 2048U /* a link was not read, or lost its count: what encoders saw last counts */

/* What arm and sensor say. */
typedef struct {
    double time; /* by the sensor's clock, s; must advance */
    double q[ELASTOCAL_JOINTS]; /* measured joint positions, rad or m */
    double force[3]; /* raw, sensor frame, N */
    double moment[3]; /* raw, sensor frame, about its origin, N m */
    int ok; /* not 0: the sensor calls the reading good */
@LINKS@    double links[ELASTOCAL_ENCODERS]; /* by secondary encoders, rad or m */
@LINKS@    int linked; /* not 0: they were read */
} elastocal_reading;

/* What is remembered from one call to the next; the caller owns it. */
typedef struct {
    double time;
    int fresh;
    unsigned int problem;
    int missed;
    double window[5][6];
    double z1[ELASTOCAL_SECTIONS + 1][6];
    double z2[ELASTOCAL_SECTIONS + 1][6];
    double wrench[6]; /* conditioned, tcp frame: force in N, moment in N m */
    double correction[3];
    double deflection[3];
    double half_width;
    double offset[3]; /* of the course, base, m */
    unsigned int refused; /* ELASTOCAL_OFFSET, or 0 */
@LINKS@    double beyond[ELASTOCAL_ENCODERS]; /* what encoders see beyond the model, rad or m */
@LINKS@    double zero[ELASTOCAL_ENCODERS]; /* the same when they were zeroed */
@LINKS@    int seen; /* whether they were read */
@LINKS@    int zeroed;
@FRICTION@    double memory[ELASTOCAL_MEMORY]; /* of friction */
@FRICTION@    int unloaded; /* corrections in a row without load */
} elastocal_state;

/* What the controller is told. */
typedef struct {
    double correction[3]; /* to add to the commanded position, m, in axes of @FRAME@ */
    double deflection[3]; /* predicted, base, m; the last one while held */
    double half_width; /* half the 95 % interval of its most uncertain component, m */
    unsigned int status;
} elastocal_correction;

@FRICTION@/* What friction remembers when a free motion has brought the unloaded arm to joints q: of each
@FRICTION@ * element the torque that it bears less the whole torque; of each gear with friction the lowest
@FRICTION@ * and the highest torque since then and that of the load, N m. */
@FRICTION@void elastocal_rest(const double q[], double memory[ELASTOCAL_MEMORY]);
@FRICTION@
/* Deflection at joints q under force and moment on the robot at the tcp, all in base. Checks nothing:
@PLAIN@ * a NaN that goes in comes out. */
@FRICTION@ * a NaN that goes in comes out, and stays in the memory. The memory is that of the load before, and
@FRICTION@ * becomes that of this one: calls follow one another as the loads do. */
void elastocal_deflection(const double q[], const double force[3], const double moment[3],
@PLAIN@                          double deflection[3]);
@FRICTION@                          double memory[ELASTOCAL_MEMORY], double deflection[3]);

/* Block O of the same load: deflection[i] is the sum over s of O[i][s] * compliance[s]. */
void elastocal_block(const double q[], const double force[3], const double moment[3],
@PLAIN@                     double block[3][ELASTOCAL_SPRINGS]);
@FRICTION@                     const double memory[ELASTOCAL_MEMORY],
@FRICTION@                     double block[3][ELASTOCAL_SPRINGS], double unknown[3]);

/* Half the 95 % interval of the deflection's most uncertain component, m. */
@PLAIN@double elastocal_half_width(const double q[], const double force[3], const double moment[3]);
@FRICTION@double elastocal_half_width(const double q[], const double force[3], const double moment[3],
@FRICTION@                            const double memory[ELASTOCAL_MEMORY]);

@BUILT@#define ELASTOCAL_ARM_ERROR 1
@BUILT@/* Where the unloaded tool centre point is less where its controller has it, at joints q, base, m: the
@BUILT@ * calibrated geometry of the arm, its weight and payload. The step does not correct it: subtract it
@BUILT@ * from what is programmed, once. */
@BUILT@void elastocal_arm_error(const double q[], double error[3]);
@BUILT@
/* Before the first reading: no correction, filters at rest. The correction is zero at once: call it
 * only while corrections are switched off, never to recover in motion. */
void elastocal_start(elastocal_state *state);

/* Take a reading: every ELASTOCAL_SAMPLE seconds. */
void elastocal_condition(elastocal_state *state, const elastocal_reading *reading);

/* Give a correction: every ELASTOCAL_CYCLE seconds, also when no reading came: hold and fade count
 * these calls. */
void elastocal_correct(elastocal_state *state, const double q[], elastocal_correction *out);

@LINKS@/* The same with positions of the links by secondary encoders; NULL: not read. Once zeroed, these take
@LINKS@ * the place of the model about the axes of their joints. */
@LINKS@void elastocal_correct_with_links(elastocal_state *state, const double q[], const double links[],
@LINKS@                                  elastocal_correction *out);
@LINKS@
@LINKS@/* Zero the encoders: the tool is in the air above its course, and a correction with links was just
@LINKS@ * given. Without one, or without a usable reading of the sensor, nothing changes. */
@LINKS@void elastocal_zero_encoders(elastocal_state *state);
@LINKS@
/* Both, where sensor and controller have the same cycle. */
void elastocal_step(elastocal_state *state, const elastocal_reading *reading,
                    elastocal_correction *out);

/* Begin a course, in light contact and between two corrections: the offset of the course is what
 * marker and controller show (displacement of the marker less that of the controller since the path
 * was taught, base, m) beyond deflection and growth. The correction goes there at its rate. Returns
 * ELASTOCAL_OFFSET where it is not taken: no number, more than the largest offset, or the last
 * reading of the sensor could not be used; the offset is then what it was. */
unsigned int elastocal_begin_course(elastocal_state *state, const double q[],
                                    const double deviation[3]);

/* End a course: its offset goes, at the rate of the correction. */
void elastocal_end_course(elastocal_state *state);

/* A correction as KUKA's RKorr: X, Y, Z in mm, A, B, C in degrees (always 0). */
void elastocal_rkorr(const double correction[3], double rkorr[6]);

/* 0: constants, compiler and processor give the numbers that elastocal gave.
 * 1: a constant differs. 2: a deflection differs. 3: the compensator differs. */
int elastocal_selftest(void);

#ifdef __cplusplus
}
#endif

#endif
