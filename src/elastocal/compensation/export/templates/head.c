/*
 * Deflection of a robot under load, and its compensation; see elastocal_model.h.
 *
@ABOUT@
 *
 * Written by elastocal @VERSION@; do not edit: export again instead.
 * No loop here depends on data. Compile without -ffast-math.
 */
#include "elastocal_model.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* ---- Constants ------------------------------------------------------------------------ */

