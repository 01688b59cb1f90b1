/* How the outputs of a whole robot change along a change of its inputs, at the present instant with the states held. */

/* Motion of each cable's end and winch, and the change of that. */
typedef struct {
  double motions[CABLE_COUNT][MOTION_SIZE], seeds[CABLE_COUNT][MOTION_SIZE];
} Changes;

/* How the outputs of all cables and their rates change along the seeds. */
static int change_cables(const Slave *slave, const Changes *along, double (*outputs)[OUTPUTS_SIZE], double (*rates)[RATES_SIZE]) {
  const double *states = slave->state.real + FIRST_STATE;
  int k;
  for (k = 0; k < CABLE_COUNT; k++)
    if (!cable_derivatives[cable_kinds[k]](along->motions[k], states + cable_states[k], cable_values(slave, k),
                                           cable_constants(slave, k), along->seeds[k], outputs[k], rates[k]))
      return 0;
  return 1;
}

/* How speed and acceleration of a rope change; a winch's acceleration follows its command at once. */
static int change_speed(const Slave *slave, int cable, const double *command, const double *seed, double *change) {
#if HAS_WINCHES
  double rates[2], margins[3], held[2] = {0.0, 0.0};
  const double *state = slave->state.real + FIRST_STATE + winch_states[cable];
  if (!winch_derivative(state, command, slave->start + winch_place(cable), held, seed, rates, margins)) return 0;
  change[0] = 0.0;
  change[1] = rates[0];
#else
  (void)slave, (void)cable, (void)command;
  memcpy(change, seed, 2 * sizeof(double));
#endif
  return 1;
}

/* Load now and its change, with the motions that the cables have under it and the change of their winches. */
static int change_load(const Slave *slave, const double *seed, Changes *along, double *load, double *change) {
  double rates[STATE_COUNT], ends[CABLE_COUNT][POINT_SIZE], platform[SHOWN_SIZE];
  double outputs[CABLE_COUNT][OUTPUTS_SIZE], output_rates[CABLE_COUNT][RATES_SIZE];
  const double *states = slave->state.real + FIRST_STATE;
  Drivers drivers;
  int k;
  drivers_at(slave, slave->state.elapsed, 1.0, 0, &drivers);
  memset(along->seeds, 0, sizeof along->seeds);
  for (k = 0; k < CABLE_COUNT; k++)
    if (!change_speed(slave, k, drivers.speeds[k], seed + SPEEDS + 2 * k, along->seeds[k] + POINT_SIZE)) return 0;
  if (!act(slave, states, &drivers, rates, load)) return 0;
  if (!platform_motion(states, load, parameters_of(slave), slave->start, platform, ends[0])) return 0;
  for (k = 0; k < CABLE_COUNT; k++) motion_of_end(ends[k], drivers.speeds[k], along->motions[k]);
  if (!change_cables(slave, along, outputs, output_rates)) return 0;
  for (k = 0; k < CABLE_COUNT; k++) memcpy(change + 3 * k, outputs[k], 3 * sizeof(double));
  for (k = 0; k < EXTERNAL_SIZE; k++) change[3 * CABLE_COUNT + k] = seed[EXTERNAL + 6 * (k / 3) + k % 3];
  return 1;
}

/* Forces change by the speeds of the winches, by them the accelerations, and by these the rates of the tensions. */
static int differentiate(const Slave *slave, const double *seed, double *change) {
  double load[LOAD_SIZE], load_change[LOAD_SIZE], platform[SHOWN_SIZE], ends[CABLE_COUNT][POINT_SIZE];
  double outputs[CABLE_COUNT][OUTPUTS_SIZE], rates[CABLE_COUNT][RATES_SIZE], *cables = change + FIRST_CABLE_OUTPUT;
  Changes along;
  int k, j;
  if (!change_load(slave, seed, &along, load, load_change)) return 0;
  if (!platform_derivative(slave->state.real + FIRST_STATE, load, parameters_of(slave), slave->start, load_change,
                           platform, ends[0]))
    return 0;
  for (k = 0; k < CABLE_COUNT; k++) memcpy(along.seeds[k], ends[k], sizeof ends[k]);
  if (!change_cables(slave, &along, outputs, rates)) return 0;
  memcpy(change + FIRST_OUTPUT, platform + SHOWN_STATES, (SHOWN_SIZE - SHOWN_STATES) * sizeof(double));
  for (k = 0; k < CABLE_COUNT; k++) {
    for (j = 1; j < SHOWN_BY_CABLE; j++) cables[CABLE_COUNT * j + k] = outputs[k][TENSION + j];
    if (is_delayed(slave, k)) continue;
    cables[k] = outputs[k][TENSION];
    cables[CABLE_COUNT * TENSION_RATE_OUTPUT + k] = rates[k][TENSION];
  }
  return 1;
}
