/* Functions of FMI 3.0 for what these FMUs have not: events in steps, clocks, binaries, and some no model exchange. */

#define ABSENT(name, ...)                                         \
  fmi3Status name(__VA_ARGS__) {                                  \
    return refuse(c, "this FMU does not provide this function");  \
  }

ABSENT(fmi3EnterStepMode, fmi3Instance c)
ABSENT(fmi3EnterConfigurationMode, fmi3Instance c)
ABSENT(fmi3ExitConfigurationMode, fmi3Instance c)
ABSENT(fmi3EvaluateDiscreteStates, fmi3Instance c)
ABSENT(fmi3GetBinary, fmi3Instance c, const fmi3ValueReference references[], size_t count, size_t sizes[],
       fmi3Binary values[], size_t value_count)
ABSENT(fmi3SetBinary, fmi3Instance c, const fmi3ValueReference references[], size_t count, const size_t
       sizes[], const fmi3Binary values[], size_t value_count)
ABSENT(fmi3GetClock, fmi3Instance c, const fmi3ValueReference references[], size_t count, fmi3Clock values[])
ABSENT(fmi3SetClock, fmi3Instance c, const fmi3ValueReference references[], size_t count, const fmi3Clock
       values[])
ABSENT(fmi3GetIntervalDecimal, fmi3Instance c, const fmi3ValueReference references[], size_t count,
       fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT(fmi3GetIntervalFraction, fmi3Instance c, const fmi3ValueReference references[], size_t count,
       fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
ABSENT(fmi3GetShiftDecimal, fmi3Instance c, const fmi3ValueReference references[], size_t count, fmi3Float64
       shifts[])
ABSENT(fmi3GetShiftFraction, fmi3Instance c, const fmi3ValueReference references[], size_t count, fmi3UInt64
       counters[], fmi3UInt64 resolutions[])
ABSENT(fmi3SetIntervalDecimal, fmi3Instance c, const fmi3ValueReference references[], size_t count, const
       fmi3Float64 intervals[])
ABSENT(fmi3SetIntervalFraction, fmi3Instance c, const fmi3ValueReference references[], size_t count, const
       fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(fmi3SetShiftDecimal, fmi3Instance c, const fmi3ValueReference references[], size_t count, const
       fmi3Float64 shifts[])
ABSENT(fmi3SetShiftFraction, fmi3Instance c, const fmi3ValueReference references[], size_t count, const
       fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(fmi3GetNumberOfVariableDependencies, fmi3Instance c, fmi3ValueReference reference, size_t *count)
ABSENT(fmi3GetVariableDependencies, fmi3Instance c, fmi3ValueReference reference, size_t elements[],
       fmi3ValueReference independents[], size_t independent_elements[], fmi3DependencyKind kinds[], size_t
       count)
ABSENT(fmi3ActivateModelPartition, fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging_on,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging_on, (void)environment, (void)log;
  (void)update, (void)lock, (void)unlock;
  return NULL;
}

#ifndef MODEL_EXCHANGE
ABSENT(fmi3EnterEventMode, fmi3Instance c)
ABSENT(fmi3EnterContinuousTimeMode, fmi3Instance c)
ABSENT(fmi3UpdateDiscreteStates, fmi3Instance c, fmi3Boolean *update, fmi3Boolean *terminate, fmi3Boolean
       *nominals, fmi3Boolean *values, fmi3Boolean *has_event, fmi3Float64 *event)
ABSENT(fmi3CompletedIntegratorStep, fmi3Instance c, fmi3Boolean no_rollback, fmi3Boolean *enter_event_mode,
       fmi3Boolean *terminate)
ABSENT(fmi3SetTime, fmi3Instance c, fmi3Float64 time)
ABSENT(fmi3SetContinuousStates, fmi3Instance c, const fmi3Float64 states[], size_t count)
ABSENT(fmi3GetContinuousStateDerivatives, fmi3Instance c, fmi3Float64 derivatives[], size_t count)
ABSENT(fmi3GetEventIndicators, fmi3Instance c, fmi3Float64 indicators[], size_t count)
ABSENT(fmi3GetContinuousStates, fmi3Instance c, fmi3Float64 states[], size_t count)
ABSENT(fmi3GetNominalsOfContinuousStates, fmi3Instance c, fmi3Float64 nominals[], size_t count)
ABSENT(fmi3GetNumberOfEventIndicators, fmi3Instance c, size_t *count)
ABSENT(fmi3GetNumberOfContinuousStates, fmi3Instance c, size_t *count)

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging_on, (void)environment, (void)log;
  return NULL;
}
#endif
