static double smaller(double a, double b)
{
    return (a < b) ? a : b;
}

static double larger(double a, double b)
{
    return (a < b) ? b : a;
}

/* Of five values neither the smallest of four nor the largest of four is the median: what is
 * left of two pairs and the fifth is the median of three. */
static double middle(double value, double previous[5][6], int i)
{
    const double b = previous[0][i];
    const double c = previous[1][i];
    const double d = previous[2][i];
    const double e = previous[3][i];
    const double low = larger(smaller(value, b), smaller(c, d));
    const double high = smaller(larger(value, b), larger(c, d));
    previous[3][i] = d;
    previous[2][i] = c;
    previous[1][i] = b;
    previous[0][i] = value;
    return larger(smaller(low, high), smaller(larger(low, high), e));
}
