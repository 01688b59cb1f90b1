/* The sampled controller: measured pose and tensions in, winch speeds out. */

#define FIRST_MEASUREMENT 1
#define FIRST_OUTPUT (FIRST_MEASUREMENT + MEASURED)
/* In periods: a sample nearer than this counts as reached, whatever rounding did. */
#define SAMPLE_TIME_TOLERANCE 1e-6

static Limits limits_of(const Slave *slave) {
  const double *parameters = slave->state.real + FIRST_PARAMETER;
  Limits limits;
  limits.speed = parameters[1];
  limits.acceleration = parameters[2];
  limits.lowest_tension = parameters[3];
  limits.highest_tension = parameters[4];
  return limits;
}

/* Copies between the controller and its states, of which the FMU has no place for an order of zero. */
static void exchange_states(double *states, Controller *controller, int is_load) {
  double *parts[9];
  int sizes[9] = {1, 1, ORDER, CABLES, CABLES, CABLES, CABLES, CABLES, MEASURED}, part;
  parts[0] = &controller->sample;
  parts[1] = &controller->phase;
  parts[2] = controller->state;
  parts[3] = controller->begin;
  parts[4] = controller->end;
  parts[5] = controller->tensions;
  parts[6] = controller->earlier;
  parts[7] = controller->scales;
  parts[8] = controller->measured;
  for (part = 0; part < 9; states += sizes[part++])
    memcpy(is_load ? parts[part] : states, is_load ? states : parts[part], (size_t)sizes[part] * sizeof(double));
}

static int derive_start(Slave *slave, double *start_states) {
  Limits limits = limits_of(slave);
  Controller controller;
  begin_path(&limits, &controller);
  memcpy(controller.measured, slave->state.real + FIRST_MEASUREMENT, sizeof controller.measured);
  exchange_states(start_states, &controller, 0);
  return 1;
}

/* Measured inputs after a fraction of the step; interpolated linearly where they are known at both ends. */
static void measure(const Slave *slave, double fraction, int at_end, double *measured) {
  const double *last = slave->state.real + FIRST_MEASUREMENT;
  const double *first = at_end ? slave->state.previous_inputs + FIRST_MEASUREMENT : last;
  int k;
  for (k = 0; k < MEASURED; k++) measured[k] = first[k] + fraction * (last[k] - first[k]);
}

static int advance(Slave *slave, double step, int at_end) {
  double period = model_constants[PLAN_PERIOD], elapsed = 0.0;
  Limits limits = limits_of(slave);
  Controller controller;
  exchange_states(slave->state.real + FIRST_STATE, &controller, 1);
  while (step - elapsed > SAMPLE_TIME_TOLERANCE * period) {
    if (controller.phase == 0.0) measure(slave, elapsed / step, at_end, controller.measured);
    if (step - elapsed < period - controller.phase - SAMPLE_TIME_TOLERANCE * period) {
      controller.phase += step - elapsed;
      break;
    }
    elapsed += period - controller.phase;
    next_sample(&limits, &controller);
    controller.phase = 0.0;
  }
  exchange_states(slave->state.real + FIRST_STATE, &controller, 0);
  return 1;
}

static int refresh(Slave *slave) {
  double *shown = slave->state.real + FIRST_OUTPUT;
  Controller controller;
  int k;
  exchange_states(slave->state.real + FIRST_STATE, &controller, 1);
  for (k = 0; k < CABLES; k++) {
    double rate = (controller.end[k] - controller.begin[k]) / model_constants[PLAN_PERIOD];
    shown[k] = controller.begin[k] + controller.phase * rate;
    shown[CABLES + k] = rate;
  }
  return 1;
}

/* Outputs hold what the last sample computed, which is state. */
static int differentiate(const Slave *slave, const double *seed, double *change) {
  (void)slave, (void)seed, (void)change;
  return 1;
}
