static double middle(double value, double previous[5][6], int i)
{
    (void)previous;
    (void)i;
    return value;
}
