/*
 * What goes over the two lines; see live_wire.h.
 *
 * Written by elastocal @VERSION@; do not edit: export again instead.
 */
#include "live_wire.h"

#include <math.h>
#include <string.h>

#define MOST_DIGITS 18
#define MOST_DEPTH 8
#define LARGEST 1.0e7
#define NAME_BYTES 16

static const double TENS[MOST_DIGITS + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,
                                             1e7,  1e8,  1e9,  1e10, 1e11, 1e12, 1e13,
                                             1e14, 1e15, 1e16, 1e17, 1e18};

/* ---- Numbers -------------------------------------------------------------------------- */

static int is_digit(char c)
{
    return ((c >= '0') && (c <= '9')) ? 1 : 0;
}

/* The exponent of a number from its e on; leaves the place behind it. */
static int read_exponent(const char *data, size_t size, size_t *at, int *exponent)
{
    int negative = 0;
    int digits = 0;
    int value = 0;
    *at += 1U;
    if ((*at < size) && ((data[*at] == '-') || (data[*at] == '+'))) {
        negative = (data[*at] == '-') ? 1 : 0;
        *at += 1U;
    }
    while ((*at < size) && (is_digit(data[*at]) != 0) && (digits < 3)) {
        value = (10 * value) + (data[*at] - '0');
        digits++;
        *at += 1U;
    }
    *exponent += (negative != 0) ? -value : value;
    return (digits > 0) ? 0 : -1;
}

/* A whole text as a number, 0: well. With up to 15 digits it is the nearest double: a whole number
 * and a power of ten that are both exact, and one division. */
static int read_number(const char *data, size_t size, double *number)
{
    uint64_t whole = 0U;
    int digits = 0;
    int seen = 0;
    int exponent = 0;
    int negative = 0;
    int fraction = 0;
    size_t at = 0U;
    double value;
    if ((at < size) && ((data[at] == '-') || (data[at] == '+'))) {
        negative = (data[at] == '-') ? 1 : 0;
        at++;
    }
    for (; at < size; at++) {
        const char c = data[at];
        if ((c == '.') && (fraction == 0)) {
            fraction = 1;
        } else if (is_digit(c) != 0) {
            seen = 1;
            if (digits < MOST_DIGITS) {
                whole = (10U * whole) + (uint64_t)(c - '0');
                digits += (whole != 0U) ? 1 : 0;
                exponent -= fraction;
            } else {
                exponent += 1 - fraction;
            }
        } else {
            break;
        }
    }
    if ((seen != 0) && (at < size) && ((data[at] == 'e') || (data[at] == 'E'))) {
        if (read_exponent(data, size, &at, &exponent) != 0) {
            return -1;
        }
    }
    if ((seen == 0) || (at != size) || (exponent > MOST_DIGITS)) {
        return -1;
    }
    value = (double)whole;
    if (exponent >= 0) {
        value *= TENS[exponent];
    } else if (exponent >= -MOST_DIGITS) {
        value /= TENS[-exponent];
    } else {
        value = 0.0;
    }
    *number = (negative != 0) ? -value : value;
    return (value <= LARGEST) ? 0 : -1;
}

/* Why a text is no number. */
static const char *wrong_number(const char *data, size_t size)
{
    size_t at;
    int commas = 0;
    for (at = 0U; at < size; at++) {
        const char c = data[at];
        commas += (c == ',') ? 1 : 0;
        if ((is_digit(c) == 0) && (c != ',') && (c != '-') && (c != '+')) {
            commas = 2;
        }
    }
    return (commas == 1) ? "no number: decimal comma" : "no number in range";
}

/* ---- XML ------------------------------------------------------------------------------ */

typedef struct {
    const char *data;
    size_t size;
    size_t at;
    wire_refusal why;
} scan;

/* Note why a telegram is refused; the first reason stands. */
static int refuse(scan *s, const char *element, const char *reason)
{
    if (s->why.reason == NULL) {
        s->why.element = element;
        s->why.reason = reason;
    }
    return -1;
}

static int ends_name(char c)
{
    return ((c == ' ') || (c == '\t') || (c == '\r') || (c == '\n') || (c == '/') || (c == '>')
            || (c == '=') || (c == '<'))
               ? 1
               : 0;
}

static void skip_space(scan *s)
{
    while ((s->at < s->size)
           && ((s->data[s->at] == ' ') || (s->data[s->at] == '\t') || (s->data[s->at] == '\r')
               || (s->data[s->at] == '\n'))) {
        s->at++;
    }
}

/* A name in small letters, cut off where it is longer than any that is looked for. */
static size_t read_name(scan *s, char name[NAME_BYTES])
{
    size_t length = 0U;
    while ((s->at < s->size) && (ends_name(s->data[s->at]) == 0)) {
        char c = s->data[s->at];
        c = ((c >= 'A') && (c <= 'Z')) ? (char)(c - 'A' + 'a') : c;
        if (length < (NAME_BYTES - 1U)) {
            name[length] = c;
        }
        length++;
        s->at++;
    }
    name[(length < NAME_BYTES) ? length : (NAME_BYTES - 1U)] = '\0';
    return length;
}

#define SEEN 0x100U /* the element itself */
#define ALL_SIX 0x7EU

/* Numbers of an element by the place of their attribute: A1 to A6, E1 to E6, X Y Z A B C from 1 on,
 * D at 0. */
typedef struct {
    double values[7];
    unsigned int present;
} numbers;

/* An element that is read: its name, for people too, and its attributes by their letter; 'x': the
 * six of a frame. */
typedef struct {
    const char *name;
    const char *shown;
    char letter;
} element;

enum { AXES, EXTERNAL, DELAY, ACTUAL, SETPOINT, ELEMENTS };

static const element READ[ELEMENTS] = {{"aipos", "AIPos", 'a'},
                                       {"eipos", "EIPos", 'e'},
                                       {"delay", "Delay", 'd'},
                                       {"rist", "RIst", 'x'},
                                       {"rsol", "RSol", 'x'}};

/* The place of an attribute among the numbers of its element, -1: it is none of them. */
static int place_of(char letter, const char *name, size_t length)
{
    static const char frame[] = "xyzabc";
    const char *found;
    if (letter == 'x') {
        found = ((length == 1U) && (name[0] != '\0')) ? strchr(frame, name[0]) : NULL;
        return (found == NULL) ? -1 : (1 + (int)(found - frame));
    }
    if ((letter == '\0') || (name[0] != letter) || (length > 2U)) {
        return -1;
    }
    if (length == 1U) {
        return 0;
    }
    return ((name[1] >= '0') && (name[1] <= '6')) ? (name[1] - '0') : -1;
}

/* The attributes of an element up to its end; whether it closes itself, or -1. Its numbers are
 * kept, if it is one that is read. */
static int read_attributes(scan *s, const element *of, numbers *found)
{
    while (s->at < s->size) {
        char name[NAME_BYTES];
        char quote;
        size_t length;
        size_t begin;
        skip_space(s);
        if (s->at >= s->size) {
            return -1;
        }
        if (s->data[s->at] == '>') {
            s->at++;
            return 0;
        }
        if (s->data[s->at] == '/') {
            if (((s->at + 1U) >= s->size) || (s->data[s->at + 1U] != '>')) {
                return -1;
            }
            s->at += 2U;
            return 1;
        }
        length = read_name(s, name);
        skip_space(s);
        if ((length == 0U) || (s->at >= s->size) || (s->data[s->at] != '=')) {
            return -1;
        }
        s->at++;
        skip_space(s);
        quote = (s->at < s->size) ? s->data[s->at] : '\0';
        if ((quote != '"') && (quote != '\'')) {
            return -1;
        }
        s->at++;
        begin = s->at;
        while ((s->at < s->size) && (s->data[s->at] != quote) && (s->data[s->at] != '<')) {
            s->at++;
        }
        if ((s->at >= s->size) || (s->data[s->at] != quote)) {
            return -1;
        }
        if (of != NULL) {
            const int place = place_of(of->letter, name, length);
            if (place >= 0) {
                const unsigned int bit = 1U << (unsigned int)place;
                const char *const text = &s->data[begin];
                if ((found->present & bit) != 0U) {
                    return refuse(s, of->shown, "an attribute twice");
                }
                if (read_number(text, s->at - begin, &found->values[place]) != 0) {
                    return refuse(s, of->shown, wrong_number(text, s->at - begin));
                }
                found->present |= bit;
            }
        }
        s->at++;
    }
    return -1;
}

/* What has been found of a <Rob>. */
typedef struct {
    numbers of[ELEMENTS];
    uint64_t ipoc;
    int ipocs;
} rob_parts;

/* The text of <IPOC>: a whole number. */
static int read_ipoc(scan *s, rob_parts *parts)
{
    uint64_t value = 0U;
    int digits = 0;
    skip_space(s);
    while ((s->at < s->size) && (is_digit(s->data[s->at]) != 0)) {
        value = (10U * value) + (uint64_t)(s->data[s->at] - '0');
        digits++;
        s->at++;
    }
    skip_space(s);
    parts->ipoc = value;
    parts->ipocs++;
    return ((digits > 0) && (digits <= MOST_DIGITS) && (s->at < s->size)
            && (s->data[s->at] == '<') && (parts->ipocs == 1))
               ? 0
               : refuse(s, "IPOC", "must be one whole number");
}

/* An element that begins at its name, at a depth; whether it closes itself, or -1. */
static int read_element(scan *s, int depth, rob_parts *parts)
{
    char name[NAME_BYTES];
    int closed;
    int i;
    if (read_name(s, name) == 0U) {
        return -1;
    }
    if (depth == 0) {
        return (strcmp(name, "rob") == 0) ? read_attributes(s, NULL, NULL)
                                          : refuse(s, "", "it is no <Rob>");
    }
    for (i = 0; (depth == 1) && (i < (int)ELEMENTS); i++) {
        if (strcmp(name, READ[i].name) == 0) {
            if (parts->of[i].present != 0U) {
                return refuse(s, READ[i].shown, "twice");
            }
            parts->of[i].present = SEEN;
            return read_attributes(s, &READ[i], &parts->of[i]);
        }
    }
    closed = read_attributes(s, NULL, NULL);
    if ((closed == 0) && (depth == 1) && (strcmp(name, "ipoc") == 0)) {
        return (read_ipoc(s, parts) == 0) ? 0 : -1;
    }
    return closed;
}

static int read_parts(scan *s, rob_parts *parts)
{
    int depth = 0;
    int begun = 0;
    while (s->at < s->size) {
        if (s->data[s->at] != '<') {
            s->at++;
            continue;
        }
        s->at++;
        if (s->at >= s->size) {
            return -1;
        }
        if (s->data[s->at] == '/') {
            depth--;
            while ((s->at < s->size) && (s->data[s->at] != '>') && (s->data[s->at] != '<')) {
                s->at++;
            }
            if ((depth < 0) || (s->at >= s->size) || (s->data[s->at] != '>')) {
                return -1;
            }
        } else if ((s->data[s->at] == '?') && (begun == 0)) {
            s->at++; /* a declaration is let pass; its end is no '<' */
        } else if ((depth == 0) && (begun != 0)) {
            return -1; /* a second root */
        } else {
            const int closed = read_element(s, depth, parts); /* '!' is no name of ours */
            if ((closed < 0) || (depth >= MOST_DEPTH)) {
                return -1;
            }
            begun = 1;
            depth += 1 - closed;
        }
    }
    return ((begun != 0) && (depth == 0)) ? 0 : -1;
}

/* Whether an element has all that is wanted of it, or is not there and need not be. */
static int is_whole(scan *s, const rob_parts *parts, int place, unsigned int wanted, int optional)
{
    const unsigned int present = parts->of[place].present;
    if ((optional != 0) && (present == 0U)) {
        return 1;
    }
    if ((present & wanted) != wanted) {
        (void)refuse(s, READ[place].shown, "something is missing");
        return 0;
    }
    return 1;
}

static int are_whole(scan *s, const rob_parts *parts)
{
    unsigned int wanted = 0U;
    int i;
    for (i = 1; i <= LIVE_EXTERNAL; i++) {
        wanted |= 1U << (unsigned int)i;
    }
    return is_whole(s, parts, AXES, ALL_SIX, 0) & is_whole(s, parts, EXTERNAL, wanted, 0)
           & is_whole(s, parts, DELAY, 1U, 1) & is_whole(s, parts, ACTUAL, ALL_SIX, 1)
           & is_whole(s, parts, SETPOINT, ALL_SIX, 1);
}

int wire_read_rob(const char *data, size_t size, wire_rob *message, wire_refusal *why)
{
    scan s = {data, size, 0U, {"", NULL}};
    rob_parts parts;
    int well;
    int i;
    (void)memset(&parts, 0, sizeof parts);
    well = ((size <= WIRE_MOST_BYTES) && (read_parts(&s, &parts) == 0)) ? 1 : 0;
    if ((well != 0) && (parts.ipocs != 1)) {
        (void)refuse(&s, "IPOC", "missing");
        well = 0;
    }
    if ((well == 0) || (are_whole(&s, &parts) == 0)) {
        (void)refuse(&s, "", "no XML, or none that is read");
        *why = s.why;
        return -1;
    }
    message->ipoc = parts.ipoc;
    message->delay = (parts.of[DELAY].present != 0U) ? (long)parts.of[DELAY].values[0] : -1L;
    message->has_offset =
        ((parts.of[ACTUAL].present != 0U) && (parts.of[SETPOINT].present != 0U)) ? 1 : 0;
    for (i = 0; i < 3; i++) {
        message->offset[i] =
            1e-3 * (parts.of[ACTUAL].values[i + 1] - parts.of[SETPOINT].values[i + 1]);
    }
    for (i = 0; i < ELASTOCAL_JOINTS; i++) {
        const double value = (i < LIVE_EXTERNAL) ? parts.of[EXTERNAL].values[i + 1]
                                                 : parts.of[AXES].values[i - LIVE_EXTERNAL + 1];
        message->q[i] = LIVE_SCALE[i] * value;
    }
    return 0;
}

/* ---- The answer ----------------------------------------------------------------------- */

static size_t put_text(char *buffer, size_t at, const char *text)
{
    while ((*text != '\0') && (at < WIRE_SEN_BYTES)) {
        buffer[at] = *text;
        at++;
        text++;
    }
    return at;
}

static size_t put_whole(char *buffer, size_t at, uint64_t number, int least)
{
    char digits[24];
    int count = 0;
    do {
        digits[count] = (char)('0' + (int)(number % 10U));
        number /= 10U;
        count++;
    } while (((number > 0U) || (count < least)) && (count < 24));
    while ((count > 0) && (at < WIRE_SEN_BYTES)) {
        count--;
        buffer[at] = digits[count];
        at++;
    }
    return at;
}

/* A number with six decimals; what is not finite has been taken out before. */
static size_t put_number(char *buffer, size_t at, double number)
{
    const uint64_t millionths = (uint64_t)((fabs(number) * 1.0e6) + 0.5);
    if ((number < 0.0) && (millionths > 0U)) {
        at = put_text(buffer, at, "-");
    }
    at = put_whole(buffer, at, millionths / 1000000U, 1);
    at = put_text(buffer, at, ".");
    return put_whole(buffer, at, millionths % 1000000U, 6);
}

size_t wire_write_sen(char *buffer, int stop, const double millimetres[3], uint64_t ipoc)
{
    static const char *const before[3] = {"\"><Stop>", "</Stop><RKorr X=\"", "\" Y=\""};
    size_t at = put_text(buffer, 0U, "<Sen Type=\"");
    at = put_text(buffer, at, LIVE_SENTYPE);
    at = put_text(buffer, at, before[0]);
    at = put_text(buffer, at, (stop != 0) ? "1" : "0");
    at = put_text(buffer, at, before[1]);
    at = put_number(buffer, at, millimetres[0]);
    at = put_text(buffer, at, before[2]);
    at = put_number(buffer, at, millimetres[1]);
    at = put_text(buffer, at, "\" Z=\"");
    at = put_number(buffer, at, millimetres[2]);
    at = put_text(buffer, at, "\" A=\"0.000000\" B=\"0.000000\" C=\"0.000000\"/><IPOC>");
    at = put_whole(buffer, at, ipoc, 1);
    return put_text(buffer, at, "</IPOC></Sen>");
}

/* ---- Net F/T -------------------------------------------------------------------------- */

static uint32_t big_endian(const unsigned char *data)
{
    return ((uint32_t)data[0] << 24) | ((uint32_t)data[1] << 16) | ((uint32_t)data[2] << 8)
           | (uint32_t)data[3];
}

int wire_read_rdt(const unsigned char *data, size_t size, wire_rdt *record)
{
    int i;
    if (size < WIRE_RDT_BYTES) {
        return -1;
    }
    record->rdt_sequence = big_endian(&data[0]);
    record->ft_sequence = big_endian(&data[4]);
    record->status = big_endian(&data[8]);
    for (i = 0; i < 6; i++) {
        const uint32_t bits = big_endian(&data[12 + (4 * i)]);
        (void)memcpy(&record->counts[i], &bits, sizeof bits);
    }
    return 0;
}

int wire_is_good(uint32_t status)
{
    return ((status == 0U) || (status == 0x80010000U)) ? 1 : 0;
}

/* ---- Self-test ------------------------------------------------------------------------ */

static int reads_numbers(void)
{
    static const char *const texts[] = {"-90.000000", "0", "+1.5e-3", "4208163634e-3", "0.1",
                                        "123456.789012345"};
    static const double expected[] = {-90.0, 0.0, 1.5e-3, 4208163.634, 0.1, 123456.789012345};
    static const char *const wrong[] = {"",     "-",    "1.2.3", "nan", "inf", "0x10", "1e",
                                        "1 ",   "1e99", "--1",   "1,5", "9e7", "."};
    size_t i;
    double found = 0.0;
    int well = 1;
    for (i = 0U; i < (sizeof texts / sizeof texts[0]); i++) {
        well &= (read_number(texts[i], strlen(texts[i]), &found) == 0) ? 1 : 0;
        well &= (fabs(found - expected[i]) <= (1e-15 * fabs(expected[i]))) ? 1 : 0;
    }
    for (i = 0U; i < (sizeof wrong / sizeof wrong[0]); i++) {
        well &= (read_number(wrong[i], strlen(wrong[i]), &found) != 0) ? 1 : 0;
    }
    return well;
}

static int reads_messages(void)
{
    static const char good[] =
        "<?xml version=\"1.0\"?><ROB type='KUKA'><own><AIPos A1=\"7\"/></own><Other X=\"1,0\"/>"
        "<RIst X=\"1.5\" Y=\"2.0\" Z=\"3.0\" A=\"0.0\" B=\"90.0\" C=\"0.0\"/>"
        "<RSol X=\"1.0\" Y=\"2.0\" Z=\"4.0\" A=\"0.0\" B=\"90.0\" C=\"0.0\"/>"
        "<AIPOS a1=\"10.5\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"45.0\" A6=\"1.0\"/>"
        "<EIPos E1=\"100.0\" E2=\"0.0\" E3=\"0.0\" E4=\"0.0\" E5=\"0.0\" E6=\"0.0\"/>"
        "<Delay D=\"3\"/><IPOC>4208163634</IPOC></ROB>";
    static const char *const wrong[][2] = {
        {"", "no XML, or none that is read"},
        {"<Rob", "no XML, or none that is read"},
        {"<Sen><IPOC>1</IPOC></Sen>", "it is no <Rob>"},
        {"<!DOCTYPE a><Rob><IPOC>1</IPOC></Rob>", "it is no <Rob>"},
        {"<Rob><AIPos A1=\"nan\"/><IPOC>1</IPOC></Rob>", "no number in range"},
        {"<Rob><RIst X=\"1620,9999\"/><IPOC>1</IPOC></Rob>", "no number: decimal comma"},
        {"<Rob><RSol X=\"1,2,3\"/><IPOC>1</IPOC></Rob>", "no number in range"},
        {"<Rob><Delay D=\"1\"/><Delay/><IPOC>1</IPOC></Rob>", "twice"},
        {"<Rob><IPOC>1</IPOC></Rob>", "something is missing"},
        {"<Rob><IPOC>x</IPOC></Rob>", "must be one whole number"},
        {"<Rob></Rob>", "missing"},
        {"<Rob><a><b><c><d><e><f><g><h><i><j>", "no XML, or none that is read"},
    };
    wire_rob message;
    wire_refusal why = {"", ""};
    size_t i;
    size_t cut;
    int well = (wire_read_rob(good, sizeof good - 1U, &message, &why) == 0) ? 1 : 0;
    well &= (message.ipoc == UINT64_C(4208163634)) ? 1 : 0;
    well &= ((message.has_offset == 1) && (fabs(message.offset[0] - 5e-4) < 1e-12)
             && (fabs(message.offset[2] + 1e-3) < 1e-12))
                ? 1
                : 0;
    well &= (message.delay == 3L) ? 1 : 0;
    well &= (fabs(message.q[LIVE_EXTERNAL] - (LIVE_SCALE[LIVE_EXTERNAL] * 10.5)) < 1e-12) ? 1 : 0;
    for (i = 0U; i < (sizeof wrong / sizeof wrong[0]); i++) {
        well &= (wire_read_rob(wrong[i][0], strlen(wrong[i][0]), &message, &why) != 0) ? 1 : 0;
        well &= (strcmp(why.reason, wrong[i][1]) == 0) ? 1 : 0;
    }
    /* Whatever is cut off is none, and nothing behind the end is read. */
    for (cut = 0U; cut < (sizeof good - 1U); cut++) {
        well &= (wire_read_rob(good, cut, &message, &why) != 0) ? 1 : 0;
    }
    return well;
}

static int writes_answers(void)
{
    static const double shift[3] = {0.25, -1.0000005, -0.0000001};
    static const char expected[] = "\"><Stop>0</Stop><RKorr X=\"0.250000\" Y=\"-1.000001\" Z=\"0.000000\""
                                   " A=\"0.000000\" B=\"0.000000\" C=\"0.000000\"/>"
                                   "<IPOC>4208163634</IPOC></Sen>";
    char buffer[WIRE_SEN_BYTES + 1];
    const size_t head = strlen("<Sen Type=\"") + strlen(LIVE_SENTYPE);
    const size_t length = wire_write_sen(buffer, 0, shift, UINT64_C(4208163634));
    return ((length == (head + sizeof expected - 1U))
            && (memcmp(&buffer[head], expected, sizeof expected - 1U) == 0))
               ? 1
               : 0;
}

static int reads_records(void)
{
    static const unsigned char data[WIRE_RDT_BYTES] = {0, 0, 1, 2,    0xFF, 0xFF, 0xFF,
                                                       0xFE, 0x80, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF};
    wire_rdt record;
    int well = (wire_read_rdt(data, sizeof data, &record) == 0) ? 1 : 0;
    well &= ((record.rdt_sequence == 258U) && (record.ft_sequence == 0xFFFFFFFEU)) ? 1 : 0;
    well &= ((record.counts[0] == -1) && (wire_is_good(record.status) == 1)) ? 1 : 0;
    well &= (wire_read_rdt(data, 35U, &record) != 0) ? 1 : 0;
    return well & ((wire_is_good(0x80020000U) == 0) ? 1 : 0);
}

int wire_selftest(void)
{
    const int well = reads_numbers() & reads_messages() & writes_answers() & reads_records();
    return (well != 0) ? 0 : 4;
}
