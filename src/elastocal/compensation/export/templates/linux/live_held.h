/*
 * Which correction the controller holds, seen from its messages: answers get lost, programs are
 * started anew, counts jump. No input or output, no allocation.
 *
 * Written by elastocal @VERSION@; do not edit: export again instead.
 */
#ifndef LIVE_HELD_H
#define LIVE_HELD_H

#include <stdint.h>

#include "live_config.h"

/* How a message follows the one before it. */
typedef enum { HELD_FIRST, HELD_NEXT, HELD_AFTER_LOSS, HELD_OLD, HELD_JUMPED } held_arrival;

/* Tells that from IPOC, which counts milliseconds modulo 2^32. */
typedef struct {
    int begun;
    uint32_t last;
    uint32_t step; /* of IPOC in a cycle */
    uint32_t old; /* the last of the messages that were out of order */
    int in_a_row; /* how many of those have followed one another */
    unsigned long lost;
} held_count;

/* The correction that is in effect when a cycle begins. */
typedef struct {
    double shift[3]; /* m; the next answer is within a step of it */
    int begins; /* whether the program begins without correction */
    int advances; /* whether the answer may be another one than shift */
} held_effect;

typedef struct {
    double last[3]; /* of the last answer, m */
    double before[3]; /* of the one before */
    double recent[LIVE_DELAY_CYCLES + 1][3]; /* what may show in RIst less RSol by now, m */
    int recents;
    int newest;
    double came; /* the last message, s */
    long delay; /* Delay D of it */
    int taken; /* whether the last answer but one was taken */
    int asked; /* whether it is to be told what is in effect */
    int stopped; /* whether the controller was silent for longer than its Timeout */
    int answered;
} held;

/* Begin: nothing has come yet. */
void held_start(held *h, held_count *c);

/* How a message with an IPOC follows; anew: whether something else tells of a new program. */
held_arrival held_classify(held_count *c, uint64_t ipoc, int anew);

/* What is in effect in a cycle, 0: known; 1: not known, no answer is safe; -1: a correction that is
 * not of this program. The offset is RIst less RSol in m, NULL where they are not sent; delay is
 * -1 where it is not; now is in s. */
int held_look(held *h, held_arrival arrival, const double offset[3], long delay, double now,
              held_effect *effect);

/* Take down the correction of an answer, m. */
void held_note(held *h, const double shift[3]);

#endif
