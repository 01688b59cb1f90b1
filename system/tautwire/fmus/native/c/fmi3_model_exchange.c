/* FMI 3.0 functions of model exchange. */

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
  (void)name, (void)resources, (void)visible;
  return new_instance(token, NULL, logging_on, environment, log, 1);
}

static fmi3Status enter(fmi3Instance c, Phase from, Phase to, const char *call) {
  Slave *slave = &((Instance3 *)c)->slave;
  if (!is_allowed(slave, from, call)) return fmi3Error;
  slave->phase = to;
  return fmi3OK;
}

/* Numbers of states or event indicators, from initialization on. */
static fmi3Status get_numbers(fmi3Instance c, int (*get)(Slave *, double *), double *values, size_t count,
                              size_t expected) {
  Slave *slave = &((Instance3 *)c)->slave;
  if (!has_states_to_give(slave)) return fmi3Error;
  if (count != expected) return refuse(c, "as many numbers as states or event indicators are needed");
  return (fmi3Status)get(slave, values);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) { return enter(c, CONTINUOUS_TIME, EVENTS, "fmi3EnterEventMode"); }

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
  fmi3Status status = enter(c, EVENTS, CONTINUOUS_TIME, "fmi3EnterContinuousTimeMode");
  return status == fmi3OK ? (fmi3Status)record_instant_now(&((Instance3 *)c)->slave) : status;
}

/* There are no discrete states: the laws are continuous where they have kinks. */
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *update, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_event, fmi3Float64 *event) {
  *update = *terminate = *nominals = *values = *has_event = fmi3False;
  *event = 0.0;
  return enter(c, EVENTS, EVENTS, "fmi3UpdateDiscreteStates");
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_rollback, fmi3Boolean *enter_event_mode,
                                       fmi3Boolean *terminate) {
  (void)no_rollback;
  *enter_event_mode = *terminate = fmi3False;
  if (!is_allowed(&((Instance3 *)c)->slave, CONTINUOUS_TIME, "fmi3CompletedIntegratorStep")) return fmi3Error;
  return (fmi3Status)record_instant_now(&((Instance3 *)c)->slave);
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
  Slave *slave = &((Instance3 *)c)->slave;
  if (slave->phase != EVENTS && !is_allowed(slave, CONTINUOUS_TIME, "fmi3SetTime")) return fmi3Error;
  set_time(slave, time);
  return fmi3OK;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t count) {
  Slave *slave = &((Instance3 *)c)->slave;
  if (!is_allowed(slave, CONTINUOUS_TIME, "fmi3SetContinuousStates")) return fmi3Error;
  if (count != STATE_COUNT) return refuse(c, "as many numbers as states are needed");
  set_states(slave, states);
  return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 states[], size_t count) {
  return get_numbers(c, get_states, states, count, STATE_COUNT);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t count) {
  if (count != STATE_COUNT) return refuse(c, "as many numbers as states are needed");
  return (fmi3Status)get_nominals(&((Instance3 *)c)->slave, nominals);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t count) {
  return get_numbers(c, get_rates, derivatives, count, STATE_COUNT);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t count) {
  return get_numbers(c, get_indicators, indicators, count, INDICATOR_COUNT);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count) {
  (void)c;
  *count = STATE_COUNT;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count) {
  (void)c;
  *count = INDICATOR_COUNT;
  return fmi3OK;
}
