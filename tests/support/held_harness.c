/* Runs live_held.c over rows of doubles from standard input; see compensation/export/test_linux.py. */
#include "live_held.h"

#include <stdio.h>
#include <string.h>

int main(void)
{
    double row[11]; /* ipoc, anew, whether an offset comes, offset, delay, now, step of the answer */
    double out[7]; /* arrival, found, begins, advances, shift */
    held h;
    held_count c;
    held_start(&h, &c);
    while (fread(row, sizeof(double), 11U, stdin) == 11U) {
        held_effect effect;
        const held_arrival arrival = held_classify(&c, (uint64_t)row[0], (int)row[1]);
        int i;
        (void)memset(&effect, 0, sizeof effect);
        out[1] = -2.0;
        if (arrival != HELD_OLD) {
            out[1] = held_look(&h, arrival, (row[2] != 0.0) ? &row[3] : NULL, (long)row[6], row[7],
                               &effect);
        }
        out[0] = (double)arrival;
        out[2] = (double)effect.begins;
        out[3] = (double)effect.advances;
        (void)memcpy(&out[4], effect.shift, sizeof effect.shift);
        if (out[1] == 0.0) {
            for (i = 0; (effect.advances != 0) && (i < 3); i++) {
                effect.shift[i] += row[8 + i];
            }
            held_note(&h, effect.shift);
        }
        (void)fwrite(out, sizeof(double), 7U, stdout);
    }
    return 0;
}
