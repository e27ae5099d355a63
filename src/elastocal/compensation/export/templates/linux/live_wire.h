/*
 * What goes over the two lines: RSI's XML and the records of a Net F/T. No allocation, no recursion;
 * the time that any of it takes is bounded by the bytes that come in.
 *
 * Written by elastocal @VERSION@; do not edit: export again instead.
 */
#ifndef LIVE_WIRE_H
#define LIVE_WIRE_H

#include <stddef.h>
#include <stdint.h>

#include "live_config.h"

#define WIRE_MOST_BYTES 65536
#define WIRE_SEN_BYTES 512
#define WIRE_RDT_BYTES 36

/* What a controller says in a cycle. */
typedef struct {
    uint64_t ipoc;
    double q[ELASTOCAL_JOINTS]; /* in the order and units of the model: rad, m */
    long delay; /* answers that it missed in a row; -1: it does not say */
    int has_offset;
    double offset[3]; /* RIst less RSol, base, m; where it sends both */
} wire_rob;

/* One record of a Net F/T. */
typedef struct {
    uint32_t rdt_sequence; /* number within the stream */
    uint32_t ft_sequence; /* the box's own counter of samples */
    uint32_t status;
    int32_t counts[6];
} wire_rdt;

/* Why a telegram was refused: the element, "" where it is none of them, and the reason. */
typedef struct {
    const char *element;
    const char *reason;
} wire_refusal;

/* Read a <Rob>; 0: well, else why not. Capitals do not count, tags of a site's own are let pass, a
 * document type, a number that is none and what is missing are not. */
int wire_read_rob(const char *data, size_t size, wire_rob *message, wire_refusal *why);

/* Write a <Sen> with the correction in mm; return its length. The buffer has WIRE_SEN_BYTES. */
size_t wire_write_sen(char *buffer, int stop, const double millimetres[3], uint64_t ipoc);

/* Read a record; 0: well. */
int wire_read_rdt(const unsigned char *data, size_t size, wire_rdt *record);

/* Whether a status means a good record: none, or a latched threshold alone. */
int wire_is_good(uint32_t status);

/* 0: all of the above gives what it must. */
int wire_selftest(void);

#endif
