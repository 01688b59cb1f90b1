/* The platform as a rigid body: cable forces in, motion of its frame and of each attachment out. */

#define EXTERNAL_MOMENT 2
#define INERTIA 9
#define MASS_STATE (FIRST_STATE + 4)
#define MOMENTUM_STATE (FIRST_STATE + 10)
#define ARMS 5
#define ATTITUDE_SIZE 15
#define LOAD_SIZE 24
#define POINT_SIZE 9
#define POINTS_SIZE (POINT_SIZE * (1 + CABLE_COUNT) + 6)
#define MAX_ROTATION_SWEEPS 40
#define ANGLE_TOLERANCE 1e-16

/* Loads at the start, in the middle where it is known, and at the end of a step. */
typedef struct {
  int count;
  double loads[3 * LOAD_SIZE];
} StepLoads;

typedef struct {
  double first[ATTITUDE_SIZE];
  double middle[ATTITUDE_SIZE];
  double end[ATTITUDE_SIZE];
  double quaternion[4];
  double momentum[3];
} Rotation;

static int derive_start(Slave *slave, double *start_states) {
  double axes[9];
  principal_axes(parameters_of(slave) + INERTIA, axes);
  return body_start(parameters_of(slave), axes, model_constants, slave->start, start_states);
}

/* Rows are the sums of each force component times the arms; the external force, the last one, acts at the origin. */
static void moment_matrix(const Slave *slave, const double *forces, int stride, double *matrix) {
  const double *arms = slave->start + ARMS;
  int force, row, column;
  memset(matrix, 0, 9 * sizeof(double));
  for (force = 0; force < FORCE_COUNT; force++) {
    const double *arm = force == FORCE_COUNT - 1 ? arms : arms + 3 * (force + 1);
    for (row = 0; row < 3; row++)
      for (column = 0; column < 3; column++) matrix[3 * row + column] += arm[column] * forces[stride * force + row];
  }
}

static void load_of(const Slave *slave, const double *inputs, double *load) {
  moment_matrix(slave, inputs + FIRST_FORCE, 6, load);
  moment_matrix(slave, inputs + FIRST_FORCE + 3, 6, load + 9);
  memcpy(load + 18, inputs + EXTERNAL_MOMENT, 6 * sizeof(double));
}

/* Load in the middle: cable forces as set, external force and moment interpolated. */
static void middle_load(const Slave *slave, double step, double *load) {
  double forces[6 * FORCE_COUNT];
  memcpy(forces, slave->state.real + FIRST_MIDDLE_FORCE, 6 * CABLE_COUNT * sizeof(double));
  middle_of_inputs(slave, EXTERNAL_FORCE, step, forces + 6 * CABLE_COUNT);
  moment_matrix(slave, forces, 6, load);
  moment_matrix(slave, forces + 3, 6, load + 9);
  middle_of_inputs(slave, EXTERNAL_MOMENT, step, load + 18);
}

static void extrapolate_load(const double *load, double elapsed, double *later) {
  int k;
  memcpy(later, load, LOAD_SIZE * sizeof(double));
  for (k = 0; k < 9; k++) later[k] += elapsed * load[9 + k];
  for (k = 18; k < 21; k++) later[k] += elapsed * load[k + 3];
}

static void step_loads(const Slave *slave, double step, int at_end, StepLoads *all) {
  all->count = 2;
  load_of(slave, inputs_at_start(slave, at_end), all->loads);
  if (!at_end) {
    extrapolate_load(all->loads, step, all->loads + LOAD_SIZE);
    return;
  }
  if (slave->has_middle_inputs) middle_load(slave, step, all->loads + LOAD_SIZE * (all->count++ - 1));
  load_of(slave, slave->state.real, all->loads + LOAD_SIZE * (all->count - 1));
}

static double largest_change(const double *angles, const double *previous) {
  double change = 0.0;
  int k;
  for (k = 0; k < 6; k++) change = fmax(change, fabs(angles[k] - previous[k]));
  return change;
}

/* Attitudes, angles and momenta from which the sweeps over a step begin. */
static void begin_sweeps(const double *first, double step, double *attitudes, double *angles) {
  int k;
  for (k = 0; k < 3; k++) {
    angles[k] = 0.5 * step * first[9 + k] + 0.125 * step * step * first[12 + k];
    angles[3 + k] = step * first[9 + k] + 0.5 * step * step * first[12 + k];
  }
  memcpy(attitudes, first, ATTITUDE_SIZE * sizeof(double));
  for (k = 0; k < 3; k++) attitudes[9 + k] += 0.5 * step * first[12 + k];
  memcpy(attitudes + ATTITUDE_SIZE, attitudes, ATTITUDE_SIZE * sizeof(double));
}

/* Rotation over a step by fixed-point sweeps, as rotation_quadrature.py does it; 0 where they do not converge. */
static int rotate_body(const Slave *slave, const StepLoads *all, double step, Rotation *result) {
  const double *real = slave->state.real, *quaternion = real + FIRST_STATE, *momentum = real + MOMENTUM_STATE;
  const double *later = all->loads + LOAD_SIZE, *values = parameters_of(slave), *start = slave->start;
  double moments[18], attitudes[2 * ATTITUDE_SIZE], momenta[6], angles[6], new_angles[6], new_attitudes[2 * ATTITUDE_SIZE];
  double change = ANGLE_TOLERANCE, previous_change;
  int sweep, is_long = all->count == 3;
  if (!body_attitude(quaternion, momentum, all->loads, values, start, result->first)) return 0;
  if (!body_moment(result->first, all->loads, values, start, moments)) return 0;
  begin_sweeps(result->first, step, attitudes, angles);
  for (sweep = 0;; sweep++) {
    if (sweep == MAX_ROTATION_SWEEPS) return 0;
    if (!(is_long ? three_node_sweep : two_node_sweep)(quaternion, momentum, result->first, moments, angles, attitudes,
                                                       later, &step, values, start, new_attitudes, moments + 6, momenta,
                                                       new_angles))
      return 0;
    previous_change = change;
    change = largest_change(new_angles, angles);
    memcpy(attitudes, new_attitudes, (is_long ? 2 : 1) * ATTITUDE_SIZE * sizeof(double));
    memcpy(angles, new_angles, sizeof angles);
    if (change * fmin(1.0, change / previous_change) <= ANGLE_TOLERANCE) break;
  }
  memcpy(result->momentum, momenta + 3, sizeof result->momentum);
  return (is_long ? three_node_rotation : two_node_rotation)(quaternion, momenta, angles, moments, later, &step, values,
                                                             start, result->quaternion, result->middle, result->end);
}

static int advance(Slave *slave, double step, int at_end) {
  double *real = slave->state.real, mass[9], before[POINTS_SIZE], middle[POINTS_SIZE], after[POINTS_SIZE];
  StepLoads all;
  Rotation rotation;
  Translation translation;
  step_loads(slave, step, at_end, &all);
  if (!rotate_body(slave, &all, step, &rotation)) return 0;
  memcpy(mass, real + MASS_STATE, MASS_SIZE * sizeof(double));
  if (!translate(slave, mass, step, at_end, &translation)) return 0;
  memcpy(mass + 6, translation.start_acceleration, 3 * sizeof(double));
  if (!body_points(rotation.first, mass, slave->start, before)) return 0;
  if (!body_points(rotation.middle, translation.middle, slave->start, middle)) return 0;
  if (!body_points(rotation.end, translation.end, slave->start, after)) return 0;
  if (!record_path(slave, step, before, after)) return 0;
  memcpy(real + FIRST_STATE, rotation.quaternion, sizeof rotation.quaternion);
  memcpy(real + MASS_STATE, translation.end, MASS_SIZE * sizeof(double));
  memcpy(real + MOMENTUM_STATE, rotation.momentum, sizeof rotation.momentum);
  memcpy(real + MIDDLE_OUTPUT, middle + POINT_SIZE, POINT_SIZE * CABLE_COUNT * sizeof(double));
  return 1;
}

/* The quaternion with length one, which the integrator of an importer in model exchange does not keep exactly. */
static void present_quaternion(const Slave *slave, double *quaternion) {
  double squared = 0.0;
  int k;
  memcpy(quaternion, slave->state.real + FIRST_STATE, 4 * sizeof(double));
  if (!slave->is_model_exchange) return;
  for (k = 0; k < 4; k++) squared += quaternion[k] * quaternion[k];
  for (k = 0; k < 4; k++) quaternion[k] /= sqrt(squared);
}

/* Load and attitude at the present instant. */
static int present_attitude(const Slave *slave, double *now, double *attitude) {
  const double *real = slave->state.real;
  double load[LOAD_SIZE], quaternion[4];
  load_of(slave, real, load);
  extrapolate_load(load, slave->state.elapsed, now);
  present_quaternion(slave, quaternion);
  return body_attitude(quaternion, real + MOMENTUM_STATE, now, parameters_of(slave), slave->start, attitude);
}

static int refresh(Slave *slave) {
  double *real = slave->state.real, now[LOAD_SIZE], attitude[ATTITUDE_SIZE], mass[9];
  if (!present_attitude(slave, now, attitude)) return 0;
  memcpy(mass, real + MASS_STATE, MASS_SIZE * sizeof(double));
  if (!present_acceleration(slave, mass, mass + 6)) return 0;
  if (!body_points(attitude, mass, slave->start, real + FIRST_OUTPUT)) return 0;
  if (!slave->state.started)
    memcpy(real + MIDDLE_OUTPUT, real + FIRST_ATTACHMENT_OUTPUT, POINT_SIZE * CABLE_COUNT * sizeof(double));
  refresh_measured_position(slave, real + FIRST_OUTPUT);
  return 1;
}

/* Change of the normalised quaternion; in co-simulation that of the state is held. */
static void change_quaternion(const Slave *slave, const double *seed, double *change) {
  const double *quaternion = slave->state.real + FIRST_STATE;
  double squared = 0.0, along = 0.0;
  int k;
  for (k = 0; k < 4; k++) squared += quaternion[k] * quaternion[k];
  for (k = 0; k < 4; k++) along += quaternion[k] * seed[FIRST_STATE + k];
  for (k = 0; k < 4; k++) change[k] = (seed[FIRST_STATE + k] - quaternion[k] * along / squared) / sqrt(squared);
}

/* Attitude, and the changes of attitude, motion of the mass and moment about it. */
typedef struct {
  double attitude[ATTITUDE_SIZE], attitude_change[ATTITUDE_SIZE], mass_change[9], moment_change[3];
} Response;

/* The change of the points beside; these are linear in the motion of the mass, whose acceleration does not count. */
static int respond(const Slave *slave, const double *seed, Response *response, double *points) {
  const double *real = slave->state.real, *values = parameters_of(slave), *momentum = real + MOMENTUM_STATE;
  double load[LOAD_SIZE], load_seed[LOAD_SIZE], mass[9] = {0.0}, quaternion[4], quaternion_seed[4];
  double *mass_change = response->mass_change;
  if (!present_attitude(slave, load, response->attitude)) return 0;
  load_of(slave, seed, load_seed);
  memcpy(mass, real + MASS_STATE, MASS_SIZE * sizeof(double));
  memcpy(mass_change, seed + MASS_STATE, MASS_SIZE * sizeof(double));
  if (!differentiate_acceleration(slave, mass, seed, mass_change, mass_change + 6)) return 0;
  present_quaternion(slave, quaternion);
  change_quaternion(slave, seed, quaternion_seed);
  return body_derivative(quaternion, momentum, load, mass, values, slave->start, quaternion_seed, seed + MOMENTUM_STATE,
                         load_seed, mass_change, response->attitude_change, response->moment_change, points);
}

static int differentiate(const Slave *slave, const double *seed, double *change) {
  double *rates = change + VARIABLE_COUNT, of_turning[4];
  Response response;
  int k;
  if (!respond(slave, seed, &response, change + FIRST_OUTPUT)) return 0;
  memcpy(change + FIRST_STATE, seed + FIRST_STATE, STATE_COUNT * sizeof(double));
  change_measured_position(slave, change + FIRST_OUTPUT, seed[TIME_SEED], change);
  if (middle_is_now(slave))
    memcpy(change + MIDDLE_OUTPUT, change + FIRST_ATTACHMENT_OUTPUT, POINT_SIZE * CABLE_COUNT * sizeof(double));
  if (!quaternion_rate(seed + FIRST_STATE, response.attitude, rates)) return 0;
  if (!quaternion_rate(slave->state.real + FIRST_STATE, response.attitude_change, of_turning)) return 0;
  for (k = 0; k < 4; k++) rates[k] += of_turning[k];
  memcpy(rates + 4, response.mass_change + 3, MASS_SIZE * sizeof(double));
  memcpy(rates + 10, response.moment_change, sizeof response.moment_change);
  return 1;
}

#ifdef MODEL_EXCHANGE
static int rates_now(const Slave *slave, double *rates) {
  const double *real = slave->state.real;
  double now[LOAD_SIZE], attitude[ATTITUDE_SIZE], moment[6];
  if (!present_attitude(slave, now, attitude)) return 0;
  if (!body_moment(attitude, now, parameters_of(slave), slave->start, moment)) return 0;
  memcpy(rates + 4, real + MASS_STATE + 3, 3 * sizeof(double));
  memcpy(rates + 10, moment, 3 * sizeof(double));
  return quaternion_rate(real + FIRST_STATE, attitude, rates) &&
         present_acceleration(slave, real + MASS_STATE, rates + 7);
}

static int indicators_now(const Slave *slave, double *indicators) {
  return present_kinks(slave, slave->state.real + MASS_STATE, indicators);
}

static int record_now(Slave *slave) {
  double now[LOAD_SIZE], attitude[ATTITUDE_SIZE], mass[9], points[POINTS_SIZE];
  if (!(slave->start[POSITION_DELAY] > 0.0)) return 1;
  memcpy(mass, slave->state.real + MASS_STATE, MASS_SIZE * sizeof(double));
  return present_attitude(slave, now, attitude) && present_acceleration(slave, mass, mass + 6) &&
         body_points(attitude, mass, slave->start, points) && record_motion(slave, points);
}
#endif
