/* FMI 3.0 functions, but those of model exchange. */

#include "fmi3Functions.h"

typedef struct {
  Slave slave;
  fmi3LogMessageCallback log;
  fmi3InstanceEnvironment environment;
  fmi3Boolean logging_on;
} Instance3;

static const char *const categories[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError"};

static void log_to_importer(void *owner, int status, const char *message) {
  Instance3 *instance = (Instance3 *)owner;
  if (instance->log && (instance->logging_on || status == STATUS_ERROR))
    instance->log(instance->environment, (fmi3Status)status, categories[status], message);
}

static fmi3Status refuse(fmi3Instance c, const char *message) {
  log_message(&((Instance3 *)c)->slave, STATUS_ERROR, message);
  return fmi3Error;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String names[]) {
  (void)count, (void)names;
  ((Instance3 *)c)->logging_on = on;
  return fmi3OK;
}

/* An instance of some interface; `fault` tells why there can be none. */
static fmi3Instance new_instance(fmi3String token, const char *fault, fmi3Boolean logging_on,
                                 fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, int is_model_exchange) {
  Instance3 *instance = (Instance3 *)calloc(1, sizeof *instance);
  if (!instance) return NULL;
  instance->log = log;
  instance->environment = environment;
  instance->logging_on = logging_on;
  instance->slave.log = log_to_importer;
  instance->slave.owner = instance;
  instance->slave.is_model_exchange = is_model_exchange;
  instance->slave.has_time_variable = 1;
  if (fault || !token || strcmp(token, model_guid)) {
    refuse(instance, fault ? fault : "the token is not that of this FMU");
    free(instance);
    return NULL;
  }
  reset_slave(&instance->slave);
  return instance;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  (void)name, (void)resources, (void)visible, (void)event_mode, (void)early_return, (void)intermediate, (void)update;
  return new_instance(token, count ? "this FMU has no intermediate variables" : NULL, logging_on, environment, log, 0);
}

void fmi3FreeInstance(fmi3Instance c) {
  if (!c) return;
  free_delay_line(&((Instance3 *)c)->slave.delay_line);
  free(c);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
  Slave *slave = &((Instance3 *)c)->slave;
  (void)has_stop, (void)stop;
  if (!is_allowed(slave, INSTANTIATED, "fmi3EnterInitializationMode")) return fmi3Error;
  slave->state.time = start;
  slave->phase = INITIALIZATION;
  if (has_tolerance) set_tolerance(slave, tolerance);
  return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  Slave *slave = &((Instance3 *)c)->slave;
  if (!is_allowed(slave, INITIALIZATION, "fmi3ExitInitializationMode") || check_inputs(slave) != STATUS_OK)
    return fmi3Error;
  return (fmi3Status)leave_initialization(slave);
}

fmi3Status fmi3Terminate(fmi3Instance c) {
  Slave *slave = &((Instance3 *)c)->slave;
  if (!is_running(slave) && !is_allowed(slave, STEPPING, "fmi3Terminate")) return fmi3Error;
  slave->phase = TERMINATED;
  return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c) {
  reset_slave(&((Instance3 *)c)->slave);
  return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t count, fmi3Float64 values[],
                          size_t value_count) {
  Instance3 *instance = (Instance3 *)c;
  size_t k;
  if (value_count != count) return refuse(c, "as many values as references are needed");
  for (k = 0; k < count && references[k] != TIME_REFERENCE; k++)
    ;
  if (k == count) return (fmi3Status)get_variables(&instance->slave, references, count, values);
  for (k = 0; k < count; k++) {
    values[k] = instance->slave.state.time;
    if (references[k] != TIME_REFERENCE && get_variables(&instance->slave, references + k, 1, values + k)) return fmi3Error;
  }
  return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                          const fmi3Float64 values[], size_t value_count) {
  if (value_count != count) return refuse(c, "as many values as references are needed");
  return (fmi3Status)set_variables(&((Instance3 *)c)->slave, references, count, values);
}

#define OTHER_TYPE(name)                                                                                              \
  fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference references[], size_t count, fmi3##name values[],  \
                           size_t value_count) {                                                                      \
    (void)references, (void)values, (void)value_count;                                                                \
    return count ? refuse(c, "this FMU has Float64 variables only") : fmi3OK;                                         \
  }                                                                                                                   \
  fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference references[], size_t count,                       \
                           const fmi3##name values[], size_t value_count) {                                           \
    (void)references, (void)values, (void)value_count;                                                                \
    return count ? refuse(c, "this FMU has Float64 variables only") : fmi3OK;                                         \
  }

OTHER_TYPE(Float32)
OTHER_TYPE(Int8)
OTHER_TYPE(UInt8)
OTHER_TYPE(Int16)
OTHER_TYPE(UInt16)
OTHER_TYPE(Int32)
OTHER_TYPE(UInt32)
OTHER_TYPE(Int64)
OTHER_TYPE(UInt64)
OTHER_TYPE(Boolean)
OTHER_TYPE(String)

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *saved) {
  *saved = save_state(&((Instance3 *)c)->slave, (SavedState *)*saved);
  return *saved ? fmi3OK : refuse(c, "no memory for a saved state");
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState saved) {
  if (!saved) return refuse(c, "no saved state was given");
  return (fmi3Status)restore_state(&((Instance3 *)c)->slave, (const SavedState *)saved);
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *saved) {
  (void)c;
  if (!saved) return fmi3OK;
  free_saved_state((SavedState *)*saved);
  *saved = NULL;
  return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState saved, size_t *size) {
  (void)c;
  *size = serialised_size((const SavedState *)saved);
  return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState saved, fmi3Byte bytes[], size_t size) {
  if (size < serialised_size((const SavedState *)saved)) return refuse(c, "too few bytes for a saved state");
  serialise_state((const SavedState *)saved, (char *)bytes);
  return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *saved) {
  SavedState *state = deserialise_state((const char *)bytes, size);
  if (!state) return refuse(c, "a saved state that was no state of this FMU");
  *saved = state;
  return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count) {
  size_t k;
  if (value_count != count) return refuse(c, "as many values as references are needed");
  for (k = 0; k < count; k++)
    if (get_output_derivative(&((Instance3 *)c)->slave, references[k], orders[k], values + k) != STATUS_OK)
      return fmi3Error;
  return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t unknown_count,
                                        const fmi3ValueReference knowns[], size_t known_count,
                                        const fmi3Float64 seed[], size_t seed_count, fmi3Float64 sensitivity[],
                                        size_t sensitivity_count) {
  if (seed_count != known_count || sensitivity_count != unknown_count)
    return refuse(c, "as many seeds as knowns and as many sensitivities as unknowns are needed");
  return (fmi3Status)get_directional_derivative(&((Instance3 *)c)->slave, unknowns, unknown_count, knowns, known_count,
                                                seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t unknown_count,
                                    const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
                                    size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count) {
  if (seed_count != unknown_count || sensitivity_count != known_count)
    return refuse(c, "as many seeds as unknowns and as many sensitivities as knowns are needed");
  return (fmi3Status)get_adjoint_derivative(&((Instance3 *)c)->slave, unknowns, unknown_count, knowns, known_count,
                                            seed, sensitivity);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_rollback,
                      fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_time) {
  Instance3 *instance = (Instance3 *)c;
  int status;
  (void)no_rollback;
  *event_needed = *terminate = *early_return = fmi3False;
  *last_time = time;
  if (!is_allowed(&instance->slave, STEPPING, "fmi3DoStep")) return fmi3Error;
  status = do_step(&instance->slave, time, step);
  if (status == STATUS_OK) *last_time = instance->slave.state.time;
  return (fmi3Status)status;
}

#include "fmi3_absent.c"
