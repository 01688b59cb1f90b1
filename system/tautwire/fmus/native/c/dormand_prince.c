/* Adaptive Runge-Kutta integration (Dormand and Prince) of a component's states over a macro step.

   The same method as dormand_prince.py, from which the tableau comes. `state_rates` is that of the component, and
   STEPS_BACK_INTO_DOMAIN tells whether an inner step that leaves the domain of the law is tried again, shorter. */

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

/* How far an integration has come: state and slope after a fraction of the macro step, and the next inner step's part. */
typedef struct {
  double state[STATE_COUNT], slope[STATE_COUNT];
  double done, part;
} Progress;

static int begin_integration(const Slave *slave, double step, int at_end, const double *start, double part, Progress *at) {
  memcpy(at->state, start, sizeof at->state);
  at->done = 0.0;
  at->part = part;
  return state_rates(slave, step, 0.0, at_end, at->state, at->slope);
}

/* The next inner step whose error is small enough; 0 where the law has no value. */
static int inner_step(const Slave *slave, double step, int at_end, const Progress *at, Progress *next) {
  double errors[STATE_COUNT], part = at->part, error;
  for (;;) {
    part = fmin(part, 1.0 - at->done);
    if (trial_step(slave, step, at_end, at->state, at->slope, at->done, part, next->state, next->slope, errors))
      error = scaled_error(errors, slave->relative_tolerance);
    else if (STEPS_BACK_INTO_DOMAIN && part > MIN_STEP_FRACTION)
      error = HUGE_VAL;
    else
      return 0;
    if (!(error > 1.0 && part > MIN_STEP_FRACTION)) break;
    part = fmax(MIN_STEP_FRACTION, part * fmax(MIN_STEP_FACTOR, SAFETY_FACTOR * pow(error, -0.2)));
  }
  next->done = part < 1.0 - at->done ? at->done + part : 1.0;
  next->part = part * (error == 0.0 ? MAX_STEP_FACTOR : fmin(MAX_STEP_FACTOR, SAFETY_FACTOR * pow(error, -0.2)));
  return 1;
}
