/* Model exchange: time and states as an importer's integrator sets them; their rates and event indicators now. */

/* Rates of the states, then event indicators; NaN where the law has no value. */
static void further_values(const Slave *slave, double *values) {
  int k;
  if (slave->parameters_valid && rates_now(slave, values) && indicators_now(slave, values + STATE_COUNT)) return;
  for (k = 0; k < FURTHER_COUNT; k++) values[k] = NAN;
}

static void set_time(Slave *slave, double time) {
  slave->state.time = time;
#ifdef TIME_INDEX
  slave->state.real[TIME_INDEX] = time - slave->state.start_time;
#endif
  slave->outputs_stale = 1;
}

static void set_states(Slave *slave, const double *states) {
  memcpy(slave->state.real + FIRST_STATE, states, STATE_COUNT * sizeof(double));
  slave->outputs_stale = 1;
}

/* Whether states, their derivatives and event indicators may be had. */
static int has_states_to_give(const Slave *slave) {
  if (slave->is_model_exchange && slave->phase != INSTANTIATED) return 1;
  log_message(slave, STATUS_ERROR, "states and event indicators: in model exchange only, and from initialization on");
  return 0;
}

static int get_states(Slave *slave, double *states) {
  memcpy(states, slave->state.real + FIRST_STATE, STATE_COUNT * sizeof(double));
  return STATUS_OK;
}

static int get_nominals(Slave *slave, double *nominals) {
  (void)slave;
  memcpy(nominals, model_nominals, STATE_COUNT * sizeof(double));
  return STATUS_OK;
}

static int discard(const Slave *slave, const char *what) {
  char message[100];
  snprintf(message, sizeof message, "%s at %.9g s: the law has no value", what, slave->state.time);
  log_with_inputs(slave, STATUS_DISCARD, message);
  return STATUS_DISCARD;
}

static int get_rates(Slave *slave, double *rates) {
  if (check_inputs(slave) != STATUS_OK) return STATUS_ERROR;
  return rates_now(slave, rates) && are_finite(rates, STATE_COUNT) ? STATUS_OK : discard(slave, "derivatives of the states");
}

static int get_indicators(Slave *slave, double *indicators) {
  if (check_inputs(slave) != STATUS_OK) return STATUS_ERROR;
  return indicators_now(slave, indicators) ? STATUS_OK : discard(slave, "event indicators");
}

/* Records what sensors show late: where an integrator step ends, and where one begins after an event. */
static int record_instant_now(Slave *slave) {
  if (slave->parameters_valid && record_now(slave)) return STATUS_OK;
  log_with_inputs(slave, STATUS_ERROR, "nothing to record for sensors that show late: the law has no value");
  return STATUS_ERROR;
}
