
/* ---- Sine and cosine, always in the same time ------------------------------------------- */

/* The angle less the nearest multiple k of pi/2 (in three parts, Cody and Waite), then Taylor
 * series, then swapped and turned by the quadrant with arithmetic alone. Adding and subtracting
 * 1.5 * 2^52 rounds to an integer. Good to an ulp or two for angles up to 1e5 rad. */
static void sin_cos(double angle, double *sine, double *cosine)
{
    const double k = ((angle * TWO_BY_PI) + ROUNDER) - ROUNDER;
    const double x = ((angle - (k * HALF_PI[0])) - (k * HALF_PI[1])) - (k * HALF_PI[2]);
    const double half = (((0.5 * k) - 0.25) + ROUNDER) - ROUNDER;
    const double odd = k - (2.0 * half);
    const double even = 1.0 - odd;
    const double turns = (((0.5 * half) - 0.25) + ROUNDER) - ROUNDER;
    const double sign = 1.0 - (2.0 * (half - (2.0 * turns)));
    const double y = x * x;
    double s = SINE[6];
    double c = COSINE[7];
    int i;
    for (i = 5; i >= 0; i--) {
        s = (s * y) + SINE[i];
    }
    for (i = 6; i >= 0; i--) {
        c = (c * y) + COSINE[i];
    }
    s = x + ((x * y) * s);
    c = 1.0 + (y * c);
    *sine = sign * ((even * s) + (odd * c));
    *cosine = sign * ((even * c) - (odd * s));
}

