/* Sampled-data controller on a path, as sampled_control.py has it; the plan lies in model_constants.

   A measurement is a pose of POSE_SIZE numbers, the position and with seven a quaternion, then the tensions. */

#define MEASURED (POSE_SIZE + CABLES)
#define FREEDOMS (POSE_SIZE == 7 ? 6 : 3)
#define DEVIATIONS (FREEDOMS + CABLES)
#define SEEN (DEVIATIONS + CABLES)
#define GAIN_A 0
#define GAIN_B (GAIN_A + ORDER * ORDER)
#define GAIN_C (GAIN_B + ORDER * SEEN)
#define GAIN_D (GAIN_C + CABLES * ORDER)
#define GAIN_M (GAIN_D + CABLES * CABLES)
#define GAIN_COUNT (GAIN_M + ORDER * CABLES)
#define MIN_TENSION_SCALE 0.5
#define MAX_TENSION_SCALE 2.0
#define TWICE_TENSION_DAMPING_RATIO 1.4

/* Numbers of the plan in the order of model_constants. */
enum { PLAN_PERIOD, YIELD_TIME, TARES, KNOT_COUNT, SPEED_COUNT, STRETCH_COUNT, EXPECTED_COUNT, AT_REST };
#define COMPLIANCES (AT_REST + CABLES)
#define PLAN_KNOTS (COMPLIANCES + CABLES)

typedef struct {
  double sample, phase, state[ORDER + 1];
  double begin[CABLES], end[CABLES], tensions[CABLES], earlier[CABLES], scales[CABLES], measured[MEASURED];
} Controller;

typedef struct {
  double speed, acceleration, lowest_tension, highest_tension;
} Limits;

/* Gains at a sample: those of two knots and the weight of the second. */
typedef struct {
  const double *first, *second;
  double weight;
} Gains;

static double clamp(double value, double lower, double upper) { return fmin(fmax(value, lower), upper); }

static const double *first_gains(void) { return model_constants + PLAN_KNOTS + (int)model_constants[KNOT_COUNT]; }

static const double *first_speeds(void) { return first_gains() + (int)model_constants[KNOT_COUNT] * GAIN_COUNT; }

static const double *first_stretches(void) { return first_speeds() + (int)model_constants[SPEED_COUNT] * CABLES; }

static const double *first_expected(void) { return first_stretches() + (int)model_constants[STRETCH_COUNT] * CABLES; }

/* Row of a sample; the path rests at its last one. */
static const double *row_or_last(const double *rows, int count, int width, double sample) {
  return rows + width * (int)fmin(sample, count - 1);
}

static const double *expected_row(double sample) {
  return row_or_last(first_expected(), (int)model_constants[EXPECTED_COUNT], MEASURED, sample);
}

static void feedforward_speeds(const double *scales, double sample, double *speeds) {
  const double *plain = row_or_last(first_speeds(), (int)model_constants[SPEED_COUNT], CABLES, sample);
  const double *stretches = row_or_last(first_stretches(), (int)model_constants[STRETCH_COUNT], CABLES, sample);
  int k;
  for (k = 0; k < CABLES; k++) speeds[k] = plain[k] + scales[k] * stretches[k];
}

static Gains gains_at(double sample) {
  const double *knots = model_constants + PLAN_KNOTS;
  int count = (int)model_constants[KNOT_COUNT], next = 0, first;
  Gains gains;
  while (next < count && knots[next] <= sample) next++;
  first = next == 0 ? 0 : next - 1;
  gains.first = first_gains() + GAIN_COUNT * first;
  gains.second = next == 0 || next == count ? gains.first : gains.first + GAIN_COUNT;
  gains.weight = gains.first == gains.second ? 0.0 : (sample - knots[first]) / (knots[next] - knots[first]);
  return gains;
}

/* Adds the product of an interpolated matrix, which begins at `offset`, and a vector. */
static void add_product(const Gains *gains, int offset, int rows, int columns, const double *vector, double *result) {
  int row, column;
  for (row = 0; row < rows; row++) {
    double sum = 0.0;
    for (column = 0; column < columns; column++) {
      int entry = offset + columns * row + column;
      sum += (gains->first[entry] + gains->weight * (gains->second[entry] - gains->first[entry])) * vector[column];
    }
    result[row] += sum;
  }
}

static void demanded_accelerations(const Gains *gains, const double *state, const double *deviations, double *result) {
  memset(result, 0, CABLES * sizeof(double));
  add_product(gains, GAIN_C, CABLES, ORDER, state, result);
  add_product(gains, GAIN_D, CABLES, CABLES, deviations, result);
}

static void speed_deviations(const double *speeds, const double *scales, double sample, double *deviations) {
  int k;
  feedforward_speeds(scales, sample, deviations);
  for (k = 0; k < CABLES; k++) deviations[k] = speeds[k] - deviations[k];
}

/* Sets the winch speeds at the end of the sample that the gains demand, within the limits. */
static void limit_end_speeds(const Limits *limits, Controller *controller) {
  double period = model_constants[PLAN_PERIOD], yield_time = model_constants[YIELD_TIME];
  double forward[CABLES], deviations[CABLES], demanded[CABLES], change = period * limits->acceleration;
  Gains gains = gains_at(controller->sample);
  int k;
  feedforward_speeds(controller->scales, controller->sample + 1.0, forward);
  speed_deviations(controller->begin, controller->scales, controller->sample, deviations);
  demanded_accelerations(&gains, controller->state, deviations, demanded);
  for (k = 0; k < CABLES; k++) {
    double tension = controller->tensions[k], compliance = model_constants[COMPLIANCES + k] / yield_time;
    double damped = TWICE_TENSION_DAMPING_RATIO * (tension - controller->earlier[k]) / period;
    double lower = compliance * ((limits->lowest_tension - tension) / yield_time - damped);
    double upper = compliance * ((limits->highest_tension - tension) / yield_time - damped);
    double speed = forward[k] + deviations[k] + period * clamp(demanded[k], lower, upper);
    speed = clamp(speed, controller->begin[k] - change, controller->begin[k] + change);
    controller->end[k] = clamp(speed, -limits->speed, limits->speed);
  }
}

#if POSE_SIZE == 7
/* Rotation vector, of at most half a turn, of the quaternion q times the inverse of r, whatever the signs of both. */
static void rotation_between(const double *q, const double *r, double *vector) {
  double w = q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3], sine, factor;
  int k;
  vector[0] = r[0] * q[1] - q[0] * r[1] - (q[2] * r[3] - q[3] * r[2]);
  vector[1] = r[0] * q[2] - q[0] * r[2] - (q[3] * r[1] - q[1] * r[3]);
  vector[2] = r[0] * q[3] - q[0] * r[3] - (q[1] * r[2] - q[2] * r[1]);
  sine = sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
  factor = sine > 1e-8 * fabs(w) ? 2.0 * atan2(sine, fabs(w)) / sine : 2.0 / fabs(w);
  for (k = 0; k < 3; k++) vector[k] *= w > 0.0 ? factor : -factor;
}
#endif

static void begin_path(const Limits *limits, Controller *controller) {
  int k;
  memset(controller, 0, sizeof *controller);
  for (k = 0; k < CABLES; k++) controller->scales[k] = 1.0;
  feedforward_speeds(controller->scales, 0.0, controller->begin);
  for (k = 0; k < CABLES; k++) {
    controller->begin[k] = clamp(controller->begin[k], -limits->speed, limits->speed);
    controller->tensions[k] = controller->earlier[k] = expected_row(0.0)[POSE_SIZE + k];
  }
  limit_end_speeds(limits, controller);
}

/* The next sample, from the measurements at the start of this one. */
static void next_sample(const Limits *limits, Controller *controller) {
  double deviations[CABLES], next_deviations[CABLES], errors[CABLES], seen[SEEN], state[ORDER + 1] = {0.0};
  double sample = controller->sample;
  const double *expected = expected_row(sample);
  Gains gains = gains_at(sample);
  int k;
  if (model_constants[TARES] > 0.0 && sample == 0.0)
    for (k = 0; k < CABLES; k++) {
      double at_rest = model_constants[AT_REST + k];
      double scale = at_rest > 0.0 ? controller->measured[POSE_SIZE + k] / at_rest : 1.0;
      controller->scales[k] = clamp(scale, MIN_TENSION_SCALE, MAX_TENSION_SCALE);
    }
  speed_deviations(controller->begin, controller->scales, sample, deviations);
  speed_deviations(controller->end, controller->scales, sample + 1.0, next_deviations);
  demanded_accelerations(&gains, controller->state, deviations, errors);
  for (k = 0; k < CABLES; k++) errors[k] = (next_deviations[k] - deviations[k]) / model_constants[PLAN_PERIOD] - errors[k];
  for (k = 0; k < 3; k++) seen[k] = controller->measured[k] - expected[k];
#if POSE_SIZE == 7
  rotation_between(controller->measured + 3, expected + 3, seen + 3);
#endif
  for (k = 0; k < CABLES; k++) {
    double expected_tension = controller->scales[k] * expected[POSE_SIZE + k];
    seen[FREEDOMS + k] = controller->measured[POSE_SIZE + k] - expected_tension;
    seen[DEVIATIONS + k] = deviations[k];
  }
  add_product(&gains, GAIN_A, ORDER, ORDER, controller->state, state);
  add_product(&gains, GAIN_B, ORDER, SEEN, seen, state);
  add_product(&gains, GAIN_M, ORDER, CABLES, errors, state);
  memcpy(controller->state, state, sizeof state);
  memcpy(controller->begin, controller->end, sizeof controller->begin);
  /* At the first sample there is no rate: the stored tensions were only expected. */
  memcpy(controller->earlier, sample > 0.0 ? controller->tensions : controller->measured + POSE_SIZE, sizeof controller->earlier);
  memcpy(controller->tensions, controller->measured + POSE_SIZE, sizeof controller->tensions);
  controller->sample = sample + 1.0;
  limit_end_speeds(limits, controller);
}
