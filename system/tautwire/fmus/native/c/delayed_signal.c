/* What a sensor shows late. In co-simulation segments of the signal are recorded step by step; in model exchange between
   instants at which integrator steps were completed, and up to now. */

static void segment_between(const double *first, const double *last, double *segment) {
  segment[0] = first[0];
  segment[1] = last[0];
  memcpy(segment + 2, first + 1, (INSTANT_SIZE - 1) * sizeof(double));
  memcpy(segment + 1 + INSTANT_SIZE, last + 1, (INSTANT_SIZE - 1) * sizeof(double));
}

static int is_behind_last_instant(const State *state, const double *instant) {
  return state->has_instant && instant[0] > state->last_instant[0];
}

/* Records the segment since the last instant; the signal may have jumped where that was at the same time. */
static int record_instant(Slave *slave, const double *instant, double lag) {
  double segment[SEGMENT_SIZE];
  State *state = &slave->state;
  if (is_behind_last_instant(state, instant)) {
    segment_between(state->last_instant, instant, segment);
    if (!append_segment(&slave->delay_line, segment, lag)) return 0;
  }
  memcpy(state->last_instant, instant, sizeof state->last_instant);
  state->has_instant = 1;
  return 1;
}

/* Value and rate of each axis a lag before now, where `instant` is the signal now; 0 where nothing is recorded yet. */
static int shown_late(Slave *slave, const double *instant, double lag, double (*results)[2]) {
  DelayLine *line = &slave->delay_line;
  int is_open = slave->is_model_exchange && is_behind_last_instant(&slave->state, instant);
  if (!(lag > 0.0)) return 0;
  if (is_open && !reserve_segments(line, line->count + 1)) return 0;
  if (is_open)
    segment_between(slave->state.last_instant, instant, line->segments + SEGMENT_SIZE * line->count++);
  if (!line->count) return 0;
  delayed_values(line, lag, results);
  line->count -= (size_t)is_open;
  return 1;
}

/* Change of what `shown_late` shows along a change of the signal now, which it shows between the last instant and now
   alone; NaN along a change of the time; 0 where the signal is shown at once. */
static int change_shown_late(const Slave *slave, const double *instant, double time, double lag, double (*changes)[2]) {
  const State *state = &slave->state;
  double held[INSTANT_SIZE] = {0.0}, segment[SEGMENT_SIZE];
  int is_open = slave->is_model_exchange && is_behind_last_instant(state, instant), axis;
  DelayLine line = {1, 1, NULL};
  if (!(lag > 0.0) || !(is_open || slave->delay_line.count)) return 0;
  memset(changes, 0, SIGNAL_AXES * sizeof *changes);
  held[0] = state->last_instant[0];
  segment_between(held, instant, segment);
  line.segments = segment;
  if (is_open) delayed_values(&line, lag, changes);
  for (axis = 0; axis < SIGNAL_AXES && time != 0.0; axis++) changes[axis][0] = changes[axis][1] = NAN;
  return 1;
}
