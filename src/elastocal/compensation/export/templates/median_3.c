static double smaller(double a, double b)
{
    return (a < b) ? a : b;
}

static double larger(double a, double b)
{
    return (a < b) ? b : a;
}

static double middle(double value, double previous[5][6], int i)
{
    const double b = previous[0][i];
    const double c = previous[1][i];
    previous[1][i] = b;
    previous[0][i] = value;
    return larger(smaller(value, b), smaller(larger(value, b), c));
}
