/* Runs the self-test of elastocal_model.c; exit code 0 is well. */
#include "elastocal_model.h"

int main(void)
{
    return elastocal_selftest();
}
