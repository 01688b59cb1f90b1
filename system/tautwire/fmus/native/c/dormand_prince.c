/* Adaptive Runge-Kutta integration (Dormand and Prince) of a component's states over a macro step.

   The same method as dormand_prince.py, from which the tableau comes. `state_rates` is that of the component. */

static int trial_step(const Slave *slave, double step, int at_end, const double *state, const double *slope, double done,
                      double part, double *next_state, double *next_slope, double *errors) {
  double slopes[7][STATE_COUNT], inner[STATE_COUNT], h = part * step;
  int stage, k, j;
  memcpy(slopes[0], slope, sizeof slopes[0]);
  for (stage = 0; stage < 5; stage++) {
    for (k = 0; k < STATE_COUNT; k++) {
      double sum = 0.0;
      for (j = 0; j <= stage; j++) sum += stage_weights[stage][j] * slopes[j][k];
      inner[k] = state[k] + h * sum;
    }
    if (!state_rates(slave, step, done + stage_times[stage] * part, at_end, inner, slopes[stage + 1])) return 0;
  }
  for (k = 0; k < STATE_COUNT; k++) {
    double sum = 0.0;
    for (j = 0; j < 6; j++) sum += solution_weights[j] * slopes[j][k];
    next_state[k] = state[k] + h * sum;
  }
  if (!state_rates(slave, step, done + part, at_end, next_state, slopes[6])) return 0;
  memcpy(next_slope, slopes[6], sizeof slopes[6]);
  for (k = 0; k < STATE_COUNT; k++) {
    double sum = 0.0;
    for (j = 0; j < 7; j++) sum += error_weights[j] * slopes[j][k];
    errors[k] = h * sum;
  }
  return 1;
}

static double scaled_error(const double *errors, double tolerance) {
  double largest = 0.0;
  int k;
  for (k = 0; k < STATE_COUNT; k++) largest = fmax(largest, fabs(errors[k]) / state_scales[k]);
  return largest / tolerance;
}

/* States in the middle of the step and at its end; 0 where the law has no value. */
static int integrate_dormand_prince(const Slave *slave, double step, int at_end, const double *start, double *middle,
                                    double *end) {
  double state[STATE_COUNT], slope[STATE_COUNT], next_state[STATE_COUNT], next_slope[STATE_COUNT], errors[STATE_COUNT];
  double done = 0.0, part = 1.0, error, next, inner_step, fraction;
  int k;
  memcpy(state, start, sizeof state);
  memcpy(middle, start, sizeof state);
  if (!state_rates(slave, step, 0.0, at_end, state, slope)) return 0;
  while (done < 1.0) {
    part = fmin(part, 1.0 - done);
    if (!trial_step(slave, step, at_end, state, slope, done, part, next_state, next_slope, errors)) return 0;
    error = scaled_error(errors, slave->relative_tolerance);
    if (error > 1.0 && part > MIN_STEP_FRACTION) {
      part = fmax(MIN_STEP_FRACTION, part * fmax(MIN_STEP_FACTOR, SAFETY_FACTOR * pow(error, -0.2)));
      continue;
    }
    next = part < 1.0 - done ? done + part : 1.0;
    if (done < 0.5 && 0.5 <= next) {
      inner_step = part * step;
      fraction = (0.5 - done) / part;
      for (k = 0; k < STATE_COUNT; k++) {
        double first[2], last[2], values[2];
        first[0] = state[k];
        first[1] = slope[k];
        last[0] = next_state[k];
        last[1] = next_slope[k];
        cubic(first, last, &inner_step, &fraction, values);
        middle[k] = values[0];
      }
    }
    memcpy(state, next_state, sizeof state);
    memcpy(slope, next_slope, sizeof slope);
    done = next;
    part *= error == 0.0 ? MAX_STEP_FACTOR : fmin(MAX_STEP_FACTOR, SAFETY_FACTOR * pow(error, -0.2));
  }
  memcpy(end, state, sizeof state);
  return 1;
}
