/* A cable: motion of its end and winch speed in, tension and force out. The law is in the equations. */

#define POSITION 2
#define FIRST_MIDDLE_INPUT (POSITION + MOTION_SIZE)
#define FIRST_OUTPUT 22
#define TENSION 25
#define FIRST_RATE 30
#define TENSION_RATE 33
#define MIDDLE_FORCE 34
#define TENSION_DELAY 4
#define MOVES_STATES 5
#define SHOWN_TENSION 3
#define SHOWN_TENSION_RATE 3

static const double *parameters_of(const Slave *slave) { return slave->state.real + FIRST_PARAMETER; }

static int derive_start(Slave *slave, double *start_states) {
  return cable_start(parameters_of(slave), slave->start, start_states);
}

/* Motion that acts on the cable after a fraction of a step. */
static int motion_at(const Slave *slave, double step, double fraction, int at_end, double *motion) {
  const double *inputs = slave->state.real + POSITION;
  double elapsed = step * fraction;
  if (!at_end) return extrapolated_motion(inputs, &elapsed, motion);
  if (fraction == 1.0) {
    memcpy(motion, inputs, MOTION_SIZE * sizeof(double));
    return 1;
  }
  if (!interpolated_motion(slave->state.previous_inputs + POSITION, inputs, &step, &fraction, motion)) return 0;
  if (slave->has_middle_inputs && fraction == 0.5)
    memcpy(motion, slave->state.real + FIRST_MIDDLE_INPUT, 9 * sizeof(double));
  return 1;
}

static int state_rates(const Slave *slave, double step, double fraction, int at_end, const double *states,
                       double *rates) {
  double motion[MOTION_SIZE];
  const double *now = motion;
  if (fraction == 0.0)
    now = inputs_at_start(slave, at_end) + POSITION;
  else if (!motion_at(slave, step, fraction, at_end, motion))
    return 0;
  return cable_rates(now, states, parameters_of(slave), slave->start, rates);
}

static int shown_at(const Slave *slave, const double *motion, const double *states, double *shown, double *rates) {
  return cable_outputs(motion, states, parameters_of(slave), slave->start, shown, rates);
}

#if STATE_COUNT > 2
#define STEPS_BACK_INTO_DOMAIN 0
#include "dormand_prince.c"

/* States in the middle by the cubic of their inner step. */
static void interpolate_middle(double step, const Progress *before, const Progress *after, double *middle) {
  double length = (after->done - before->done) * step, fraction = (0.5 - before->done) / (after->done - before->done);
  int k;
  for (k = 0; k < STATE_COUNT; k++) {
    double first[2], last[2], values[2];
    first[0] = before->state[k];
    first[1] = before->slope[k];
    last[0] = after->state[k];
    last[1] = after->slope[k];
    cubic(first, last, &length, &fraction, values);
    middle[k] = values[0];
  }
}

static int adaptive_step(const Slave *slave, double step, int at_end, const double *start, double *middle, double *end) {
  Progress at, next;
  memcpy(middle, start, sizeof at.state);
  if (!begin_integration(slave, step, at_end, start, 1.0, &at)) return 0;
  for (; at.done < 1.0; at = next) {
    if (!inner_step(slave, step, at_end, &at, &next)) return 0;
    if (at.done < 0.5 && 0.5 <= next.done) interpolate_middle(step, &at, &next, middle);
  }
  memcpy(end, at.state, sizeof at.state);
  return 1;
}
#endif

/* States in the middle and at the end by the classical Runge-Kutta method. */
static int runge_kutta_step(const Slave *slave, double step, int at_end, const double *state, double *middle,
                            double *end) {
  double k1[STATE_COUNT], k2[STATE_COUNT], k3[STATE_COUNT], k4[STATE_COUNT], inner[STATE_COUNT];
  int k;
  if (!state_rates(slave, step, 0.0, at_end, state, k1)) return 0;
  for (k = 0; k < STATE_COUNT; k++) inner[k] = state[k] + 0.5 * step * k1[k];
  if (!state_rates(slave, step, 0.5, at_end, inner, k2)) return 0;
  for (k = 0; k < STATE_COUNT; k++) inner[k] = state[k] + 0.5 * step * k2[k];
  if (!state_rates(slave, step, 0.5, at_end, inner, k3)) return 0;
  for (k = 0; k < STATE_COUNT; k++) inner[k] = state[k] + step * k3[k];
  if (!state_rates(slave, step, 1.0, at_end, inner, k4)) return 0;
  for (k = 0; k < STATE_COUNT; k++) {
    end[k] = state[k] + step / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
    middle[k] = 0.5 * (state[k] + end[k]) + 0.125 * step * (k1[k] - k4[k]);
  }
  return 1;
}

/* States of effects that rest need no adaptive steps. */
static int integrate(Slave *slave, double step, int at_end, const double *start, double *middle, double *end) {
#if STATE_COUNT > 2
  if (slave->start[MOVES_STATES] > 0.0) return adaptive_step(slave, step, at_end, start, middle, end);
#endif
  return runge_kutta_step(slave, step, at_end, start, middle, end);
}

static int append_tension(Slave *slave, const double *times, const double *first, const double *last) {
  double segment[SEGMENT_SIZE];
  memcpy(segment, times, 2 * sizeof(double));
  memcpy(segment + 2, first, 2 * sizeof(double));
  memcpy(segment + 4, last, 2 * sizeof(double));
  return append_segment(&slave->delay_line, segment, slave->start[TENSION_DELAY]);
}

/* Appends the tension of this step to the delay line of the load cell. */
static int record_tension(Slave *slave, double step, int at_end, const double *states[3], const double *middle_motion) {
  double motion[MOTION_SIZE], shown[8], rates[4], samples[3][2], times[3];
  const double *motions[3];
  int k;
  motions[0] = inputs_at_start(slave, at_end) + POSITION;
  motions[1] = middle_motion;
  motions[2] = motion;
  if (!motion_at(slave, step, 1.0, at_end, motion)) return 0;
  for (k = 0; k < 3; k++) {
    if (!shown_at(slave, motions[k], states[k], shown, rates)) return 0;
    samples[k][0] = shown[SHOWN_TENSION];
    samples[k][1] = rates[SHOWN_TENSION_RATE];
    times[k] = slave->state.time + 0.5 * k * step;
  }
  return append_tension(slave, times, samples[0], samples[1]) && append_tension(slave, times + 1, samples[1], samples[2]);
}

static int advance(Slave *slave, double step, int at_end) {
  double *real = slave->state.real, start[STATE_COUNT], middle[STATE_COUNT], end[STATE_COUNT];
  double middle_motion[MOTION_SIZE], shown[8], rates[4];
  const double *states[3];
  memcpy(start, real + FIRST_STATE, sizeof start);
  if (!integrate(slave, step, at_end, start, middle, end)) return 0;
  if (!motion_at(slave, step, 0.5, at_end, middle_motion)) return 0;
  if (!shown_at(slave, middle_motion, middle, shown, rates)) return 0;
  states[0] = start;
  states[1] = middle;
  states[2] = end;
  if (slave->start[TENSION_DELAY] > 0.0 && !record_tension(slave, step, at_end, states, middle_motion)) return 0;
  memcpy(real + MIDDLE_FORCE, shown, 3 * sizeof(double));
  memcpy(real + MIDDLE_FORCE + 3, rates, 3 * sizeof(double));
  memcpy(real + FIRST_STATE, end, sizeof end);
  return 1;
}

static void tension_instant(const Slave *slave, double tension, double rate, double *instant) {
  instant[0] = slave->state.time;
  instant[1] = tension;
  instant[2] = rate;
}

static int refresh(Slave *slave) {
  double *real = slave->state.real, motion[MOTION_SIZE], delayed[1][2], instant[INSTANT_SIZE];
  if (!extrapolated_motion(real + POSITION, &slave->state.elapsed, motion)) return 0;
  if (!shown_at(slave, motion, real + FIRST_STATE, real + FIRST_OUTPUT, real + FIRST_RATE)) return 0;
  if (!slave->state.started) {
    memcpy(real + MIDDLE_FORCE, real + FIRST_OUTPUT, 3 * sizeof(double));
    memcpy(real + MIDDLE_FORCE + 3, real + FIRST_RATE, 3 * sizeof(double));
  }
  tension_instant(slave, real[TENSION], real[TENSION_RATE], instant);
  if (shown_late(slave, instant, slave->start[TENSION_DELAY], delayed)) {
    real[TENSION] = delayed[0][0];
    real[TENSION_RATE] = delayed[0][1];
  }
  return 1;
}

/* The load cell follows the change of the tension in so far as it lags no more. */
static void change_late(const Slave *slave, double time, double *change) {
  double instant[INSTANT_SIZE], changes[1][2];
  tension_instant(slave, change[TENSION], change[TENSION_RATE], instant);
  if (!change_shown_late(slave, instant, time, slave->start[TENSION_DELAY], changes)) return;
  change[TENSION] = changes[0][0];
  change[TENSION_RATE] = changes[0][1];
}

static int differentiate(const Slave *slave, const double *seed, double *change) {
  const double *real = slave->state.real;
  double motion[MOTION_SIZE];
  if (!extrapolated_motion(real + POSITION, &slave->state.elapsed, motion)) return 0;
  if (!cable_derivative(motion, real + FIRST_STATE, parameters_of(slave), slave->start, seed + POSITION,
                        seed + FIRST_STATE, change + FIRST_OUTPUT, change + FIRST_RATE, change + VARIABLE_COUNT))
    return 0;
  if (middle_is_now(slave)) {
    memcpy(change + MIDDLE_FORCE, change + FIRST_OUTPUT, 3 * sizeof(double));
    memcpy(change + MIDDLE_FORCE + 3, change + FIRST_RATE, 3 * sizeof(double));
  }
  change_late(slave, seed[TIME_SEED], change);
  return 1;
}

#ifdef MODEL_EXCHANGE
static int rates_now(const Slave *slave, double *rates) {
  const double *real = slave->state.real;
  double motion[MOTION_SIZE];
  return extrapolated_motion(real + POSITION, &slave->state.elapsed, motion) &&
         cable_rates(motion, real + FIRST_STATE, parameters_of(slave), slave->start, rates);
}

static int indicators_now(const Slave *slave, double *indicators) {
  const double *real = slave->state.real;
  double motion[MOTION_SIZE];
  return extrapolated_motion(real + POSITION, &slave->state.elapsed, motion) &&
         cable_indicators(motion, real + FIRST_STATE, parameters_of(slave), slave->start, indicators);
}

static int record_now(Slave *slave) {
  double motion[MOTION_SIZE], shown[8], rates[4], instant[INSTANT_SIZE], *real = slave->state.real;
  if (!(slave->start[TENSION_DELAY] > 0.0)) return 1;
  if (!extrapolated_motion(real + POSITION, &slave->state.elapsed, motion)) return 0;
  if (!shown_at(slave, motion, real + FIRST_STATE, shown, rates)) return 0;
  tension_instant(slave, shown[SHOWN_TENSION], rates[SHOWN_TENSION_RATE], instant);
  return record_instant(slave, instant, slave->start[TENSION_DELAY]);
}
#endif
