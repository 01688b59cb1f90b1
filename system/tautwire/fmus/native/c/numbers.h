/* Checks of numbers; a comparison with NaN is false. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LARGEST_NUMBER 1.7976931348623157e308

static int is_finite(double value) { return value >= -LARGEST_NUMBER && value <= LARGEST_NUMBER; }

static int are_finite(const double *values, size_t count) {
  size_t k;
  for (k = 0; k < count; k++)
    if (!is_finite(values[k])) return 0;
  return 1;
}
