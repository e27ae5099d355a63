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

/* A compiler that may take it that there is no NaN and no infinity, or that sums may be put in
 * another order, removes checks and roundings that this file lives by. GCC and Clang say so by the
 * first three, MSVC (/fp:fast) by the last. What says nothing is found by the self-test. */
#if defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ != 0)
#error "elastocal: compile without -ffinite-math-only and -ffast-math; NaN must be seen"
#endif
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__)
#error "elastocal: compile without -ffast-math and -fassociative-math; sums must keep their order"
#endif
#if defined(_M_FP_FAST)
#error "elastocal: compile with /fp:precise instead of /fp:fast; NaN must be seen"
#endif

/* ---- Constants ------------------------------------------------------------------------ */

