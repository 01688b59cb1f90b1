/* A plain FMI 2.0 importer in C99: loads FMUs, wires them by value reference and steps them all at once (Jacobi).

   It reads a plan from the file that it is given, one order a line:
     fmu LIBRARY / guid GUID / resources URI     a component; they count from 0
     states N                                    how many states it has, for model exchange
     connect A OUT B IN                          input IN of component B follows output OUT of component A
     ramp A IN RATE                              input IN of component A is RATE times the time
     hold A IN VALUE                             input IN of component A is set once
     step SECONDS / steps N                      the grid
     exchange yes                                by model exchange, all states by the classical Runge-Kutta method
     python LIBRARY                              this program has a Python of its own, as a plugin would: RTLD_LOCAL
     show A OUT                                  printed at the end with all its digits */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "system.h"

enum { MOST = 256, LINE = 4096 };

typedef struct {
    char library[LINE], guid[LINE], resources[LINE];
    void *handle;
    fmi2Component instance;
    fmi2InstantiateTYPE *instantiate;
    fmi2SetupExperimentTYPE *setup;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2GetRealTYPE *get;
    fmi2SetRealTYPE *set;
    fmi2DoStepTYPE *advance;
    fmi2TerminateTYPE *terminate;
    fmi2FreeInstanceTYPE *release;
    fmi2SetTimeTYPE *set_time;
    fmi2SetContinuousStatesTYPE *set_states;
    fmi2GetContinuousStatesTYPE *get_states;
    fmi2GetDerivativesTYPE *get_rates;
    fmi2CompletedIntegratorStepTYPE *complete;
    size_t state_count;
    double states[MOST], stage[MOST], rates[4][MOST];
} Fmu;

typedef struct {
    unsigned source, output, target, input;
    double value;
} Link;

static Fmu fmus[MOST];
static Link connections[MOST], ramps[MOST], held[MOST], shown[MOST];
static size_t fmu_count, connection_count, ramp_count, held_count, shown_count, steps;
static int is_exchange;
static double step;

static void fail(const char *what, const char *why) {
    fprintf(stderr, "host: %s: %s\n", what, why ? why : "failed");
    exit(1);
}

static void check(fmi2Status status, const char *what) {
    if (status > fmi2Warning) fail(what, "bad status");
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                        fmi2String category, fmi2String message, ...) {
    va_list arguments;
    (void)environment, (void)category;
    fprintf(stderr, "%s [%d]: ", instance, (int)status);
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};

static void find(void *handle, const char *name, void *function) {
    void *symbol = symbol_of(handle, name);
    if (symbol == NULL) fail(name, loading_error());
    memcpy(function, &symbol, sizeof symbol);
}

static void start_own_python(const char *library) {
    void *handle = open_library(library);
    void (*initialise)(int);
    void *(*let_others)(void);
    if (handle == NULL) fail("library", loading_error());
    find(handle, "Py_InitializeEx", &initialise);
    find(handle, "PyEval_SaveThread", &let_others);
    initialise(0);
    let_others();
}

static void read_order(char *line) {
    Link link = {0, 0, 0, 0, 0.0};
    char *rest = strchr(line, ' ');
    if (rest == NULL || fmu_count == MOST || connection_count == MOST) fail(line, "bad line in the plan");
    *rest++ = '\0';
    rest[strcspn(rest, "\n")] = '\0';
    if (!strcmp(line, "fmu")) strcpy(fmus[fmu_count++].library, rest);
    else if (!strcmp(line, "guid")) strcpy(fmus[fmu_count - 1].guid, rest);
    else if (!strcmp(line, "resources")) strcpy(fmus[fmu_count - 1].resources, rest);
    else if (!strcmp(line, "step")) step = atof(rest);
    else if (!strcmp(line, "steps")) steps = (size_t)atol(rest);
    else if (!strcmp(line, "states")) fmus[fmu_count - 1].state_count = (size_t)atol(rest);
    else if (!strcmp(line, "exchange")) is_exchange = 1;
    else if (!strcmp(line, "python")) start_own_python(rest);
    else if (!strcmp(line, "connect")) {
        if (sscanf(rest, "%u %u %u %u", &link.source, &link.output, &link.target, &link.input) != 4) fail(line, rest);
        connections[connection_count++] = link;
    } else if (!strcmp(line, "ramp") || !strcmp(line, "hold")) {
        if (sscanf(rest, "%u %u %lf", &link.target, &link.input, &link.value) != 3) fail(line, rest);
        if (*line == 'r') ramps[ramp_count++] = link;
        else held[held_count++] = link;
    } else if (!strcmp(line, "show")) {
        if (sscanf(rest, "%u %u", &link.source, &link.output) != 2) fail(line, rest);
        shown[shown_count++] = link;
    } else fail(line, "unknown order");
}

static void read_plan(const char *path) {
    char line[LINE];
    FILE *plan = fopen(path, "r");
    if (plan == NULL) fail(path, "cannot be read");
    while (fgets(line, sizeof line, plan)) read_order(line);
    fclose(plan);
}

static void find_exchange(Fmu *fmu) {
    find(fmu->handle, "fmi2SetTime", &fmu->set_time);
    find(fmu->handle, "fmi2SetContinuousStates", &fmu->set_states);
    find(fmu->handle, "fmi2GetContinuousStates", &fmu->get_states);
    find(fmu->handle, "fmi2GetDerivatives", &fmu->get_rates);
    find(fmu->handle, "fmi2CompletedIntegratorStep", &fmu->complete);
}

static void load(Fmu *fmu) {
    fmi2Type type = is_exchange ? fmi2ModelExchange : fmi2CoSimulation;
    fmu->handle = open_library(fmu->library);
    if (fmu->handle == NULL) fail("library", loading_error());
    find(fmu->handle, "fmi2Instantiate", &fmu->instantiate);
    find(fmu->handle, "fmi2SetupExperiment", &fmu->setup);
    find(fmu->handle, "fmi2EnterInitializationMode", &fmu->enter);
    find(fmu->handle, "fmi2ExitInitializationMode", &fmu->leave);
    find(fmu->handle, "fmi2GetReal", &fmu->get);
    find(fmu->handle, "fmi2SetReal", &fmu->set);
    find(fmu->handle, "fmi2DoStep", &fmu->advance);
    find(fmu->handle, "fmi2Terminate", &fmu->terminate);
    find(fmu->handle, "fmi2FreeInstance", &fmu->release);
    fmu->instance = fmu->instantiate("fmu", type, fmu->guid, fmu->resources, &callbacks, 0, 0);
    if (fmu->instance == NULL) fail("fmi2Instantiate", fmu->library);
    if (is_exchange) find_exchange(fmu);
    check(fmu->setup(fmu->instance, fmi2False, 0.0, 0.0, fmi2False, 0.0), "fmi2SetupExperiment");
    check(fmu->enter(fmu->instance), "fmi2EnterInitializationMode");
}

static double get(unsigned fmu, fmi2ValueReference reference) {
    double value;
    check(fmus[fmu].get(fmus[fmu].instance, &reference, 1, &value), "fmi2GetReal");
    return value;
}

static void set(unsigned fmu, fmi2ValueReference reference, double value) {
    check(fmus[fmu].set(fmus[fmu].instance, &reference, 1, &value), "fmi2SetReal");
}

static void exchange_and_step(double time) {
    for (Link *link = connections; link < connections + connection_count; link++)
        link->value = get(link->source, link->output);
    for (Link *link = connections; link < connections + connection_count; link++)
        set(link->target, link->input, link->value);
    for (Link *link = ramps; link < ramps + ramp_count; link++) set(link->target, link->input, link->value * time);
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++)
        check(fmu->advance(fmu->instance, time, step, fmi2True), "fmi2DoStep");
}

/* Rates at a time and the states of a stage. The second turn gives forces at the positions of the first one. */
static void evaluate(double time, int stage) {
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) {
        check(fmu->set_time(fmu->instance, time), "fmi2SetTime");
        check(fmu->set_states(fmu->instance, fmu->stage, fmu->state_count), "fmi2SetContinuousStates");
    }
    for (Link *link = ramps; link < ramps + ramp_count; link++) set(link->target, link->input, link->value * time);
    for (int turn = 0; turn < 2; turn++)
        for (Link *link = connections; link < connections + connection_count; link++)
            set(link->target, link->input, get(link->source, link->output));
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++)
        check(fmu->get_rates(fmu->instance, fmu->rates[stage], fmu->state_count), "fmi2GetDerivatives");
}

static void integrate(double time) {
    static const double parts[] = {0.0, 0.5, 0.5, 1.0}, weights[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    fmi2Boolean event, terminate;
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++)
        check(fmu->get_states(fmu->instance, fmu->states, fmu->state_count), "fmi2GetContinuousStates");
    for (int stage = 0; stage <= 4; stage++) {
        for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++)
            for (size_t k = 0; k < fmu->state_count; k++) {
                fmu->stage[k] = fmu->states[k];
                if (0 < stage && stage < 4) fmu->stage[k] += step * parts[stage] * fmu->rates[stage - 1][k];
                for (int j = 0; stage == 4 && j < 4; j++) fmu->stage[k] += step * weights[j] * fmu->rates[j][k];
            }
        evaluate(time + step * (stage < 4 ? parts[stage] : 1.0), stage % 4);
    }
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++)
        check(fmu->complete(fmu->instance, fmi2True, &event, &terminate), "fmi2CompletedIntegratorStep");
}

static void enter_continuous_time(Fmu *fmu) {
    fmi2NewDiscreteStatesTYPE *update;
    fmi2EnterContinuousTimeModeTYPE *enter;
    fmi2EventInfo info;
    find(fmu->handle, "fmi2NewDiscreteStates", &update);
    find(fmu->handle, "fmi2EnterContinuousTimeMode", &enter);
    check(update(fmu->instance, &info), "fmi2NewDiscreteStates");
    check(enter(fmu->instance), "fmi2EnterContinuousTimeMode");
}

/* In a thread of its own, as many importers load in one and step in another. */
static void run(void) {
    for (size_t index = 0; index < steps; index++) (is_exchange ? integrate : exchange_and_step)((double)index * step);
}

int main(int count, char **arguments) {
    if (count != 2) fail("usage", "host PLAN");
    read_plan(arguments[1]);
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) load(fmu);
    for (Link *link = held; link < held + held_count; link++) set(link->target, link->input, link->value);
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) check(fmu->leave(fmu->instance), "fmi2ExitInitializationMode");
    for (Fmu *fmu = fmus; is_exchange && fmu < fmus + fmu_count; fmu++) enter_continuous_time(fmu);
    if (!call_in_thread(run)) fail("thread", NULL);
    for (Link *link = shown; link < shown + shown_count; link++) printf("%.17g\n", get(link->source, link->output));
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) {
        check(fmu->terminate(fmu->instance), "fmi2Terminate");
        fmu->release(fmu->instance);
        close_library(fmu->handle);
    }
    return 0;
}
