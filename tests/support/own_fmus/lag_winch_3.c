/* The winch of lag_winch.c by FMI 3.0. Built with -DFAULT=..., its step from 0.1 s on goes wrong in that way. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

#ifndef FAULT
#define FAULT SOUND
#endif

typedef struct {
    double values[3];
    double start;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Winch;

enum { COMMAND, SPEED, LAG };
enum { SOUND, ERROR, EVENT, END, EARLY, CRASH };

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference intermediate[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    if (events || early || n) return NULL;
    Winch *winch = calloc(1, sizeof(Winch));
    if (!winch) return NULL;
    winch->values[LAG] = 0.05;
    winch->environment = environment;
    winch->log = log;
    return winch;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean bounded, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean ends, fmi3Float64 stop) {
    ((Winch *)c)->start = start;
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[], size_t m) {
    if (m != n) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] > LAG) return fmi3Error;
        value[i] = ((Winch *)c)->values[vr[i]];
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[],
                          size_t m) {
    if (m != n) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] > LAG) return fmi3Error;
        ((Winch *)c)->values[vr[i]] = value[i];
    }
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean keep, fmi3Boolean *event,
                      fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached) {
    Winch *winch = c;
    double *v = winch->values;
    int fault = time > winch->start + 0.0999 ? FAULT : SOUND;
    if (fault == CRASH) abort();
    if (fault == ERROR) {
        winch->log(winch->environment, fmi3Error, "logStatusError", "the drum is stuck");
        return fmi3Error;
    }
    v[SPEED] = v[COMMAND] + (v[SPEED] - v[COMMAND]) * exp(-step / v[LAG]);
    *event = fault == EVENT;
    *end = fault == END;
    *early = fault == EARLY;
    *reached = time + (fault == EARLY ? 0.5 * step : step);
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Winch));
    if (!*state) return fmi3Error;
    memcpy(*state, c, sizeof(Winch));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(c, state, sizeof(Winch));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    free(*state);
    *state = NULL;
    return fmi3OK;
}

/* What it need not do anything for. */
#define IDLE(name) \
    fmi3Status name(fmi3Instance c) { return fmi3OK; }

IDLE(fmi3ExitInitializationMode)
IDLE(fmi3Terminate)
IDLE(fmi3Reset)
IDLE(fmi3EnterStepMode)
IDLE(fmi3EnterEventMode)
IDLE(fmi3EnterContinuousTimeMode)
IDLE(fmi3EnterConfigurationMode)
IDLE(fmi3ExitConfigurationMode)
IDLE(fmi3EvaluateDiscreteStates)

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[]) { return fmi3OK; }

/* What a winch has none of; fmpy, as the standard, asks for every function. */
#define NONE(name, ...) \
    fmi3Status name(fmi3Instance c, __VA_ARGS__) { return fmi3Error; }
#define LIST const fmi3ValueReference vr[], size_t n
#define NO_TYPE(name)                                        \
    NONE(fmi3Get##name, LIST, fmi3##name value[], size_t m)  \
    NONE(fmi3Set##name, LIST, const fmi3##name value[], size_t m)
#define IDENTITY fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging

fmi3Instance fmi3InstantiateModelExchange(IDENTITY, fmi3InstanceEnvironment e, fmi3LogMessageCallback log) {
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(IDENTITY, fmi3InstanceEnvironment e, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    return NULL;
}

NO_TYPE(Float32)
NO_TYPE(Int8)
NO_TYPE(UInt8)
NO_TYPE(Int16)
NO_TYPE(UInt16)
NO_TYPE(Int32)
NO_TYPE(UInt32)
NO_TYPE(Int64)
NO_TYPE(UInt64)
NO_TYPE(Boolean)
NO_TYPE(String)
NONE(fmi3GetBinary, LIST, size_t size[], fmi3Binary value[], size_t m)
NONE(fmi3SetBinary, LIST, const size_t size[], const fmi3Binary value[], size_t m)
NONE(fmi3GetClock, LIST, fmi3Clock value[])
NONE(fmi3SetClock, LIST, const fmi3Clock value[])
NONE(fmi3GetIntervalDecimal, LIST, fmi3Float64 interval[], fmi3IntervalQualifier qualifier[])
NONE(fmi3SetIntervalDecimal, LIST, const fmi3Float64 interval[])
NONE(fmi3GetIntervalFraction, LIST, fmi3UInt64 count[], fmi3UInt64 of[], fmi3IntervalQualifier qualifier[])
NONE(fmi3SetIntervalFraction, LIST, const fmi3UInt64 count[], const fmi3UInt64 of[])
NONE(fmi3GetShiftDecimal, LIST, fmi3Float64 shift[])
NONE(fmi3SetShiftDecimal, LIST, const fmi3Float64 shift[])
NONE(fmi3GetShiftFraction, LIST, fmi3UInt64 count[], fmi3UInt64 of[])
NONE(fmi3SetShiftFraction, LIST, const fmi3UInt64 count[], const fmi3UInt64 of[])
NONE(fmi3GetNumberOfVariableDependencies, fmi3ValueReference vr, size_t *n)
NONE(fmi3GetVariableDependencies, fmi3ValueReference vr, size_t i[], fmi3ValueReference on[], size_t j[],
     fmi3DependencyKind kind[], size_t n)
NONE(fmi3SerializedFMUStateSize, fmi3FMUState state, size_t *size)
NONE(fmi3SerializeFMUState, fmi3FMUState state, fmi3Byte bytes[], size_t size)
NONE(fmi3DeserializeFMUState, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
NONE(fmi3GetDirectionalDerivative, LIST, const fmi3ValueReference known[], size_t m, const fmi3Float64 seed[],
     size_t k, fmi3Float64 value[], size_t l)
NONE(fmi3GetAdjointDerivative, LIST, const fmi3ValueReference known[], size_t m, const fmi3Float64 seed[], size_t k,
     fmi3Float64 value[], size_t l)
NONE(fmi3GetOutputDerivatives, LIST, const fmi3Int32 order[], fmi3Float64 value[], size_t m)
NONE(fmi3UpdateDiscreteStates, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals, fmi3Boolean *values,
     fmi3Boolean *defined, fmi3Float64 *next)
NONE(fmi3CompletedIntegratorStep, fmi3Boolean keep, fmi3Boolean *event, fmi3Boolean *end)
NONE(fmi3SetTime, fmi3Float64 time)
NONE(fmi3SetContinuousStates, const fmi3Float64 state[], size_t n)
NONE(fmi3GetContinuousStates, fmi3Float64 state[], size_t n)
NONE(fmi3GetContinuousStateDerivatives, fmi3Float64 rate[], size_t n)
NONE(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominal[], size_t n)
NONE(fmi3GetEventIndicators, fmi3Float64 indicator[], size_t n)
NONE(fmi3GetNumberOfEventIndicators, size_t *n)
NONE(fmi3GetNumberOfContinuousStates, size_t *n)
NONE(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
