/*
 * Which correction the controller holds; see live_held.h.
 *
 * An absolute correction stays at the controller where no answer comes (HOLDON 1), so that the next
 * answer moves the arm by its distance from the last answer that was taken.
 *
 * Written by elastocal @VERSION@; do not edit: export again instead.
 */
#include "live_held.h"

#include <math.h>
#include <string.h>

#define FAR_CYCLES 250 /* an IPOC that is farther off is another time of the controller */
#define IN_A_ROW 3 /* old messages that follow one another are of a program that was started anew */
#define ROUNDED (1.0 + 1e-9) /* a correction of one step may be longer by a rounding */
#define CLEARLY 2.0 /* how much farther the other correction must be for one to be in effect */

static double length_of(const double v[3])
{
    return sqrt((v[0] * v[0]) + (v[1] * v[1]) + (v[2] * v[2]));
}

static double distance_of(const double a[3], const double b[3])
{
    const double way[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return length_of(way);
}

static void copy(double to[3], const double from[3])
{
    (void)memcpy(to, from, 3U * sizeof(double));
}

static void remember(held *h, const double shift[3])
{
    h->newest = (h->newest + 1) % (LIVE_DELAY_CYCLES + 1);
    copy(h->recent[h->newest], shift);
    h->recents += (h->recents <= LIVE_DELAY_CYCLES) ? 1 : 0;
}

void held_start(held *h, held_count *c)
{
    (void)memset(h, 0, sizeof *h);
    (void)memset(c, 0, sizeof *c);
    h->came = HUGE_VAL;
    c->step = (uint32_t)((1000.0 * ELASTOCAL_CYCLE) + 0.5);
}

held_arrival held_classify(held_count *c, uint64_t ipoc, int anew)
{
    const uint32_t count = (uint32_t)(ipoc & UINT64_C(0xFFFFFFFF));
    const uint32_t ahead = count - c->last;
    const uint32_t back = c->last - count;
    const int old = (back <= ((uint32_t)FAR_CYCLES * c->step)) ? 1 : 0;
    uint32_t steps;
    if (c->begun == 0) {
        c->begun = 1;
        c->last = count;
        return HELD_FIRST;
    }
    if (ahead == 1U) {
        c->step = 1U; /* simulators that count messages */
    }
    if ((anew == 0) && (old != 0)) {
        const int follows = ((c->in_a_row > 0) && ((count - c->old) == c->step)) ? 1 : 0;
        c->in_a_row = (follows != 0) ? (c->in_a_row + 1) : 1;
        c->old = count;
        if (c->in_a_row < IN_A_ROW) {
            return HELD_OLD;
        }
    }
    c->last = count;
    c->in_a_row = 0;
    steps = ahead / c->step;
    if ((anew != 0) || (old != 0) || ((ahead % c->step) != 0U) || (steps > (uint32_t)FAR_CYCLES)) {
        return HELD_JUMPED;
    }
    c->lost += steps - 1U;
    return (steps == 1U) ? HELD_NEXT : HELD_AFTER_LOSS;
}

/* What is in effect after a jump or a silence: as held_look. */
static int decide(held *h, const double offset[3], held_effect *effect)
{
    static const double none[3] = {0.0, 0.0, 0.0};
    const int small = (length_of(h->before) <= (LIVE_STEP * ROUNDED)) ? 1 : 0;
    int begins;
    if (h->answered == 0) {
        if ((offset != NULL) && !(length_of(offset) <= (CLEARLY * LIVE_STEP))) {
            return -1;
        }
        begins = 1;
    } else if (offset == NULL) {
        begins = h->stopped; /* a program cannot be started anew within its own Timeout */
    } else {
        const double zero = length_of(offset);
        double near = distance_of(offset, h->before);
        int i;
        for (i = 0; i < h->recents; i++) {
            near = fmin(near, distance_of(offset, h->recent[i]));
        }
        begins = (zero <= near) ? 1 : 0;
        if ((small == 0) && ((CLEARLY * fmin(near, zero)) >= fmax(near, zero))) {
            remember(h, h->before);
            return 1;
        }
    }
    /* What is smaller than a step is within one of zero too. */
    copy(effect->shift, ((small != 0) || (begins == 0)) ? h->before : none);
    effect->begins = begins;
    effect->advances = ((begins != 0) && !(length_of(effect->shift) > 0.0)) ? 1 : 0;
    copy(h->last, effect->shift);
    copy(h->before, effect->shift);
    h->taken = effect->advances;
    h->asked = 0;
    h->stopped = 0;
    if (begins != 0) {
        h->recents = 0;
        h->newest = LIVE_DELAY_CYCLES;
        remember(h, none);
    }
    return 0;
}

int held_look(held *h, held_arrival arrival, const double offset[3], long delay, double now,
              held_effect *effect)
{
    const int silent = ((now - h->came) > ((double)LIVE_TIMEOUT * ELASTOCAL_CYCLE)) ? 1 : 0;
    const long grown = (delay > 0L) ? delay : 0L;
    const int taken = ((arrival == HELD_NEXT) && (grown <= h->delay)) ? 1 : 0;
    h->came = now;
    h->delay = grown;
    if ((silent != 0) || (arrival == HELD_JUMPED) || (h->answered == 0)) {
        h->asked = 1;
        h->stopped |= silent;
    }
    if (h->asked != 0) {
        return decide(h, offset, effect);
    }
    if (taken != 0) {
        /* A controller might tell of an answer a cycle later: one message more is waited for. */
        effect->advances = h->taken;
    } else {
        /* The last answer may not have been taken; the one before is within a step of either. */
        copy(h->last, h->before);
        effect->advances = 0;
    }
    h->taken = taken;
    effect->begins = 0;
    copy(effect->shift, h->last);
    return 0;
}

void held_note(held *h, const double shift[3])
{
    copy(h->before, h->last);
    copy(h->last, shift);
    h->answered = 1;
    remember(h, shift);
}
