/* An instance: variables, earlier inputs, time since them, and what its component derives from the parameters. */

typedef struct {
  double real[VARIABLE_COUNT];
  double previous_inputs[INPUT_COUNT];
  double elapsed;
  double time;
  double start_time;
  double last_instant[INSTANT_SIZE];
  int32_t has_instant;
  int32_t saved_phase;
  int32_t has_previous_inputs;
  int32_t started;
} State;

/* The states of FMI that tell which calls are allowed; events and continuous time are those of model exchange. */
typedef enum { INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED, EVENTS, CONTINUOUS_TIME } Phase;

typedef void (*Log)(void *owner, int status, const char *message);

typedef struct {
  State state;
  DelayLine delay_line;
  Phase phase;
  double start[START_SIZE];
  double relative_tolerance;
  int parameters_valid;
  int outputs_stale;
  int has_middle_inputs;
  int is_model_exchange;
  int has_time_variable;
  Log log;
  void *owner;
} Slave;

enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR };

/* A change of variables has a number for each; where it is a result, rates of the states are behind them. */
#define CHANGE_SIZE (VARIABLE_COUNT + STATE_COUNT)
#define TIME_SEED VARIABLE_COUNT
#define SEED_SIZE (VARIABLE_COUNT + 1)

/* Each component has these; they return 0 where its law has no value. The last one adds to `change`, which begins with
   zeros, how outputs and rates of the states change along a change `seed` of inputs, states and, behind all
   variables, the time. Components without model exchange need inputs and outputs alone. */
static int derive_start(Slave *slave, double *start_states);
static int advance(Slave *slave, double step, int at_end);
static int refresh(Slave *slave);
static int differentiate(const Slave *slave, const double *seed, double *change);

/* In model exchange components have these too. The last one records what a sensor shows late, where there is one.
   Rates of the states and event indicators have the references behind those of the state's variables. */
#ifdef MODEL_EXCHANGE
#define FURTHER_COUNT (STATE_COUNT + INDICATOR_COUNT)
static int rates_now(const Slave *slave, double *rates);
static int indicators_now(const Slave *slave, double *indicators);
static int record_now(Slave *slave);
static void further_values(const Slave *slave, double *values);
#else
#define FURTHER_COUNT 0
#endif
#define REFERENCE_COUNT (VARIABLE_COUNT + FURTHER_COUNT)
/* By FMI 3.0 the time is a variable too. */
#define TIME_REFERENCE REFERENCE_COUNT

/* Whether outputs of the middle of a step are those of now. By the model structure they depend on inputs in this mode
   alone, and importers compress Jacobians by it. */
static int middle_is_now(const Slave *slave) { return !slave->state.started && slave->phase == INITIALIZATION; }

/* Inputs that hold at the start of a step. */
static const double *inputs_at_start(const Slave *slave, int at_end) {
  return at_end ? slave->state.previous_inputs : slave->state.real;
}
