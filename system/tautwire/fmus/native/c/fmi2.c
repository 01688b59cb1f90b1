/* FMI 2.0 functions, but those of model exchange. */

#include "fmi2Functions.h"

typedef struct {
  Slave slave;
  fmi2CallbackLogger logger;
  fmi2ComponentEnvironment environment;
  fmi2Boolean logging_on;
  char name[1];
} Instance;

static const char *const categories[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError"};

static void log_to_importer(void *owner, int status, const char *message) {
  Instance *instance = (Instance *)owner;
  if (instance->logger && (instance->logging_on || status == STATUS_ERROR))
    instance->logger(instance->environment, instance->name, (fmi2Status)status, categories[status], message);
}

static fmi2Status refuse(Instance *instance, const char *message) {
  log_message(&instance->slave, STATUS_ERROR, message);
  return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String names[]) {
  (void)count, (void)names;
  ((Instance *)c)->logging_on = on;
  return fmi2OK;
}

static int is_provided(fmi2Type type) {
#ifdef MODEL_EXCHANGE
  if (type == fmi2ModelExchange) return 1;
#endif
  return type == fmi2CoSimulation;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on) {
  size_t length = name ? strlen(name) : 0;
  Instance *instance;
  (void)resources, (void)visible;
  instance = (Instance *)calloc(1, sizeof *instance + length);
  if (!instance) return NULL;
  if (length) memcpy(instance->name, name, length);
  instance->logger = functions ? functions->logger : NULL;
  instance->environment = functions ? functions->componentEnvironment : NULL;
  instance->logging_on = logging_on;
  instance->slave.log = log_to_importer;
  instance->slave.owner = instance;
  instance->slave.is_model_exchange = type == fmi2ModelExchange;
  if (!is_provided(type) || !guid || strcmp(guid, model_guid)) {
    refuse(instance, is_provided(type) ? "the GUID is not that of this FMU" : "this FMU is for co-simulation only");
    free(instance);
    return NULL;
  }
  reset_slave(&instance->slave);
  return instance;
}

void fmi2FreeInstance(fmi2Component c) {
  if (!c) return;
  free_delay_line(&((Instance *)c)->slave.delay_line);
  free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  Instance *instance = (Instance *)c;
  (void)has_stop, (void)stop;
  if (!is_allowed(&instance->slave, INSTANTIATED, "fmi2SetupExperiment")) return fmi2Error;
  instance->slave.state.time = start;
  if (has_tolerance) set_tolerance(&instance->slave, tolerance);
  return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  Slave *slave = &((Instance *)c)->slave;
  if (!is_allowed(slave, INSTANTIATED, "fmi2EnterInitializationMode")) return fmi2Error;
  slave->phase = INITIALIZATION;
  return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  Slave *slave = &((Instance *)c)->slave;
  if (!is_allowed(slave, INITIALIZATION, "fmi2ExitInitializationMode") || check_inputs(slave) != STATUS_OK)
    return fmi2Error;
  return (fmi2Status)leave_initialization(slave);
}

fmi2Status fmi2Terminate(fmi2Component c) {
  Slave *slave = &((Instance *)c)->slave;
  if (!is_running(slave) && !is_allowed(slave, STEPPING, "fmi2Terminate")) return fmi2Error;
  slave->phase = TERMINATED;
  return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
  reset_slave(&((Instance *)c)->slave);
  return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Real values[]) {
  return (fmi2Status)get_variables(&((Instance *)c)->slave, references, count, values);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Real values[]) {
  return (fmi2Status)set_variables(&((Instance *)c)->slave, references, count, values);
}

static fmi2Status refuse_type(fmi2Component c, size_t count) {
  return count ? refuse((Instance *)c, "this FMU has real variables only") : fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Integer values[]) {
  (void)references, (void)values;
  return refuse_type(c, count);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Boolean values[]) {
  (void)references, (void)values;
  return refuse_type(c, count);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2String values[]) {
  (void)references, (void)values;
  return refuse_type(c, count);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference references[], size_t count,
                          const fmi2Integer values[]) {
  (void)references, (void)values;
  return refuse_type(c, count);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference references[], size_t count,
                          const fmi2Boolean values[]) {
  (void)references, (void)values;
  return refuse_type(c, count);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[]) {
  (void)references, (void)values;
  return refuse_type(c, count);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *saved) {
  *saved = save_state(&((Instance *)c)->slave, (SavedState *)*saved);
  return *saved ? fmi2OK : refuse((Instance *)c, "no memory for a saved state");
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate saved) {
  if (!saved) return refuse((Instance *)c, "no saved state was given");
  return (fmi2Status)restore_state(&((Instance *)c)->slave, (const SavedState *)saved);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *saved) {
  (void)c;
  if (!saved) return fmi2OK;
  free_saved_state((SavedState *)*saved);
  *saved = NULL;
  return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate saved, size_t *size) {
  (void)c;
  *size = serialised_size((const SavedState *)saved);
  return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate saved, fmi2Byte bytes[], size_t size) {
  if (size < serialised_size((const SavedState *)saved)) return refuse((Instance *)c, "too few bytes for a saved state");
  serialise_state((const SavedState *)saved, bytes);
  return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *saved) {
  SavedState *state = deserialise_state(bytes, size);
  if (!state) return refuse((Instance *)c, "a saved state that was no state of this FMU");
  *saved = state;
  return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t unknown_count,
                                        const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
  return (fmi2Status)get_directional_derivative(&((Instance *)c)->slave, unknowns, unknown_count, knowns, known_count,
                                                seed, sensitivity);
}

/* Derivatives beyond the inputs that are rates are ignored: FMI allows the status discard in other functions only. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t count,
                                       const fmi2Integer orders[], const fmi2Real values[]) {
  Instance *instance = (Instance *)c;
  fmi2Status status = fmi2OK;
  size_t k;
  for (k = 0; k < count; k++) {
    unsigned int rate = derivative_of(references[k], orders[k]);
    if (references[k] >= INPUT_COUNT || orders[k] < 1)
      return refuse(instance, "only inputs have derivatives to set, of order 1 or higher");
    if (rate >= INPUT_COUNT) {
      log_message(&instance->slave, STATUS_WARNING, "a derivative of an order that its input does not have is ignored");
      status = fmi2Warning;
    } else if (set_variables(&instance->slave, &rate, 1, values + k) != STATUS_OK)
      return fmi2Error;
  }
  return status;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t count,
                                        const fmi2Integer orders[], fmi2Real values[]) {
  size_t k;
  for (k = 0; k < count; k++)
    if (get_output_derivative(&((Instance *)c)->slave, references[k], orders[k], values + k) != STATUS_OK)
      return fmi2Error;
  return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_rollback) {
  Instance *instance = (Instance *)c;
  (void)no_rollback;
  if (!is_allowed(&instance->slave, STEPPING, "fmi2DoStep")) return fmi2Error;
  return (fmi2Status)do_step(&instance->slave, time, step);
}

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse((Instance *)c, "no step is pending"); }

/* What is known after a step that was discarded: the end of the last one that was not. */
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = ((Instance *)c)->slave.state.time;
  return fmi2OK;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}
