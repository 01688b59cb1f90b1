/* Time-stamped inputs, and steps that are rolled back where the law has no value. */

#define MESSAGE_SIZE 4000

static void log_message(const Slave *slave, int status, const char *message) {
  if (slave->log) slave->log(slave->owner, status, message);
}

/* Logs what happened with all inputs by name. */
static void log_with_inputs(const Slave *slave, int status, const char *what) {
  char message[MESSAGE_SIZE];
  int used = snprintf(message, sizeof message, "%s; inputs", what), k;
  for (k = 0; k < INPUT_COUNT && used < (int)sizeof message - 100; k++)
    used += snprintf(message + used, sizeof message - (size_t)used, " %s=%.9g", variable_names[k], slave->state.real[k]);
  log_message(slave, status, message);
}

/* Derives what follows from the parameters; before the first step the start state does. */
static void parameters_changed(Slave *slave) {
  double states[STATE_COUNT];
  slave->parameters_valid = derive_start(slave, states);
  if (slave->parameters_valid && !slave->state.started)
    memcpy(slave->state.real + FIRST_STATE, states, sizeof states);
}

static void reset_slave(Slave *slave) {
  free_delay_line(&slave->delay_line);
  memset(&slave->state, 0, sizeof slave->state);
  memcpy(slave->state.real, model_start, sizeof slave->state.real);
  slave->phase = INSTANTIATED;
  slave->relative_tolerance = RELATIVE_TOLERANCE;
  slave->outputs_stale = 1;
  parameters_changed(slave);
}

static int is_allowed(const Slave *slave, Phase phase, const char *call) {
  static const char *const names[] = {"instantiated", "initialization", "stepping",
                                      "terminated",   "events",         "continuous time"};
  char message[200];
  if (slave->phase == phase) return 1;
  snprintf(message, sizeof message, "%s in the state %s: allowed in the state %s only", call, names[slave->phase],
           names[phase]);
  log_message(slave, STATUS_ERROR, message);
  return 0;
}

/* Whether initialization is over and the end has not come, in either interface. */
static int is_running(const Slave *slave) {
  return slave->phase == STEPPING || slave->phase == EVENTS || slave->phase == CONTINUOUS_TIME;
}

static void set_tolerance(Slave *slave, double tolerance) {
  if (tolerance > 0.0) slave->relative_tolerance = fmin(fmax(tolerance, MIN_RELATIVE_TOLERANCE), MAX_RELATIVE_TOLERANCE);
}

static int are_known(const Slave *slave, const unsigned int *references, size_t count) {
  char message[100];
  size_t k;
  for (k = 0; k < count; k++)
    if (references[k] >= REFERENCE_COUNT) {
      snprintf(message, sizeof message, "no real variable has the value reference %u", references[k]);
      log_message(slave, STATUS_ERROR, message);
      return 0;
    }
  return 1;
}

static int is_within_bounds(const Slave *slave, unsigned int reference, double value) {
  char message[300];
  double lowest = minima[reference - FIRST_PARAMETER], highest = maxima[reference - FIRST_PARAMETER];
  if (value >= lowest && value <= highest) return 1;
  snprintf(message, sizeof message, "%s is %.17g, it has to be finite, at least %g and at most %g",
           variable_names[reference], value, lowest, highest);
  log_message(slave, STATUS_ERROR, message);
  return 0;
}

/* Outputs and local variables lie between inputs and parameters, rates and event indicators behind these. */
static int are_settable(const Slave *slave, const unsigned int *references, size_t count) {
  char message[300];
  size_t k;
  if (!are_known(slave, references, count)) return 0;
  for (k = 0; k < count; k++)
    if ((references[k] >= INPUT_COUNT && references[k] < FIRST_PARAMETER) || references[k] >= VARIABLE_COUNT) {
      snprintf(message, sizeof message, "%s is no input and no parameter: it is computed, and cannot be set",
               variable_names[references[k]]);
      log_message(slave, STATUS_ERROR, message);
      return 0;
    }
  return 1;
}

static int set_variables(Slave *slave, const unsigned int *references, size_t count, const double *values) {
  State *state = &slave->state;
  int sets_parameter = 0;
  size_t k;
  if (!are_settable(slave, references, count)) return STATUS_ERROR;
  for (k = 0; k < count; k++)
    if (references[k] >= FIRST_PARAMETER) {
      if (!is_within_bounds(slave, references[k], values[k])) return STATUS_ERROR;
      sets_parameter = 1;
    }
  for (k = 0; k < count; k++)
    if (references[k] == 0 && values[k] != state->real[0]) {
      memcpy(state->previous_inputs, state->real, sizeof state->previous_inputs);
      state->has_previous_inputs = 1;
    }
  for (k = 0; k < count; k++) {
    state->real[references[k]] = values[k];
    if (references[k] < INPUT_COUNT) state->elapsed = 0.0;
  }
  if (sets_parameter) parameters_changed(slave);
  if (count) slave->outputs_stale = 1;
  return STATUS_OK;
}

/* Values in the middle of the last step, which no inputs of now change. */
static int is_of_last_step(const Slave *slave, int reference) {
  return slave->state.started && !strncmp(variable_names[reference], "middle_", 7);
}

/* Computes the outputs; where the law has no value for the inputs, all that depend on them become NaN. */
static void refresh_outputs(Slave *slave) {
  int k;
  if (!slave->outputs_stale) return;
  slave->outputs_stale = 0;
  if (slave->parameters_valid && refresh(slave)) return;
  for (k = 0; k < VARIABLE_COUNT; k++)
    if (is_output[k] && !is_of_last_step(slave, k) && (k < FIRST_STATE || k >= FIRST_STATE + STATE_COUNT))
      slave->state.real[k] = NAN;
  log_with_inputs(slave, STATUS_WARNING, "no outputs: the law has no value");
}

/* Gets variables of which some are rates or event indicators. */
static void get_further_variables(const Slave *slave, const unsigned int *references, size_t count, double *values) {
#ifdef MODEL_EXCHANGE
  double further[FURTHER_COUNT];
  size_t k;
  further_values(slave, further);
  for (k = 0; k < count; k++)
    values[k] = references[k] < VARIABLE_COUNT ? slave->state.real[references[k]] : further[references[k] - VARIABLE_COUNT];
#else
  (void)slave, (void)references, (void)count, (void)values;
#endif
}

static int get_variables(Slave *slave, const unsigned int *references, size_t count, double *values) {
  size_t k;
  refresh_outputs(slave);
  if (!are_known(slave, references, count)) return STATUS_ERROR;
  for (k = 0; k < count && references[k] < VARIABLE_COUNT; k++) values[k] = slave->state.real[references[k]];
  if (k < count) get_further_variables(slave, references, count, values);
  return STATUS_OK;
}

static int check_inputs(const Slave *slave) {
  if (!slave->parameters_valid) {
    log_message(slave, STATUS_ERROR, "the law has no value for these parameters");
    return STATUS_ERROR;
  }
  if (are_finite(slave->state.real, INPUT_COUNT)) return STATUS_OK;
  log_with_inputs(slave, STATUS_ERROR, "inputs have to be finite");
  return STATUS_ERROR;
}

/* Ends initialization; outputs of the middle of a step, which model exchange has not, then keep their values. */
static int leave_initialization(Slave *slave) {
  slave->phase = STEPPING;
  if (!slave->is_model_exchange) return STATUS_OK;
  refresh_outputs(slave);
  slave->state.started = 1;
  slave->state.start_time = slave->state.time;
  slave->phase = EVENTS;
  return STATUS_OK;
}

static int middle_inputs_hold(const State *state, double time, double step) {
#ifdef MIDDLE_TIME
  return fabs(state->real[MIDDLE_TIME] - time - 0.5 * step) < 1e-3 * step;
#else
  (void)state, (void)time, (void)step;
  return 0;
#endif
}

static int do_step(Slave *slave, double time, double step) {
  State *state = &slave->state, before;
  DelayLine delay_before = {0, 0, NULL};
  char message[200];
  int at_end;
  if (!(step > 0.0 && is_finite(step) && is_finite(time))) {
    snprintf(message, sizeof message, "step of %.17g s at %.17g s: must be positive", step, time);
    log_message(slave, STATUS_ERROR, message);
    return STATUS_ERROR;
  }
  if (check_inputs(slave) != STATUS_OK) return STATUS_ERROR;
  if (!copy_delay_line(&delay_before, &slave->delay_line)) return STATUS_ERROR;
  before = *state;
  at_end = state->has_previous_inputs && state->real[0] > time + 0.5 * step;
  slave->has_middle_inputs = at_end && middle_inputs_hold(state, time, step);
  state->time = time;
  slave->outputs_stale = 1;
  if (!advance(slave, step, at_end) || !are_finite(state->real + FIRST_STATE, STATE_COUNT)) {
    *state = before;
    free_delay_line(&slave->delay_line);
    slave->delay_line = delay_before;
    snprintf(message, sizeof message, "step of %.9g s at %.9g s: the law has no value", step, time);
    log_with_inputs(slave, STATUS_DISCARD, message);
    return STATUS_DISCARD;
  }
  free_delay_line(&delay_before);
  state->started = 1;
  state->time = time + step;
  state->elapsed = at_end ? 0.0 : step;
  return STATUS_OK;
}

/* The rate variable that is the derivative of some order of a variable; VARIABLE_COUNT where there is none. */
static unsigned int derivative_of(unsigned int reference, int order) {
  while (order-- > 0 && reference < VARIABLE_COUNT) reference = rate_references[reference];
  return reference;
}

/* The derivative of some order of an output; by FMI it is 0 where the output has none of this order. */
static int get_output_derivative(Slave *slave, unsigned int reference, int order, double *value) {
  unsigned int rate = derivative_of(reference, order);
  if (reference >= VARIABLE_COUNT || !is_output[reference] || order < 1) {
    log_message(slave, STATUS_ERROR, "only outputs have derivatives to get, of order 1 or higher");
    return STATUS_ERROR;
  }
  *value = 0.0;
  return rate < VARIABLE_COUNT ? get_variables(slave, &rate, 1, value) : STATUS_OK;
}
