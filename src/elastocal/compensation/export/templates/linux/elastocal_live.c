/*
 * Corrects the path of a KUKA by the wrench of a Net F/T, cycle by cycle: RSI in, wrench
 * conditioned, deflection predicted, correction out. One thread, nothing allocated in the loop.
 *
 * Not tried on a robot: verified against simulators and public layouts. It is no safety function.
 *
 * Written by elastocal @VERSION@; do not edit: export again instead.
 */
#define _DEFAULT_SOURCE 1

#include "live_held.h"
#include "live_wire.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#define PRIORITY 70
#define STACK_BYTES (256 * 1024)
#define SESSION 0.5 /* s after which a controller may come back from another port */
#ifndef WAIT
#define WAIT 60.0 /* s for the first message */
#endif
#define SAY_AGAIN 1.0 /* s between two lines about the same */
#define SILENCE 1.0 /* s after which a stop is no longer waited for */
#define LONGEST_FADE (2.0 + (ELASTOCAL_CYCLE * (LIVE_LARGEST / LIVE_FADE_STEP))) /* s */
#define STOP_CYCLES 25 /* in which the controller is told that corrections are over */
#define MOST_BACKLOG 64 /* datagrams that are passed over at once */
#define LATE_RECORDS 64U /* a record that comes so many places late is dropped; beyond: restarted */
#define HALF UINT32_C(0x80000000)
#define BINS 40000 /* of a microsecond */

/* ---- Time and counts ------------------------------------------------------------------ */

static double seconds_of(clockid_t clock)
{
    struct timespec now = {0, 0};
    (void)clock_gettime(clock, &now);
    return (double)now.tv_sec + (1e-9 * (double)now.tv_nsec);
}

typedef struct {
    uint32_t bins[BINS];
    uint64_t count;
    double longest;
} times;

static void count_time(times *t, double seconds)
{
    const double place = seconds * 1e6;
    const int bin = (place < (double)(BINS - 1)) ? ((place > 0.0) ? (int)place : 0) : (BINS - 1);
    t->bins[bin] += 1U;
    t->count += 1U;
    t->longest = (seconds > t->longest) ? seconds : t->longest;
}

/* The time that a share of all is not above, to a microsecond. */
static double quantile(const times *t, double share)
{
    const double wanted = share * (double)t->count;
    double seen = 0.0;
    int bin;
    for (bin = 0; bin < (BINS - 1); bin++) {
        seen += (double)t->bins[bin];
        if (seen >= wanted) {
            break;
        }
    }
    return fmin(1e-6 * (double)(bin + 1), t->longest);
}

/* Say something while the loop runs: at most a line a second about the same, and none that would
 * have to wait; whether it was said. */
static int say(double *said, const char *format, ...)
{
    char line[256];
    struct pollfd ready = {STDERR_FILENO, POLLOUT, 0};
    const double now = seconds_of(CLOCK_MONOTONIC);
    va_list values;
    int length;
    if ((*said > 0.0) && ((now - *said) < SAY_AGAIN)) {
        return 0;
    }
    va_start(values, format);
    length = vsnprintf(line, sizeof line, format, values);
    va_end(values);
    length = (length < (int)sizeof line) ? length : ((int)sizeof line - 1);
    if ((length > 0) && (poll(&ready, 1, 0) > 0)
        && (write(STDERR_FILENO, line, (size_t)length) == (ssize_t)length)) {
        *said = now;
        return 1;
    }
    return 0;
}

typedef struct {
    unsigned long received, answered, skipped, out_of_order, jumps, malformed, foreign, late;
    unsigned long restarts, corrected, held, faded, limited, rate_limited, uncertain, sensor;
    unsigned long records, records_lost, records_late, records_bad;
    unsigned long withheld; /* not answered, because nothing told which correction is in effect */
    long controller_delay;
    double largest_correction, largest_step;
    wire_refusal first_refused, last_refused;
} counts;

static times answer_times; /* from when the kernel had the datagram */
static times work_times; /* from when this program had it */
static counts counted;

/* ---- The sensor ------------------------------------------------------------------------ */

typedef struct {
    int socket;
    double force; /* N a count */
    double moment; /* N m a count */
    int begun;
    wire_rdt last;
    double arrived; /* of the last record that goes on, s */
    int fresh; /* whether it has not been used yet */
    uint64_t place; /* of it in the stream */
    const char *failure; /* why it is not to be trusted any more; NULL: it is */
    int good; /* whether the last record that was spoken of was good */
    double said; /* s */
} sensor;

static const double FORCE_UNITS[7] = {0.0, 4.4482216152605, 1.0, 4448.2216152605,
                                      1000.0, 9.80665, 0.00980665};
static const double TORQUE_UNITS[7] = {0.0, 0.1129848290276167, 1.3558179483314004, 1.0,
                                       0.001, 0.0980665, 1000.0};

static int connected(int kind, const char *address, int port)
{
    struct sockaddr_in place;
    struct timeval patience = {2, 0};
    const int found = socket(AF_INET, kind, 0);
    (void)memset(&place, 0, sizeof place);
    place.sin_family = AF_INET;
    place.sin_port = htons((uint16_t)port);
    if (found < 0) {
        return -1;
    }
    (void)setsockopt(found, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    (void)setsockopt(found, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if ((inet_pton(AF_INET, address, &place.sin_addr) != 1)
        || (connect(found, (const struct sockaddr *)&place, sizeof place) != 0)) {
        (void)close(found);
        return -1;
    }
    return found;
}

/* Ask the box what a count means: READCALINFO, 20 bytes out, 24 in. */
static int read_scale(sensor *s)
{
    unsigned char data[24] = {1};
    size_t have = 0U;
    const int line = connected(SOCK_STREAM, LIVE_FT_ADDRESS, LIVE_FT_TCP_PORT);
    uint32_t per_force;
    uint32_t per_torque;
    if (line < 0) {
        return -1;
    }
    if (send(line, data, 20U, MSG_NOSIGNAL) == 20) {
        while (have < sizeof data) {
            const ssize_t more = recv(line, &data[have], sizeof data - have, 0);
            if (more <= 0) {
                break;
            }
            have += (size_t)more;
        }
    }
    (void)close(line);
    if ((have != sizeof data) || (data[0] != 0x12U) || (data[1] != 0x34U) || (data[2] < 1U)
        || (data[2] > 6U) || (data[3] < 1U) || (data[3] > 6U)) {
        return -1;
    }
    per_force = ((uint32_t)data[4] << 24) | ((uint32_t)data[5] << 16) | ((uint32_t)data[6] << 8)
                | (uint32_t)data[7];
    per_torque = ((uint32_t)data[8] << 24) | ((uint32_t)data[9] << 16) | ((uint32_t)data[10] << 8)
                 | (uint32_t)data[11];
    if ((per_force == 0U) || (per_torque == 0U)) {
        return -1;
    }
    s->force = FORCE_UNITS[data[2]] / (double)per_force;
    s->moment = TORQUE_UNITS[data[3]] / (double)per_torque;
    return 0;
}

static void request(const sensor *s, unsigned char command)
{
    const unsigned char data[8] = {0x12U, 0x34U, 0U, command, 0U, 0U, 0U, 0U};
    (void)send(s->socket, data, sizeof data, MSG_NOSIGNAL);
}

/* Whether a record goes on from the one before it; what does not is dropped, or ends the trust. */
static int goes_on(sensor *s, const wire_rdt *record)
{
    const uint32_t step = record->rdt_sequence - s->last.rdt_sequence;
    const uint32_t ahead = record->ft_sequence - s->last.ft_sequence;
    if (s->failure != NULL) {
        return 0;
    }
    if (s->begun == 0) {
        s->begun = 1;
        return 1;
    }
    if ((step == 0U) || (step >= (UINT32_MAX - LATE_RECORDS))) {
        counted.records_late++;
        return 0;
    }
    if ((step >= HALF) || (ahead >= HALF)) {
        s->failure = "its counters went back: it was started anew, or another client asked for it";
        s->said = 0.0;
        (void)say(&s->said, "elastocal_live: Net F/T at %s: %s; the correction fades\n", LIVE_FT_ADDRESS,
                  s->failure);
        return 0;
    }
    counted.records_lost += step - 1U;
    s->place += step;
    return (ahead != 0U) ? 1 : 2; /* a box that repeats itself is stale, and says nothing new */
}

static void as_reading(const sensor *s, const double q[], elastocal_reading *reading)
{
    int i;
    for (i = 0; i < ELASTOCAL_JOINTS; i++) {
        reading->q[i] = q[i];
    }
    for (i = 0; i < 3; i++) {
        reading->force[i] = s->force * (double)s->last.counts[i];
        reading->moment[i] = s->moment * (double)s->last.counts[i + 3];
    }
    reading->ok = ((s->failure == NULL) && (wire_is_good(s->last.status) != 0)) ? 1 : 0;
    reading->time = (LIVE_EVERY_RECORD != 0) ? (ELASTOCAL_SAMPLE * (double)s->place) : s->arrived;
}

/* Say once that the box calls its records bad, and that they are good again. */
static void speak_of(sensor *s, uint32_t status)
{
    const int good = wire_is_good(status);
    if ((good != s->good) && (s->failure == NULL)
        && (say(&s->said, "elastocal_live: Net F/T at %s: status 0x%08lx, %s\n", LIVE_FT_ADDRESS,
                (unsigned long)status,
                (good != 0) ? "good again" : "bad: the correction is held, then fades")
            != 0)) {
        s->good = good;
    }
}

/* Take what has come; where the filters run at the rate of the box, each record is conditioned. */
static void take_records(sensor *s, elastocal_state *state, const double *q)
{
    unsigned char data[40 * WIRE_RDT_BYTES];
    int turn;
    for (turn = 0; turn < 256; turn++) {
        const ssize_t size = recv(s->socket, data, sizeof data, MSG_DONTWAIT);
        ssize_t at;
        if (size <= 0) {
            return;
        }
        if ((size % WIRE_RDT_BYTES) != 0) {
            counted.records_bad++;
            continue;
        }
        for (at = 0; at < size; at += WIRE_RDT_BYTES) {
            wire_rdt record;
            int goes;
            if (wire_read_rdt(&data[at], (size_t)(size - at), &record) != 0) {
                continue;
            }
            counted.records++;
            goes = goes_on(s, &record);
            if (goes == 0) {
                continue;
            }
            s->last = record;
            speak_of(s, record.status);
            if (goes == 1) {
                s->arrived = seconds_of(CLOCK_MONOTONIC);
                s->fresh = 1;
                if ((LIVE_EVERY_RECORD != 0) && (q != NULL)) {
                    elastocal_reading reading;
                    as_reading(s, q, &reading);
                    elastocal_condition(state, &reading);
                    s->fresh = 0;
                }
            }
        }
    }
}

static int open_sensor(sensor *s)
{
    int turn;
    (void)memset(s, 0, sizeof *s);
    s->good = 1;
    if (read_scale(s) != 0) {
        (void)fprintf(stderr, "elastocal_live: Net F/T at %s does not tell its counts (TCP %d)\n",
                      LIVE_FT_ADDRESS, LIVE_FT_TCP_PORT);
        return -1;
    }
    s->socket = connected(SOCK_DGRAM, LIVE_FT_ADDRESS, LIVE_FT_PORT);
    for (turn = 0; (s->socket >= 0) && (turn < 20); turn++) {
        struct pollfd waits = {s->socket, POLLIN, 0};
        if ((turn % 5) == 0) {
            request(s, 2U);
        }
        if (poll(&waits, 1, 100) > 0) {
            return 0;
        }
    }
    (void)fprintf(stderr, "elastocal_live: no stream from Net F/T at %s, UDP %d\n",
                  LIVE_FT_ADDRESS, LIVE_FT_PORT);
    return -1;
}

/* ---- The controller -------------------------------------------------------------------- */

typedef struct {
    int socket;
    int heard; /* whether anything has come */
    struct sockaddr_in peer;
    double heard_at;
    int anew; /* whether its port is another one */
    double said; /* s */
    held_count count;
} controller;

static int open_controller(controller *c)
{
    struct sockaddr_in place;
    const int yes = 1;
    (void)memset(c, 0, sizeof *c);
    (void)memset(&place, 0, sizeof place);
    place.sin_family = AF_INET;
    place.sin_port = htons(LIVE_RSI_PORT);
    c->socket = socket(AF_INET, SOCK_DGRAM, 0);
    if ((c->socket < 0) || (inet_pton(AF_INET, LIVE_RSI_ADDRESS, &place.sin_addr) != 1)
        || (bind(c->socket, (const struct sockaddr *)&place, sizeof place) != 0)) {
        (void)fprintf(stderr, "elastocal_live: cannot listen at %s:%d: %s\n", LIVE_RSI_ADDRESS,
                      LIVE_RSI_PORT, strerror(errno));
        return -1;
    }
#ifdef SO_TIMESTAMPNS
    (void)setsockopt(c->socket, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
#else
    (void)yes;
#endif
    return 0;
}

/* One datagram of the controller: its size, 0 where it is somebody else's, -1 where none waits. */
static ssize_t receive(controller *c, char *buffer, double *waited)
{
    static unsigned char control[256];
    struct sockaddr_in sender;
    struct iovec part = {buffer, WIRE_MOST_BYTES + 1U};
    struct msghdr message;
    struct cmsghdr *each;
    double now;
    ssize_t size;
    (void)memset(&message, 0, sizeof message);
    message.msg_name = &sender;
    message.msg_namelen = sizeof sender;
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    size = recvmsg(c->socket, &message, MSG_DONTWAIT);
    if (size < 0) {
        return -1;
    }
    *waited = 0.0;
    for (each = CMSG_FIRSTHDR(&message); each != NULL; each = CMSG_NXTHDR(&message, each)) {
#ifdef SO_TIMESTAMPNS
        if ((each->cmsg_level == SOL_SOCKET) && (each->cmsg_type == SCM_TIMESTAMPNS)) {
            struct timespec stamp;
            double age;
            (void)memcpy(&stamp, CMSG_DATA(each), sizeof stamp);
            age = seconds_of(CLOCK_REALTIME)
                  - ((double)stamp.tv_sec + (1e-9 * (double)stamp.tv_nsec));
            *waited = ((age >= 0.0) && (age < 1.0)) ? age : 0.0;
        }
#endif
    }
    now = seconds_of(CLOCK_MONOTONIC);
    /* Its port is its own choice at each start: another one is somebody else's until it is silent. */
    if ((sender.sin_addr.s_addr != inet_addr(LIVE_ROBOT_ADDRESS))
        || ((c->heard != 0) && (sender.sin_port != c->peer.sin_port)
            && ((now - c->heard_at) <= SESSION))) {
        counted.foreign++;
        return 0;
    }
    c->anew |= ((c->heard != 0) && (sender.sin_port != c->peer.sin_port)) ? 1 : 0;
    c->peer = sender;
    c->heard = 1;
    c->heard_at = now;
    counted.received++;
    return size;
}

/* Note why a telegram was refused, and say so. */
static void refused(controller *c, const wire_refusal *why)
{
    counted.malformed++;
    counted.last_refused = *why;
    if (counted.malformed == 1U) {
        counted.first_refused = *why;
        (void)say(&c->said, "elastocal_live: a telegram of %s is refused: %s%s%s\n",
                  LIVE_ROBOT_ADDRESS, why->element, (why->element[0] != '\0') ? ": " : "",
                  why->reason);
    }
}

/* ---- The loop -------------------------------------------------------------------------- */

static volatile sig_atomic_t interrupted;

static void interrupt(int number)
{
    (void)number;
    interrupted = 1;
}

typedef struct {
    elastocal_state state;
    held held;
    double sent[3]; /* the correction of the last answer, m */
    double q[ELASTOCAL_JOINTS];
    int has_q;
    int over; /* cycles that the controller has been told so */
} loop;

static double length_of(const double v[3])
{
    return sqrt((v[0] * v[0]) + (v[1] * v[1]) + (v[2] * v[2]));
}

/* Answer on the way from what is in effect to a correction, within the last bounds; what is not
 * finite is no way. */
static void go_towards(loop *l, const held_effect *e, const double wanted[3], double most)
{
    const double size = length_of(wanted);
    const double share = (size > LIVE_LARGEST) ? (LIVE_LARGEST / size) : 1.0;
    const int moves = ((e->advances != 0) && (size < HUGE_VAL)) ? 1 : 0;
    double before[3];
    double way[3] = {0.0, 0.0, 0.0};
    double distance;
    int i;
    (void)memcpy(before, (e->begins != 0) ? e->shift : l->sent, sizeof before);
    (void)memcpy(l->sent, e->shift, sizeof l->sent);
    for (i = 0; (moves != 0) && (i < 3); i++) {
        way[i] = (share * wanted[i]) - e->shift[i];
    }
    distance = length_of(way);
    for (i = 0; (moves != 0) && (i < 3); i++) {
        /* The last step lands on the target exactly: zero is to be zero. */
        l->sent[i] = (distance > most) ? (e->shift[i] + ((most / distance) * way[i]))
                                       : (share * wanted[i]);
    }
    for (i = 0; i < 3; i++) {
        way[i] = l->sent[i] - before[i];
    }
    counted.largest_step = fmax(counted.largest_step, length_of(way));
    counted.largest_correction = fmax(counted.largest_correction, length_of(l->sent));
}

static void note_status(unsigned int status)
{
    counted.corrected += ((status & (ELASTOCAL_HELD | ELASTOCAL_FADED)) == 0U) ? 1U : 0U;
    counted.held += ((status & ELASTOCAL_HELD) != 0U) ? 1U : 0U;
    counted.faded += ((status & ELASTOCAL_FADED) != 0U) ? 1U : 0U;
    counted.limited += ((status & ELASTOCAL_LIMITED) != 0U) ? 1U : 0U;
    counted.rate_limited += ((status & ELASTOCAL_RATE) != 0U) ? 1U : 0U;
    counted.uncertain += ((status & ELASTOCAL_UNCERTAIN) != 0U) ? 1U : 0U;
    counted.sensor += ((status & ELASTOCAL_SENSOR) != 0U) ? 1U : 0U;
}

/* The correction of a cycle; whether the controller is to stop. */
static int correct(loop *l, sensor *s, const held_effect *e)
{
    static const double none[3] = {0.0, 0.0, 0.0};
    elastocal_correction out;
    if (e->begins != 0) {
        elastocal_start(&l->state);
        counted.restarts++;
    }
    /* Answers get lost: the ramp goes on from what the controller holds. */
    (void)memcpy(l->state.correction, e->shift, sizeof l->state.correction);
    if (interrupted != 0) {
        go_towards(l, e, none, LIVE_FADE_STEP);
        if (length_of(l->sent) > 0.0) {
            return 0;
        }
        l->over++;
        return 1;
    }
    if ((LIVE_EVERY_RECORD == 0) && (s->fresh != 0)) {
        elastocal_reading reading;
        as_reading(s, l->q, &reading);
        elastocal_condition(&l->state, &reading);
        s->fresh = 0;
    }
    /* In every cycle, also without a reading: hold and fade count these calls. */
    elastocal_correct(&l->state, l->q, &out);
    note_status(out.status);
    go_towards(l, e, out.correction, LIVE_STEP);
    return 0;
}

/* What is in effect in a cycle; 0: known, else there is no answer. */
static int look(loop *l, controller *c, const wire_rob *message, held_effect *effect)
{
    const held_arrival arrival = held_classify(&c->count, message->ipoc, c->anew);
    int found;
    c->anew = 0;
    counted.jumps += (arrival == HELD_JUMPED) ? 1U : 0U;
    counted.out_of_order += (arrival == HELD_OLD) ? 1U : 0U;
    if (arrival == HELD_OLD) {
        return 1;
    }
    found = held_look(&l->held, arrival, (message->has_offset != 0) ? message->offset : NULL,
                      message->delay, c->heard_at, effect);
    if (found != 0) {
        counted.withheld++;
        (void)say(&c->said, "elastocal_live: no answer: RIst is %.2f mm from RSol, %s\n",
                  1e3 * length_of(message->offset),
                  (found < 0) ? "a correction that is not of this program: start the controller's"
                                " anew"
                              : "which does not tell whether the correction is in effect");
    }
    return found;
}

/* Answer the newest datagram that waits. */
static void answer(loop *l, sensor *s, controller *c)
{
    static char buffers[2][WIRE_MOST_BYTES + 1];
    char reply[WIRE_SEN_BYTES];
    wire_rob message;
    wire_refusal why;
    held_effect effect;
    double millimetres[6];
    double waited = 0.0;
    double begun = 0.0;
    ssize_t size = 0;
    size_t length;
    int newest = 0;
    int turn;
    int stop;
    for (turn = 0; turn < MOST_BACKLOG; turn++) {
        double age;
        const ssize_t found = receive(c, buffers[1 - newest], &age);
        if (found < 0) {
            break;
        }
        if (found > 0) {
            counted.skipped += (size > 0) ? 1U : 0U;
            newest = 1 - newest;
            size = found;
            waited = age;
            begun = c->heard_at;
        }
    }
    if (size <= 0) {
        return;
    }
    if (wire_read_rob(buffers[newest], (size_t)size, &message, &why) != 0) {
        refused(c, &why);
        return;
    }
    if (message.delay > counted.controller_delay) {
        counted.controller_delay = message.delay;
    }
    (void)memcpy(l->q, message.q, sizeof l->q);
    l->has_q = 1;
    if (look(l, c, &message, &effect) != 0) {
        return;
    }
    take_records(s, &l->state, l->q);
    stop = correct(l, s, &effect);
    held_note(&l->held, l->sent);
    elastocal_rkorr(l->sent, millimetres);
    length = wire_write_sen(reply, stop, millimetres, message.ipoc);
    if (sendto(c->socket, reply, length, 0, (const struct sockaddr *)&c->peer, sizeof c->peer)
        == (ssize_t)length) {
        const double took = seconds_of(CLOCK_MONOTONIC) - begun;
        counted.answered++;
        count_time(&work_times, took);
        count_time(&answer_times, took + waited);
        counted.late += ((took + waited) > (0.875 * ELASTOCAL_CYCLE)) ? 1U : 0U;
    }
}

/* Until the duration is over or somebody interrupts, and the correction has faded. */
static int run(loop *l, sensor *s, controller *c, double duration)
{
    const double opened = seconds_of(CLOCK_MONOTONIC);
    double first = -1.0;
    double asked = -1.0;
    elastocal_start(&l->state);
    held_start(&l->held, &c->count);
    while (l->over < STOP_CYCLES) {
        struct pollfd waits[2] = {{c->socket, POLLIN, 0}, {s->socket, POLLIN, 0}};
        const int ready = poll(waits, 2, 50);
        const double now = seconds_of(CLOCK_MONOTONIC);
        if ((ready > 0) && ((waits[0].revents & POLLIN) != 0)) {
            answer(l, s, c);
        } else if (ready > 0) {
            take_records(s, &l->state, (l->has_q != 0) ? l->q : NULL);
        } else {
            /* Nothing has come. */
        }
        first = ((first < 0.0) && (l->has_q != 0)) ? now : first;
        if ((first >= 0.0) && ((now - first) >= duration)) {
            interrupted = 1;
        }
        if (interrupted != 0) {
            asked = (asked < 0.0) ? now : asked;
            if ((c->heard == 0) || ((now - c->heard_at) > SILENCE) || (l->held.answered == 0)
                || ((now - asked) > LONGEST_FADE)) {
                break; /* nobody is there to be told, or who is there is not answered */
            }
        }
        if ((first < 0.0) && ((now - opened) > WAIT)) {
            const wire_refusal *const why = &counted.first_refused;
            (void)fprintf(stderr, "elastocal_live: nothing from %s for %g s", LIVE_ROBOT_ADDRESS,
                          WAIT);
            if (counted.malformed > 0U) {
                (void)fprintf(stderr, " (%lu telegrams refused: %s%s%s)", counted.malformed,
                              why->element, (why->element[0] != '\0') ? ": " : "", why->reason);
            }
            (void)fprintf(stderr, "\n");
            return 1;
        }
    }
    return 0;
}

/* ---- The process ----------------------------------------------------------------------- */

static int touch_stack(void)
{
    volatile unsigned char room[STACK_BYTES];
    int i;
    int sum = 0;
    for (i = 0; i < STACK_BYTES; i += 1024) {
        room[i] = 1U;
        sum += room[i];
    }
    return sum;
}

/* Memory locked, SCHED_FIFO; what is not allowed is said, and it goes on without. */
static void ask_real_time(int *locked, int *priority)
{
    struct sched_param wanted;
    (void)memset(&wanted, 0, sizeof wanted);
    wanted.sched_priority = PRIORITY;
    *locked = (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) ? 1 : 0;
    if (*locked == 0) {
        (void)fprintf(stderr, "elastocal_live: memory is not locked: %s\n", strerror(errno));
    }
    *priority = (sched_setscheduler(0, SCHED_FIFO, &wanted) == 0) ? PRIORITY : 0;
    if (*priority == 0) {
        (void)fprintf(stderr, "elastocal_live: scheduled like any program, SCHED_FIFO: %s\n",
                      strerror(errno));
    }
    (void)touch_stack();
}

static void print_times(const char *name, const times *t)
{
    (void)printf("\"%s\": {\"p50\": %.6f, \"p99\": %.6f, \"p999\": %.6f, \"longest\": %.6f}, ", name,
                 quantile(t, 0.5), quantile(t, 0.99), quantile(t, 0.999), t->longest);
}

static void print_refusal(const char *name, const wire_refusal *why)
{
    if (why->reason == NULL) {
        (void)printf("\"%s\": null, ", name);
    } else {
        (void)printf("\"%s\": \"%s%s%s\", ", name, why->element,
                     (why->element[0] != '\0') ? ": " : "", why->reason);
    }
}

static void print_counts(const controller *c, int locked, int priority, const char *failure)
{
    const counts *const n = &counted;
    (void)printf("{");
    print_times("answer", &answer_times);
    print_times("work", &work_times);
    (void)printf("\"received\": %lu, \"answered\": %lu, \"lost\": %lu, \"skipped\": %lu, ",
                 n->received, n->answered, c->count.lost, n->skipped);
    (void)printf("\"out_of_order\": %lu, \"jumps\": %lu, \"malformed\": %lu, \"foreign\": %lu, ",
                 n->out_of_order, n->jumps, n->malformed, n->foreign);
    print_refusal("first_refused", &n->first_refused);
    print_refusal("last_refused", &n->last_refused);
    (void)printf("\"withheld\": %lu, ", n->withheld);
    (void)printf("\"late\": %lu, \"controller_delay\": %ld, \"restarts\": %lu, ", n->late,
                 n->controller_delay, n->restarts);
    (void)printf("\"corrected\": %lu, \"held\": %lu, \"faded\": %lu, \"limited\": %lu, ",
                 n->corrected, n->held, n->faded, n->limited);
    (void)printf("\"rate_limited\": %lu, \"uncertain\": %lu, \"refused\": %lu, ", n->rate_limited,
                 n->uncertain, n->sensor);
    (void)printf("\"records\": %lu, \"records_lost\": %lu, \"records_late\": %lu, ", n->records,
                 n->records_lost, n->records_late);
    (void)printf("\"records_bad\": %lu, \"largest_correction\": %.9f, \"largest_step\": %.9f, ",
                 n->records_bad, n->largest_correction, n->largest_step);
    (void)printf("\"memory_locked\": %s, \"fifo_priority\": %d, \"sensor_failure\": %s%s%s}\n",
                 (locked != 0) ? "true" : "false", priority, (failure != NULL) ? "\"" : "",
                 (failure != NULL) ? failure : "null", (failure != NULL) ? "\"" : "");
}

static int usage(void)
{
    (void)fprintf(stderr,
                  "usage: elastocal_live --selftest | --arm [--duration SECONDS]\n"
                  "--arm says that somebody has looked at the cell: the arm of %s is corrected by\n"
                  "up to %g mm at up to %g mm/s\n",
                  LIVE_ROBOT_ADDRESS, 1e3 * LIVE_LARGEST, 1e3 * LIVE_STEP / ELASTOCAL_CYCLE);
    return 2;
}

int main(int count, char **words)
{
    static sensor box;
    static controller robot;
    static loop work;
    struct sigaction action;
    double duration = HUGE_VAL;
    int armed = 0;
    int locked = 0;
    int priority = 0;
    int i;
    int result = elastocal_selftest();
    result = (result != 0) ? result : wire_selftest();
    if ((count == 2) && (strcmp(words[1], "--selftest") == 0)) {
        return result;
    }
    for (i = 1; i < count; i++) {
        if (strcmp(words[i], "--arm") == 0) {
            armed = 1;
        } else if ((strcmp(words[i], "--duration") == 0) && ((i + 1) < count)) {
            char *end = NULL;
            i++;
            duration = strtod(words[i], &end);
            if ((end == words[i]) || (*end != '\0') || !(duration > 0.0)) {
                return usage();
            }
        } else {
            return usage();
        }
    }
    if (armed == 0) {
        return usage();
    }
    if (result != 0) {
        (void)fprintf(stderr, "elastocal_live: the self-test gives %d: see README.md\n", result);
        return 1;
    }
    (void)memset(&action, 0, sizeof action);
    action.sa_handler = interrupt;
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    (void)sigaction(SIGHUP, &action, NULL);
    if ((open_sensor(&box) != 0) || (open_controller(&robot) != 0)) {
        return 1;
    }
    ask_real_time(&locked, &priority);
    (void)fprintf(stderr, "elastocal_live: listening at %s:%d; start the controller's program now\n",
                  LIVE_RSI_ADDRESS, LIVE_RSI_PORT);
    counted.controller_delay = -1L;
    result = run(&work, &box, &robot, duration);
    request(&box, 0U);
    (void)close(robot.socket);
    (void)close(box.socket);
    if (box.failure != NULL) {
        (void)fprintf(stderr, "elastocal_live: Net F/T at %s: %s\n", LIVE_FT_ADDRESS, box.failure);
        result = 1;
    }
    print_counts(&robot, locked, priority, box.failure);
    return result;
}
