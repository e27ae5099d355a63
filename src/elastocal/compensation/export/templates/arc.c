
/* ---- Angle of a point, always in the same time ------------------------------------------ */

/* The angle of (x, y), as atan2 gives it. The smaller coordinate over the larger; beyond pi/8 turned
 * back by pi/4; then an odd polynomial (Chebyshev), then turned to where it was. Signs choose, by
 * arithmetic: compilers make jumps of comparisons. Good to 3e-16 rad. */
static double arc(double y, double x)
{
    const double u = fabs(x);
    const double v = fabs(y);
    const double steep = 0.5 - copysign(0.5, u - v);
    const double behind = 0.5 - copysign(0.5, x);
    const double low = (steep * u) + ((1.0 - steep) * v);
    const double high = (steep * v) + ((1.0 - steep) * u);
    const double beyond = 0.5 - copysign(0.5, (TAN_EIGHTH * high) - low);
    const double t = (low - (beyond * high)) / ((high + (beyond * low)) + SMALLEST);
    const double z = t * t;
    const double zz = z * z;
    const double p = ((ARC[0] + (z * ARC[1])) + (zz * (ARC[2] + (z * ARC[3])))) +
                     ((zz * zz) * (((ARC[4] + (z * ARC[5])) + (zz * (ARC[6] + (z * ARC[7])))) +
                                   ((zz * zz) * (ARC[8] + (z * ARC[9])))));
    double angle;
    angle = (t + ((t * z) * p)) + (beyond * QUARTER_TURN);
    angle = (steep * (2.0 * QUARTER_TURN)) + ((1.0 - (2.0 * steep)) * angle);
    angle = (behind * (4.0 * QUARTER_TURN)) + ((1.0 - (2.0 * behind)) * angle);
    return copysign(angle, y);
}

