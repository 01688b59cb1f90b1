/* The whole robot: winch speeds and an external load in; motion of the platform, tensions and lengths out.

   The laws are those of the components, in the equations. Their states are integrated together: those of the platform,
   then of each cable, then of each winch. */

#define SPEEDS 1
#define EXTERNAL (SPEEDS + 2 * CABLE_COUNT)
#define LOAD_SIZE (3 * CABLE_COUNT + EXTERNAL_SIZE)
#define END_SIZE 6
#define POINT_SIZE 9
#define MOTION_SIZE 11
#define SHOWN_SIZE (IS_RIGID ? 15 : 9)
#define SHOWN_STATES (IS_RIGID ? 0 : 6)
/* Of a cable's law: force and all that the robot shows, from the tension on; rates of force and tension. */
#define OUTPUTS_SIZE 8
#define RATES_SIZE 4
#define TENSION 3
#define SHOWN_BY_CABLE 5
#define TENSION_RATE_OUTPUT 5
#define POSITION_GAIN 0
#define POSITION_OFFSET 1
#define POSITION_DELAY 4
#define TENSION_DELAY 4
#define MAX_INNER_STEPS 1000000
#define STEPS_BACK_INTO_DOMAIN 1

typedef int (*CableStart)(const double *, double *, double *);
typedef int (*CableAction)(const double *, const double *, const double *, const double *, const double *, double *,
                           double *);
typedef int (*CableShown)(const double *, const double *, const double *, const double *, double *, double *);
typedef int (*CableChange)(const double *, const double *, const double *, const double *, const double *, double *,
                           double *);

static const int cable_kinds[] = CABLE_KINDS, cable_states[] = CABLE_STATES, cable_parameters[] = CABLE_PARAMETERS;
static const CableStart cable_starts[] = CABLE_START_FUNCTIONS;
static const CableAction cable_actions[] = CABLE_ACTION_FUNCTIONS;
static const CableShown cable_outputs[] = CABLE_OUTPUTS_FUNCTIONS;
static const CableChange cable_derivatives[] = CABLE_DERIVATIVE_FUNCTIONS;
#if HAS_WINCHES
static const int winch_states[] = WINCH_STATES, winch_parameters[] = WINCH_PARAMETERS;
#endif

/* What acts at an instant: speed of each rope with its rate, and the external load. */
typedef struct {
  double speeds[CABLE_COUNT][2];
  double external[EXTERNAL_SIZE];
} Drivers;

/* What the components show at an instant. */
typedef struct {
  double platform[SHOWN_SIZE];
  double cables[CABLE_COUNT][OUTPUTS_SIZE];
  double rates[CABLE_COUNT][RATES_SIZE];
} Shown;

static const double *parameters_of(const Slave *slave) { return slave->state.real + FIRST_PARAMETER; }

static const double *cable_values(const Slave *slave, int cable) { return parameters_of(slave) + cable_parameters[cable]; }

/* Where the numbers that follow from parameters begin. */
static int cable_place(int cable) { return PLATFORM_START_SIZE + cable * CABLE_START_SIZE; }

static const double *cable_constants(const Slave *slave, int cable) { return slave->start + cable_place(cable); }

#if HAS_WINCHES
static int winch_place(int winch) { return cable_place(CABLE_COUNT) + winch * DRIVE_SIZE; }
#endif

static int derive_start(Slave *slave, double *states) {
  double axes[9] = {0.0};
  int k;
  memset(states, 0, STATE_COUNT * sizeof(double));
#if IS_RIGID
  principal_axes(parameters_of(slave) + INERTIA, axes);
#endif
  if (!platform_start(parameters_of(slave), axes, model_constants, slave->start, states)) return 0;
  for (k = 0; k < CABLE_COUNT; k++)
    if (!cable_starts[cable_kinds[k]](cable_values(slave, k), slave->start + cable_place(k), states + cable_states[k]))
      return 0;
#if HAS_WINCHES
  for (k = 0; k < CABLE_COUNT; k++)
    if (!winch_drive(parameters_of(slave) + winch_parameters[k], slave->start + winch_place(k))) return 0;
#endif
  return 1;
}

/* Value and rate of an input after a fraction of a step; `stride` is from the value to its rate. */
static void input_at(const Slave *slave, int reference, int stride, double step, double fraction, int at_end,
                     double *values) {
  const double *before = slave->state.previous_inputs + reference, *now = slave->state.real + reference;
  double first[2], last[2];
  if (!at_end) {
    values[0] = now[0] + fraction * step * now[stride];
    values[1] = now[stride];
    return;
  }
  first[0] = before[0];
  first[1] = before[stride];
  last[0] = now[0];
  last[1] = now[stride];
  cubic(first, last, &step, &fraction, values);
}

/* Inputs after a fraction of a step; of winches `speeds` are the commands. */
static void drivers_at(const Slave *slave, double step, double fraction, int at_end, Drivers *drivers) {
  double values[2];
  int k;
  for (k = 0; k < CABLE_COUNT; k++) input_at(slave, SPEEDS + 2 * k, 1, step, fraction, at_end, drivers->speeds[k]);
  for (k = 0; k < EXTERNAL_SIZE; k++) {
    input_at(slave, EXTERNAL + 6 * (k / 3) + k % 3, 3, step, fraction, at_end, values);
    drivers->external[k] = values[0];
  }
}

/* Rates of the winches' states; their speeds take the place of their commands. */
static int drive_winches(const Slave *slave, const double *states, Drivers *drivers, double *rates) {
#if HAS_WINCHES
  int k;
  for (k = 0; k < CABLE_COUNT; k++) {
    const double *state = states + winch_states[k];
    if (!winch_rates(state, drivers->speeds[k], slave->start + winch_place(k), rates + winch_states[k])) return 0;
    drivers->speeds[k][0] = state[0];
    drivers->speeds[k][1] = rates[winch_states[k]];
  }
#else
  (void)slave, (void)states, (void)drivers, (void)rates;
#endif
  return 1;
}

/* Rates of the states of winches and cables, and the load on the platform. */
static int act(const Slave *slave, const double *states, Drivers *drivers, double *rates, double *load) {
  double ends[CABLE_COUNT][END_SIZE];
  int k;
  if (!drive_winches(slave, states, drivers, rates)) return 0;
  if (!platform_ends(states, slave->start, ends[0])) return 0;
  for (k = 0; k < CABLE_COUNT; k++)
    if (!cable_actions[cable_kinds[k]](ends[k], drivers->speeds[k], states + cable_states[k], cable_values(slave, k),
                                       cable_constants(slave, k), rates + cable_states[k], load + 3 * k))
      return 0;
  memcpy(load + 3 * CABLE_COUNT, drivers->external, sizeof drivers->external);
  return 1;
}

static int state_rates(const Slave *slave, double step, double fraction, int at_end, const double *states,
                       double *rates) {
  double load[LOAD_SIZE];
  Drivers drivers;
  drivers_at(slave, step, fraction, at_end, &drivers);
  return act(slave, states, &drivers, rates, load) &&
         platform_rates(states, load, parameters_of(slave), slave->start, rates);
}

#include "dormand_prince.c"

static void motion_of_end(const double *end, const double *speed, double *motion) {
  memcpy(motion, end, POINT_SIZE * sizeof(double));
  memcpy(motion + POINT_SIZE, speed, 2 * sizeof(double));
}

static int show(const Slave *slave, const double *states, Drivers *drivers, Shown *shown) {
  double rates[STATE_COUNT], load[LOAD_SIZE], ends[CABLE_COUNT][POINT_SIZE], motion[MOTION_SIZE];
  int k;
  if (!act(slave, states, drivers, rates, load)) return 0;
  if (!platform_motion(states, load, parameters_of(slave), slave->start, shown->platform, ends[0])) return 0;
  for (k = 0; k < CABLE_COUNT; k++) {
    motion_of_end(ends[k], drivers->speeds[k], motion);
    if (!cable_outputs[cable_kinds[k]](motion, states + cable_states[k], cable_values(slave, k),
                                       cable_constants(slave, k), shown->cables[k], shown->rates[k]))
      return 0;
  }
  return 1;
}

/* Longest lag of a sensor. */
static double longest_delay(const Slave *slave) {
  double delay = slave->start[POSITION_DELAY];
  int k;
  for (k = 0; k < CABLE_COUNT; k++) delay = fmax(delay, cable_constants(slave, k)[TENSION_DELAY]);
  return delay;
}

/* What sensors measure: for each axis of the position value and two derivatives, for each tension value and rate. */
static int measure(const Slave *slave, double step, int at_end, const Progress *at, double *signals) {
  Drivers drivers;
  Shown shown;
  int k, j;
  drivers_at(slave, step, at->done, at_end, &drivers);
  if (!show(slave, at->state, &drivers, &shown)) return 0;
  for (k = 0; k < 3; k++)
    for (j = 0; j < 3; j++) signals[3 * k + j] = shown.platform[3 * j + k];
  for (k = 0; k < CABLE_COUNT; k++) {
    signals[9 + 3 * k] = shown.cables[k][TENSION];
    signals[9 + 3 * k + 1] = shown.rates[k][TENSION];
    signals[9 + 3 * k + 2] = 0.0;
  }
  return 1;
}

static int record(Slave *slave, double step, int at_end, const Progress *before, const Progress *after, double lag) {
  double segment[SEGMENT_SIZE];
  segment[0] = slave->state.time + before->done * step;
  segment[1] = slave->state.time + after->done * step;
  return measure(slave, step, at_end, before, segment + 2) &&
         measure(slave, step, at_end, after, segment + 2 + 3 * SIGNAL_AXES) &&
         append_segment(&slave->delay_line, segment, lag);
}

/* The step that ends a macro step may be short: it does not shorten the next one. */
static void keep_length(const Progress *at, Progress *next) {
  if (at->part >= 1.0 - at->done && next->done == 1.0) next->part = fmax(next->part, at->part);
}

static void normalise_orientation(double *states) {
#if IS_RIGID
  double length = sqrt(states[0] * states[0] + states[1] * states[1] + states[2] * states[2] + states[3] * states[3]);
  int k;
  for (k = 0; k < 4; k++) states[k] /= length;
#else
  (void)states;
#endif
}

static int advance(Slave *slave, double step, int at_end) {
  double *real = slave->state.real, lag = longest_delay(slave);
  double part = real[INNER_STEP] > 0.0 ? fmin(1.0, real[INNER_STEP] / step) : 1.0;
  Progress at, next;
  int count = 0;
  if (!begin_integration(slave, step, at_end, real + FIRST_STATE, part, &at)) return 0;
  for (; at.done < 1.0; at = next) {
    if (count++ == MAX_INNER_STEPS || !inner_step(slave, step, at_end, &at, &next)) return 0;
    if (lag > 0.0 && !record(slave, step, at_end, &at, &next, lag)) return 0;
    keep_length(&at, &next);
  }
  normalise_orientation(at.state);
  memcpy(real + FIRST_STATE, at.state, sizeof at.state);
  real[INNER_STEP] = at.part * step;
  return 1;
}

static void refresh_measured_position(Slave *slave, const double *position) {
#ifdef MEASURED_POSITION
  const double *sensor = slave->start;
  double delayed[2];
  int axis;
  for (axis = 0; axis < 3; axis++) {
    delayed[0] = position[axis];
    if (sensor[POSITION_DELAY] > 0.0 && slave->delay_line.count)
      delayed_signal(&slave->delay_line, sensor[POSITION_DELAY], axis, 3, delayed);
    slave->state.real[MEASURED_POSITION + axis] = sensor[POSITION_GAIN] * delayed[0] + sensor[POSITION_OFFSET + axis];
  }
#else
  (void)slave, (void)position;
#endif
}

/* Whether a load cell shows late. */
static int is_delayed(const Slave *slave, int cable) {
  return cable_constants(slave, cable)[TENSION_DELAY] > 0.0 && slave->delay_line.count;
}

static int refresh(Slave *slave) {
  double *real = slave->state.real, *cables = real + FIRST_CABLE_OUTPUT, delayed[2];
  Drivers drivers;
  Shown shown;
  int k, j;
  drivers_at(slave, slave->state.elapsed, 1.0, 0, &drivers);
  if (!show(slave, real + FIRST_STATE, &drivers, &shown)) return 0;
  memcpy(real + FIRST_OUTPUT, shown.platform + SHOWN_STATES, (SHOWN_SIZE - SHOWN_STATES) * sizeof(double));
  refresh_measured_position(slave, shown.platform);
  for (k = 0; k < CABLE_COUNT; k++) {
    delayed[0] = shown.cables[k][TENSION];
    delayed[1] = shown.rates[k][TENSION];
    if (is_delayed(slave, k))
      delayed_signal(&slave->delay_line, cable_constants(slave, k)[TENSION_DELAY], 3 + k, 2, delayed);
    cables[k] = delayed[0];
    for (j = 1; j < SHOWN_BY_CABLE; j++) cables[CABLE_COUNT * j + k] = shown.cables[k][TENSION + j];
    cables[CABLE_COUNT * TENSION_RATE_OUTPUT + k] = delayed[1];
  }
  return 1;
}
