/* FMI 2.0 functions of model exchange. */

static fmi2Status enter(fmi2Component c, Phase from, Phase to, const char *call) {
  Slave *slave = &((Instance *)c)->slave;
  if (!is_allowed(slave, from, call)) return fmi2Error;
  slave->phase = to;
  return fmi2OK;
}

/* Numbers of states or event indicators, from initialization on. */
static fmi2Status get_numbers(fmi2Component c, int (*get)(Slave *, double *), double *values, size_t count,
                              size_t expected) {
  Slave *slave = &((Instance *)c)->slave;
  if (!has_states_to_give(slave)) return fmi2Error;
  if (count != expected) return refuse((Instance *)c, "as many numbers as states or event indicators are needed");
  return (fmi2Status)get(slave, values);
}

fmi2Status fmi2EnterEventMode(fmi2Component c) { return enter(c, CONTINUOUS_TIME, EVENTS, "fmi2EnterEventMode"); }

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
  fmi2Status status = enter(c, EVENTS, CONTINUOUS_TIME, "fmi2EnterContinuousTimeMode");
  return status == fmi2OK ? (fmi2Status)record_instant_now(&((Instance *)c)->slave) : status;
}

/* There are no discrete states: the laws are continuous where they have kinks. */
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
  memset(info, 0, sizeof *info);
  return enter(c, EVENTS, EVENTS, "fmi2NewDiscreteStates");
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_rollback, fmi2Boolean *enter_event_mode,
                                       fmi2Boolean *terminate) {
  (void)no_rollback;
  *enter_event_mode = *terminate = fmi2False;
  if (!is_allowed(&((Instance *)c)->slave, CONTINUOUS_TIME, "fmi2CompletedIntegratorStep")) return fmi2Error;
  return (fmi2Status)record_instant_now(&((Instance *)c)->slave);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
  Slave *slave = &((Instance *)c)->slave;
  if (slave->phase != EVENTS && !is_allowed(slave, CONTINUOUS_TIME, "fmi2SetTime")) return fmi2Error;
  set_time(slave, time);
  return fmi2OK;
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real states[], size_t count) {
  Slave *slave = &((Instance *)c)->slave;
  if (!is_allowed(slave, CONTINUOUS_TIME, "fmi2SetContinuousStates")) return fmi2Error;
  if (count != STATE_COUNT) return refuse((Instance *)c, "as many numbers as states are needed");
  set_states(slave, states);
  return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real states[], size_t count) {
  return get_numbers(c, get_states, states, count, STATE_COUNT);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t count) {
  if (count != STATE_COUNT) return refuse((Instance *)c, "as many numbers as states are needed");
  return (fmi2Status)get_nominals(&((Instance *)c)->slave, nominals);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t count) {
  return get_numbers(c, get_rates, derivatives, count, STATE_COUNT);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t count) {
  return get_numbers(c, get_indicators, indicators, count, INDICATOR_COUNT);
}
