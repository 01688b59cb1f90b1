/* Delay line of a sensor: segments of a signal between communication points, as far back as the sensor lags.

   A segment is its start and end time, then value and derivatives of each axis at the start, then those at the end; an
   instant is its time, then these. */

#define SEGMENT_SIZE (2 + 2 * SIGNAL_AXES * SIGNAL_DERIVATIVES)
#define INSTANT_SIZE (1 + SIGNAL_AXES * SIGNAL_DERIVATIVES)

typedef struct {
  size_t count, capacity;
  double *segments;
} DelayLine;

static int reserve_segments(DelayLine *line, size_t count) {
  size_t capacity = line->capacity ? line->capacity : 16;
  double *segments;
  if (count <= line->capacity) return 1;
  while (capacity < count) capacity *= 2;
  segments = (double *)realloc(line->segments, capacity * SEGMENT_SIZE * sizeof(double));
  if (!segments) return 0;
  line->segments = segments;
  line->capacity = capacity;
  return 1;
}

static int copy_delay_line(DelayLine *target, const DelayLine *source) {
  if (!reserve_segments(target, source->count)) return 0;
  target->count = source->count;
  if (source->count) memcpy(target->segments, source->segments, source->count * SEGMENT_SIZE * sizeof(double));
  return 1;
}

static void free_delay_line(DelayLine *line) {
  free(line->segments);
  line->segments = NULL;
  line->count = line->capacity = 0;
}

/* Appends a segment and drops those that are older than the lag; 0 where memory is exhausted. */
static int append_segment(DelayLine *line, const double *segment, double lag) {
  size_t first = 0;
  while (first < line->count && line->segments[first * SEGMENT_SIZE + 1] < segment[1] - lag) first++;
  if (first) {
    line->count -= first;
    memmove(line->segments, line->segments + first * SEGMENT_SIZE, line->count * SEGMENT_SIZE * sizeof(double));
  }
  if (!reserve_segments(line, line->count + 1)) return 0;
  memcpy(line->segments + line->count * SEGMENT_SIZE, segment, SEGMENT_SIZE * sizeof(double));
  line->count++;
  return 1;
}

/* Value and rate of one axis a lag before the end of a delay line that has segments; constant before its start.

   `derivatives` of the axis count: two make a cubic, three a quintic. */
static void delayed_signal(const DelayLine *line, double lag, int axis, int derivatives, double *result) {
  const double *segment = line->segments, *first;
  const double *last = line->segments + (line->count - 1) * SEGMENT_SIZE;
  double time = last[1] - lag, step, fraction, values[3];
  while (segment != last && time > segment[1]) segment += SEGMENT_SIZE;
  step = segment[1] - segment[0];
  fraction = (time - segment[0]) / step;
  first = segment + 2 + axis * SIGNAL_DERIVATIVES;
  if (time < segment[0]) {
    result[0] = first[0];
    result[1] = 0.0;
    return;
  }
#if SIGNAL_DERIVATIVES == 3
  if (derivatives == 3)
    quintic(first, first + SIGNAL_AXES * SIGNAL_DERIVATIVES, &step, &fraction, values);
  else
#endif
    cubic(first, first + SIGNAL_AXES * SIGNAL_DERIVATIVES, &step, &fraction, values);
  memcpy(result, values, 2 * sizeof(double));
}

/* The same of all axes. */
static void delayed_values(const DelayLine *line, double lag, double (*results)[2]) {
  int axis;
  for (axis = 0; axis < SIGNAL_AXES; axis++) delayed_signal(line, lag, axis, SIGNAL_DERIVATIVES, results[axis]);
}
