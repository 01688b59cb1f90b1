/* A winch: a commanded rope speed in, the speed of rope and motor out. The law is in the equations. */

#define COMMAND 1
#define FIRST_OUTPUT 3
#define MARGINS 3
#define MOTOR_SPEED_RATIO 4
#define FASTEST_RATE 5
/* Longest inner step in time constants of the speed loop. */
#define MAX_INNER_STEP 0.2
#define MAX_EVENTS_PER_INNER_STEP 12
#define BISECTION_COUNT 44
#define MAX_INNER_STEPS 1000000

/* Commanded speed over a step: that at its start with its rate, or both ends. */
typedef struct {
  const double *first, *last;
  double step;
} SpeedCommand;

typedef struct {
  const Slave *slave;
  SpeedCommand command;
} Drive;

static double speed_command(const SpeedCommand *command, double elapsed) {
  double values[2], fraction = elapsed / command->step;
  if (!command->first) return command->last[0] + elapsed * command->last[1];
  cubic(command->first, command->last, &command->step, &fraction, values);
  return values[0];
}

static int derive_start(Slave *slave, double *start_states) {
  const double *parameters = slave->state.real + FIRST_PARAMETER;
  memset(start_states, 0, STATE_COUNT * sizeof(double));
  return winch_drive(parameters, slave->start);
}

static int margins_at(const Drive *drive, double elapsed, const double *state, double *margins) {
  double command = speed_command(&drive->command, elapsed);
  return winch_margins(state, &command, drive->slave->start, margins);
}

static int inner_step(const Drive *drive, double begin, double end, const double *state, double *end_state) {
  double step = end - begin, k1[2], k2[2], k3[2], k4[2], inner[2];
  double first = speed_command(&drive->command, begin), last = speed_command(&drive->command, end);
  double middle = speed_command(&drive->command, begin + 0.5 * step);
  const double *constants = drive->slave->start;
  int k;
  if (!winch_rates(state, &first, constants, k1)) return 0;
  for (k = 0; k < 2; k++) inner[k] = state[k] + 0.5 * step * k1[k];
  if (!winch_rates(inner, &middle, constants, k2)) return 0;
  for (k = 0; k < 2; k++) inner[k] = state[k] + 0.5 * step * k2[k];
  if (!winch_rates(inner, &middle, constants, k3)) return 0;
  for (k = 0; k < 2; k++) inner[k] = state[k] + step * k3[k];
  if (!winch_rates(inner, &last, constants, k4)) return 0;
  for (k = 0; k < 2; k++) end_state[k] = state[k] + step / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
  return 1;
}

/* Whether some margin changed its sign: a zero crossing. */
static int sign_changed(const double *before, const double *after) {
  int k;
  for (k = 0; k < MARGINS; k++)
    if ((before[k] > 0.0) != (after[k] > 0.0)) return 1;
  return 0;
}

/* Locates the first state event by bisection; time, state and margins become those just after it. */
static int locate_event(const Drive *drive, double end, double *time, double *state, double *margins) {
  double low = *time, high = end, middle, event_state[2], event_margins[MARGINS];
  int k;
  for (k = 0; k < BISECTION_COUNT; k++) {
    middle = 0.5 * (low + high);
    if (!inner_step(drive, *time, middle, state, event_state)) return 0;
    if (!margins_at(drive, middle, event_state, event_margins)) return 0;
    if (sign_changed(margins, event_margins))
      high = middle;
    else
      low = middle;
  }
  if (!inner_step(drive, *time, high, state, event_state)) return 0;
  if (!margins_at(drive, high, event_state, margins)) return 0;
  memcpy(state, event_state, sizeof event_state);
  *time = high;
  return 1;
}

static int step_across_events(const Drive *drive, double begin, double end, double *state, double *margins) {
  double end_state[2], end_margins[MARGINS];
  int event;
  for (event = 0;; event++) {
    if (!inner_step(drive, begin, end, state, end_state)) return 0;
    if (!margins_at(drive, end, end_state, end_margins)) return 0;
    if (event == MAX_EVENTS_PER_INNER_STEP || !sign_changed(margins, end_margins)) break;
    if (!locate_event(drive, end, &begin, state, margins)) return 0;
  }
  memcpy(state, end_state, sizeof end_state);
  memcpy(margins, end_margins, sizeof end_margins);
  return 1;
}

static int advance(Slave *slave, double step, int at_end) {
  double state[2], margins[MARGINS], *real = slave->state.real;
  double count = fmax(1.0, ceil(step * slave->start[FASTEST_RATE] / MAX_INNER_STEP));
  Drive drive;
  int k;
  if (!(count <= MAX_INNER_STEPS)) return 0;
  drive.slave = slave;
  drive.command.first = at_end ? slave->state.previous_inputs + COMMAND : NULL;
  drive.command.last = real + COMMAND;
  drive.command.step = step;
  memcpy(state, real + FIRST_STATE, sizeof state);
  if (!margins_at(&drive, 0.0, state, margins)) return 0;
  for (k = 0; k < (int)count; k++)
    if (!step_across_events(&drive, step * k / count, step * (k + 1) / count, state, margins)) return 0;
  memcpy(real + FIRST_STATE, state, sizeof state);
  return 1;
}

static int refresh(Slave *slave) {
  double *real = slave->state.real, command = real[COMMAND] + slave->state.elapsed * real[COMMAND + 1], rates[2];
  if (!winch_rates(real + FIRST_STATE, &command, slave->start, rates)) return 0;
  real[FIRST_OUTPUT] = slave->start[MOTOR_SPEED_RATIO] * real[FIRST_STATE];
  real[FIRST_OUTPUT + 1] = rates[0];
  return winch_margins(real + FIRST_STATE, &command, slave->start, real + FIRST_OUTPUT + 2);
}

static int differentiate(const Slave *slave, const double *seed, double *change) {
  const double *real = slave->state.real;
  double command = real[COMMAND] + slave->state.elapsed * real[COMMAND + 1], *rates = change + VARIABLE_COUNT;
  if (!winch_derivative(real + FIRST_STATE, &command, slave->start, seed + FIRST_STATE, seed + COMMAND, rates,
                        change + FIRST_OUTPUT + 2))
    return 0;
  memcpy(change + FIRST_STATE, seed + FIRST_STATE, STATE_COUNT * sizeof(double));
  change[FIRST_OUTPUT] = slave->start[MOTOR_SPEED_RATIO] * seed[FIRST_STATE];
  change[FIRST_OUTPUT + 1] = rates[0];
  return 1;
}

#ifdef MODEL_EXCHANGE
static int rates_now(const Slave *slave, double *rates) {
  const double *real = slave->state.real;
  double command = real[COMMAND] + slave->state.elapsed * real[COMMAND + 1];
  return winch_rates(real + FIRST_STATE, &command, slave->start, rates);
}

static int indicators_now(const Slave *slave, double *indicators) {
  const double *real = slave->state.real;
  double command = real[COMMAND] + slave->state.elapsed * real[COMMAND + 1];
  return winch_margins(real + FIRST_STATE, &command, slave->start, indicators);
}

static int record_now(Slave *slave) {
  (void)slave;
  return 1;
}
#endif
