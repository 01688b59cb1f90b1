/* What platforms of all kinds share: forces, the motion of the mass, and the position sensor. */

#define MASS_SIZE 6
#define MAX_SWEEPS 8
#define POSITION_TOLERANCE 1e-15
#define POSITION_GAIN 0
#define POSITION_OFFSET 1
#define POSITION_DELAY 4
#define FIRST_MIDDLE_FORCE (FIRST_FORCE + 6 * FORCE_COUNT)
#define EXTERNAL_FORCE (FIRST_MIDDLE_FORCE - 6)

/* Forces with their rates: in all, or at the start, in the middle where it is known, and at the end. */
typedef struct {
  int count;
  double forces[3][6];
} StepForces;

/* Motion of the mass over a step: each nine numbers, position, velocity and acceleration. */
typedef struct {
  double start_acceleration[3];
  double middle[9];
  double end[9];
} Translation;

static const double *parameters_of(const Slave *slave) { return slave->state.real + FIRST_PARAMETER; }

static void sum_forces(const double *inputs, int first, int count, double *force) {
  int k, j;
  for (k = 0; k < 6; k++) {
    force[k] = 0.0;
    for (j = 0; j < count; j++) force[k] += inputs[first + 6 * j + k];
  }
}

/* A vector input with its rate in the middle of a step, by the cubic through those at both ends. */
static void middle_of_inputs(const Slave *slave, int reference, double step, double *vector) {
  const double *before = slave->state.previous_inputs + reference, *after = slave->state.real + reference;
  double first[2], last[2], values[2], fraction = 0.5;
  int k;
  for (k = 0; k < 3; k++) {
    first[0] = before[k];
    first[1] = before[k + 3];
    last[0] = after[k];
    last[1] = after[k + 3];
    cubic(first, last, &step, &fraction, values);
    vector[k] = values[0];
    vector[k + 3] = values[1];
  }
}

static void extrapolate_vector(const double *vector, double elapsed, double *later) {
  int k;
  for (k = 0; k < 3; k++) {
    later[k] = vector[k] + elapsed * vector[k + 3];
    later[k + 3] = vector[k + 3];
  }
}

static void step_forces(const Slave *slave, double step, int at_end, StepForces *all) {
  double external[6];
  int k;
  sum_forces(inputs_at_start(slave, at_end), FIRST_FORCE, FORCE_COUNT, all->forces[0]);
  all->count = 2;
  if (!at_end) {
    extrapolate_vector(all->forces[0], step, all->forces[1]);
    return;
  }
  if (slave->has_middle_inputs) {
    all->count = 3;
    sum_forces(slave->state.real, FIRST_MIDDLE_FORCE, FORCE_COUNT - 1, all->forces[1]);
    middle_of_inputs(slave, EXTERNAL_FORCE, step, external);
    for (k = 0; k < 6; k++) all->forces[1][k] += external[k];
  }
  sum_forces(slave->state.real, FIRST_FORCE, FORCE_COUNT, all->forces[all->count - 1]);
}

static double platform_time(const Slave *slave) {
#ifdef TIME_INDEX
  return slave->state.real[TIME_INDEX];
#else
  (void)slave;
  return 0.0;
#endif
}

static int node_at(const Slave *slave, const double *mass, const double *force, double time, double *node) {
  return platform_node(mass, force, &time, parameters_of(slave), node);
}

/* Hermite quadrature of the acceleration over one step, as platform_slave.py does it. */
static int translate(Slave *slave, const double *start, double step, int at_end, Translation *result) {
  double nodes[18], previous[3], time = platform_time(slave);
  StepForces all;
  int sweep, k, converged;
  step_forces(slave, step, at_end, &all);
  for (k = 0; k < all.count; k++)
    if (!node_at(slave, start, all.forces[k], time + step * k / (all.count - 1), nodes + 6 * k)) return 0;
  for (sweep = 0;; sweep++) {
    if (!(all.count == 2 ? two_node_quadrature : three_node_quadrature)(start, nodes, &step, result->middle, result->end))
      return 0;
    converged = sweep > 0;
    for (k = 0; k < 3 && converged; k++)
      converged = fabs(result->end[k] - previous[k]) <= POSITION_TOLERANCE * fabs(result->end[k]);
    if (converged || sweep == (HAS_MOTION_DEPENDENT_FORCE ? MAX_SWEEPS : 0)) break;
    memcpy(previous, result->end, sizeof previous);
    for (k = 0; k < all.count; k++) {
      const double *mass = k == 0 ? start : k == all.count - 1 ? result->end : result->middle;
      if (!node_at(slave, mass, all.forces[k], time + step * k / (all.count - 1), nodes + 6 * k)) return 0;
    }
  }
  memcpy(result->start_acceleration, nodes, sizeof result->start_acceleration);
#ifdef TIME_INDEX
  slave->state.real[TIME_INDEX] = time + step;
#endif
  return 1;
}

static void present_force(const Slave *slave, double *now) {
  double force[6];
  sum_forces(slave->state.real, FIRST_FORCE, FORCE_COUNT, force);
  extrapolate_vector(force, slave->state.elapsed, now);
}

/* Acceleration of the mass under the present forces. */
static int present_acceleration(const Slave *slave, const double *mass, double *acceleration) {
  double now[6], node[6];
  present_force(slave, now);
  if (!node_at(slave, mass, now, platform_time(slave), node)) return 0;
  memcpy(acceleration, node, 3 * sizeof(double));
  return 1;
}

#ifdef MODEL_EXCHANGE
static int present_kinks(const Slave *slave, const double *mass, double *indicators) {
  double now[6], time = platform_time(slave);
  present_force(slave, now);
  return platform_indicators(mass, now, &time, parameters_of(slave), indicators);
}
#endif

/* Change of that acceleration along a change of the inputs, the time and the motion of the mass. */
static int differentiate_acceleration(const Slave *slave, const double *mass, const double *seed,
                                      const double *mass_seed, double *change) {
  double now[6], force_seed[6], time = platform_time(slave);
  present_force(slave, now);
  sum_forces(seed, FIRST_FORCE, FORCE_COUNT, force_seed);
  return platform_derivative(mass, now, &time, parameters_of(slave), mass_seed, force_seed, seed + TIME_SEED, change);
}

/* Appends the path of this step to the delay line of the position sensor; each end has nine numbers. */
static int record_path(Slave *slave, double step, const double *first, const double *last) {
  double segment[SEGMENT_SIZE];
  int axis, k;
  if (!(slave->start[POSITION_DELAY] > 0.0)) return 1;
  segment[0] = slave->state.time;
  segment[1] = slave->state.time + step;
  for (axis = 0; axis < 3; axis++)
    for (k = 0; k < 3; k++) {
      segment[2 + 3 * axis + k] = first[3 * k + axis];
      segment[11 + 3 * axis + k] = last[3 * k + axis];
    }
  return append_segment(&slave->delay_line, segment, slave->start[POSITION_DELAY]);
}

/* A motion is position, velocity and acceleration. */
static void motion_instant(const Slave *slave, const double *motion, double *instant) {
  int axis, k;
  instant[0] = slave->state.time;
  for (axis = 0; axis < 3; axis++)
    for (k = 0; k < 3; k++) instant[1 + 3 * axis + k] = motion[3 * k + axis];
}

#ifdef MODEL_EXCHANGE
static int record_motion(Slave *slave, const double *motion) {
  double instant[INSTANT_SIZE];
  motion_instant(slave, motion, instant);
  return record_instant(slave, instant, slave->start[POSITION_DELAY]);
}
#endif

/* Sets the measured position, which sensors make differ from the true one, by the motion of now. */
static void refresh_measured_position(Slave *slave, const double *motion) {
#ifdef MEASURED_POSITION
  double delayed[3][2], instant[INSTANT_SIZE], *real = slave->state.real;
  int is_late, axis;
  motion_instant(slave, motion, instant);
  is_late = shown_late(slave, instant, slave->start[POSITION_DELAY], delayed);
  for (axis = 0; axis < 3; axis++)
    real[MEASURED_POSITION + axis] = slave->start[POSITION_GAIN] * (is_late ? delayed[axis][0] : motion[axis]) +
                                     slave->start[POSITION_OFFSET + axis];
#else
  (void)slave, (void)motion;
#endif
}

/* Change of the measured position along a change of the motion of now and of the time. */
static void change_measured_position(const Slave *slave, const double *motion, double time, double *change) {
#ifdef MEASURED_POSITION
  double changes[3][2], instant[INSTANT_SIZE];
  int is_late, axis;
  motion_instant(slave, motion, instant);
  is_late = change_shown_late(slave, instant, time, slave->start[POSITION_DELAY], changes);
  for (axis = 0; axis < 3; axis++)
    change[MEASURED_POSITION + axis] = slave->start[POSITION_GAIN] * (is_late ? changes[axis][0] : motion[axis]);
#else
  (void)slave, (void)motion, (void)time, (void)change;
#endif
}
