/* Partial derivatives of outputs with respect to inputs at the present instant, with the states held; in model exchange
   also of the states' rates and with respect to states and the time. */

static int is_state(unsigned int reference) { return reference >= FIRST_STATE && reference < FIRST_STATE + STATE_COUNT; }

static int is_time(const Slave *slave, unsigned int reference) {
  return slave->has_time_variable && reference == TIME_REFERENCE;
}

static int has_derivative(const Slave *slave, unsigned int reference) {
  if (reference < VARIABLE_COUNT) return is_output[reference];
  return slave->is_model_exchange && reference < VARIABLE_COUNT + STATE_COUNT;
}

static int may_change(const Slave *slave, unsigned int reference) {
  return reference < INPUT_COUNT || (slave->is_model_exchange && (is_state(reference) || is_time(slave, reference)));
}

static int refuse_derivative(const Slave *slave, unsigned int reference, const char *wanted, const char *in_exchange) {
  static const char *const given[] = {"outputs with respect to inputs",
                                      "outputs and rates of states with respect to inputs and states"};
  char message[300];
  const char *name = is_time(slave, reference) ? "time" : NULL;
  if (!name && reference >= REFERENCE_COUNT) return are_known(slave, &reference, 1), STATUS_ERROR;
  if (!name) name = variable_names[reference];
  snprintf(message, sizeof message, "%s is no %s%s: derivatives are those of %s", name, wanted,
           slave->is_model_exchange ? in_exchange : "", given[slave->is_model_exchange]);
  log_message(slave, STATUS_ERROR, message);
  return STATUS_ERROR;
}

static int check_derivative(const Slave *slave, const unsigned int *unknowns, size_t unknown_count,
                            const unsigned int *knowns, size_t known_count) {
  size_t k;
  if (slave->phase == INSTANTIATED) {
    log_message(slave, STATUS_ERROR, "derivatives in the state instantiated: allowed from initialization on");
    return STATUS_ERROR;
  }
  for (k = 0; k < unknown_count; k++)
    if (!has_derivative(slave, unknowns[k])) return refuse_derivative(slave, unknowns[k], "output", " and no rate of a state");
  for (k = 0; k < known_count; k++)
    if (!may_change(slave, knowns[k])) return refuse_derivative(slave, knowns[k], "input", " and no state");
  return STATUS_OK;
}

/* How all variables change along a change of inputs, states and the time; NaN where the law has no value or no derivative. */
static int change_along(const Slave *slave, const double *seed, double *change) {
  int k;
  memset(change, 0, CHANGE_SIZE * sizeof(double));
  if (slave->parameters_valid && differentiate(slave, seed, change)) return STATUS_OK;
  for (k = 0; k < CHANGE_SIZE; k++) change[k] = NAN;
  log_with_inputs(slave, STATUS_WARNING, "no derivatives: the law has none");
  return STATUS_WARNING;
}

static size_t seed_place(unsigned int known) { return known == TIME_REFERENCE ? TIME_SEED : known; }

/* Product of the Jacobian and a seed, one number for each known. */
static int get_directional_derivative(const Slave *slave, const unsigned int *unknowns, size_t unknown_count,
                                      const unsigned int *knowns, size_t known_count, const double *seed,
                                      double *sensitivity) {
  double along[SEED_SIZE] = {0.0}, change[CHANGE_SIZE];
  size_t k;
  int status = check_derivative(slave, unknowns, unknown_count, knowns, known_count);
  if (status != STATUS_OK) return status;
  for (k = 0; k < known_count; k++) along[seed_place(knowns[k])] += seed[k];
  status = change_along(slave, along, change);
  for (k = 0; k < unknown_count; k++) sensitivity[k] = change[unknowns[k]];
  return status;
}

/* Product of the transposed Jacobian, whose columns are computed one by one, and a seed for each unknown. */
static int get_adjoint_derivative(const Slave *slave, const unsigned int *unknowns, size_t unknown_count,
                                  const unsigned int *knowns, size_t known_count, const double *seed,
                                  double *sensitivity) {
  double along[SEED_SIZE] = {0.0}, change[CHANGE_SIZE];
  size_t k, j;
  int status = check_derivative(slave, unknowns, unknown_count, knowns, known_count);
  for (k = 0; k < known_count && status != STATUS_ERROR; k++) {
    along[seed_place(knowns[k])] = 1.0;
    /* Where the law has no value all is NaN, which is told once. */
    if (status == STATUS_OK) status = change_along(slave, along, change);
    along[seed_place(knowns[k])] = sensitivity[k] = 0.0;
    for (j = 0; j < unknown_count; j++)
      if (seed[j] != 0.0) sensitivity[k] += seed[j] * change[unknowns[j]];
  }
  return status;
}
