/* The platform as a point mass: cable forces in, motion out. The law is in the equations. */

#define START 2
#define ACCELERATION (FIRST_STATE + 6)
#define MIDDLE_MOTION (FIRST_STATE + 9)

static int derive_start(Slave *slave, double *start_states) {
  memcpy(start_states, parameters_of(slave) + START, 3 * sizeof(double));
  memcpy(start_states + 3, model_constants, 3 * sizeof(double));
  return platform_sensor(parameters_of(slave), slave->start);
}

static int advance(Slave *slave, double step, int at_end) {
  double *real = slave->state.real, start[9];
  Translation translation;
  memcpy(start, real + FIRST_STATE, MASS_SIZE * sizeof(double));
  if (!translate(slave, start, step, at_end, &translation)) return 0;
  memcpy(start + 6, translation.start_acceleration, 3 * sizeof(double));
  if (!record_path(slave, step, start, translation.end)) return 0;
  memcpy(real + FIRST_STATE, translation.end, MASS_SIZE * sizeof(double));
  memcpy(real + MIDDLE_MOTION, translation.middle, sizeof translation.middle);
  return 1;
}

static int refresh(Slave *slave) {
  double *real = slave->state.real;
  if (!present_acceleration(slave, real + FIRST_STATE, real + ACCELERATION)) return 0;
  if (!slave->state.started) memcpy(real + MIDDLE_MOTION, real + FIRST_STATE, 9 * sizeof(double));
  refresh_measured_position(slave, real + FIRST_STATE);
  return 1;
}

static int differentiate(const Slave *slave, const double *seed, double *change) {
  const double *mass = slave->state.real + FIRST_STATE, *mass_seed = seed + FIRST_STATE;
  double *rates = change + VARIABLE_COUNT;
  if (!differentiate_acceleration(slave, mass, seed, mass_seed, change + ACCELERATION)) return 0;
  memcpy(change + FIRST_STATE, mass_seed, MASS_SIZE * sizeof(double));
  if (middle_is_now(slave)) memcpy(change + MIDDLE_MOTION, change + FIRST_STATE, 9 * sizeof(double));
  change_measured_position(slave, change + FIRST_STATE, seed[TIME_SEED], change);
  memcpy(rates, mass_seed + 3, 3 * sizeof(double));
  memcpy(rates + 3, change + ACCELERATION, 3 * sizeof(double));
  return 1;
}

#ifdef MODEL_EXCHANGE
static int rates_now(const Slave *slave, double *rates) {
  const double *mass = slave->state.real + FIRST_STATE;
  memcpy(rates, mass + 3, 3 * sizeof(double));
  return present_acceleration(slave, mass, rates + 3);
}

static int indicators_now(const Slave *slave, double *indicators) {
  return present_kinks(slave, slave->state.real + FIRST_STATE, indicators);
}

static int record_now(Slave *slave) {
  double motion[9];
  if (!(slave->start[POSITION_DELAY] > 0.0)) return 1;
  memcpy(motion, slave->state.real + FIRST_STATE, MASS_SIZE * sizeof(double));
  return present_acceleration(slave, motion, motion + 6) && record_motion(slave, motion);
}
#endif
