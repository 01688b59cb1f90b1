/* A plain FMI 2.0 importer in C99: loads FMUs, wires them by value reference and steps them all at once (Jacobi).

   It reads a plan from the file that it is given, one order a line:
     fmu LIBRARY / guid GUID / resources URI     a component; they count from 0
     connect A OUT B IN                          input IN of component B follows output OUT of component A
     ramp A IN RATE                              input IN of component A is RATE times the time
     hold A IN VALUE                             input IN of component A is set once
     step SECONDS / steps N                      the grid
     python LIBRARY                              this program has a Python of its own, as a plugin would: RTLD_LOCAL
     show A OUT                                  printed at the end with all its digits */
#include <dlfcn.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

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
} Fmu;

typedef struct {
    unsigned source, output, target, input;
    double value;
} Link;

static Fmu fmus[MOST];
static Link connections[MOST], ramps[MOST], held[MOST], shown[MOST];
static size_t fmu_count, connection_count, ramp_count, held_count, shown_count, steps;
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

/* ISO C has no conversion from an object pointer to a function pointer; POSIX promises that the bytes fit. */
static void find(void *handle, const char *name, void *function) {
    void *symbol = dlsym(handle, name);
    if (symbol == NULL) fail(name, dlerror());
    memcpy(function, &symbol, sizeof symbol);
}

static void start_own_python(const char *library) {
    void *handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    void (*initialise)(int);
    void *(*let_others)(void);
    if (handle == NULL) fail("dlopen", dlerror());
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

static void load(Fmu *fmu) {
    fmu->handle = dlopen(fmu->library, RTLD_NOW | RTLD_LOCAL);
    if (fmu->handle == NULL) fail("dlopen", dlerror());
    find(fmu->handle, "fmi2Instantiate", &fmu->instantiate);
    find(fmu->handle, "fmi2SetupExperiment", &fmu->setup);
    find(fmu->handle, "fmi2EnterInitializationMode", &fmu->enter);
    find(fmu->handle, "fmi2ExitInitializationMode", &fmu->leave);
    find(fmu->handle, "fmi2GetReal", &fmu->get);
    find(fmu->handle, "fmi2SetReal", &fmu->set);
    find(fmu->handle, "fmi2DoStep", &fmu->advance);
    find(fmu->handle, "fmi2Terminate", &fmu->terminate);
    find(fmu->handle, "fmi2FreeInstance", &fmu->release);
    fmu->instance = fmu->instantiate("fmu", fmi2CoSimulation, fmu->guid, fmu->resources, &callbacks, 0, 0);
    if (fmu->instance == NULL) fail("fmi2Instantiate", fmu->library);
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

/* In a thread of its own, as many importers load in one and step in another. */
static void *run(void *unused) {
    for (size_t index = 0; index < steps; index++) exchange_and_step((double)index * step);
    return unused;
}

int main(int count, char **arguments) {
    pthread_t thread;
    if (count != 2) fail("usage", "host PLAN");
    read_plan(arguments[1]);
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) load(fmu);
    for (Link *link = held; link < held + held_count; link++) set(link->target, link->input, link->value);
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) check(fmu->leave(fmu->instance), "fmi2ExitInitializationMode");
    if (pthread_create(&thread, NULL, run, NULL) || pthread_join(thread, NULL)) fail("thread", NULL);
    for (Link *link = shown; link < shown + shown_count; link++) printf("%.17g\n", get(link->source, link->output));
    for (Fmu *fmu = fmus; fmu < fmus + fmu_count; fmu++) {
        check(fmu->terminate(fmu->instance), "fmi2Terminate");
        fmu->release(fmu->instance);
        dlclose(fmu->handle);
    }
    return 0;
}
