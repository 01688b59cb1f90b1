/* Partial derivatives of outputs with respect to inputs at the present instant, with the states held. */

static int refuse_derivative(const Slave *slave, unsigned int reference, const char *wanted) {
  char message[300];
  if (reference >= REFERENCE_COUNT) return are_known(slave, &reference, 1), STATUS_ERROR;
  snprintf(message, sizeof message, "%s is no %s: derivatives are those of outputs with respect to inputs",
           variable_names[reference], wanted);
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
    if (unknowns[k] >= VARIABLE_COUNT || !is_output[unknowns[k]]) return refuse_derivative(slave, unknowns[k], "output");
  for (k = 0; k < known_count; k++)
    if (knowns[k] >= INPUT_COUNT) return refuse_derivative(slave, knowns[k], "input");
  return STATUS_OK;
}

/* How all variables change along a change of the inputs; NaN where the law has no value or no derivative. */
static int change_along(const Slave *slave, const double *seed, double *change) {
  int k;
  memset(change, 0, VARIABLE_COUNT * sizeof(double));
  if (slave->parameters_valid && differentiate(slave, seed, change)) return STATUS_OK;
  for (k = 0; k < VARIABLE_COUNT; k++) change[k] = NAN;
  log_with_inputs(slave, STATUS_WARNING, "no derivatives: the law has none");
  return STATUS_WARNING;
}

/* Product of the Jacobian and a seed, one number for each known. */
static int get_directional_derivative(const Slave *slave, const unsigned int *unknowns, size_t unknown_count,
                                      const unsigned int *knowns, size_t known_count, const double *seed,
                                      double *sensitivity) {
  double inputs[INPUT_COUNT] = {0.0}, change[VARIABLE_COUNT];
  size_t k;
  int status = check_derivative(slave, unknowns, unknown_count, knowns, known_count);
  if (status != STATUS_OK) return status;
  for (k = 0; k < known_count; k++) inputs[knowns[k]] += seed[k];
  status = change_along(slave, inputs, change);
  for (k = 0; k < unknown_count; k++) sensitivity[k] = change[unknowns[k]];
  return status;
}

/* Product of the transposed Jacobian, whose columns are computed one by one, and a seed for each unknown. */
static int get_adjoint_derivative(const Slave *slave, const unsigned int *unknowns, size_t unknown_count,
                                  const unsigned int *knowns, size_t known_count, const double *seed,
                                  double *sensitivity) {
  double inputs[INPUT_COUNT] = {0.0}, change[VARIABLE_COUNT];
  size_t k, j;
  int status = check_derivative(slave, unknowns, unknown_count, knowns, known_count);
  for (k = 0; k < known_count && status != STATUS_ERROR; k++) {
    inputs[knowns[k]] = 1.0;
    /* Where the law has no value all is NaN, which is told once. */
    if (status == STATUS_OK) status = change_along(slave, inputs, change);
    inputs[knowns[k]] = sensitivity[k] = 0.0;
    for (j = 0; j < unknown_count; j++) sensitivity[k] += seed[j] * change[unknowns[j]];
  }
  return status;
}
