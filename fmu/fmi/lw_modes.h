/* The state machines of FMI 2.0 and 3.0: which call is allowed in which mode. */
#ifndef LW_MODES_H
#define LW_MODES_H

enum {
    LW_INSTANTIATED = 1,
    LW_INITIALIZATION = 2,
    LW_EVENT = 4,             /* Model Exchange */
    LW_CONTINUOUS = 8,        /* Model Exchange */
    LW_STEP = 16,             /* Co-Simulation, at a communication point */
    LW_INTERMEDIATE = 32,     /* Co-Simulation, in the callback between substeps */
    LW_INTERMEDIATE_END = 64, /* the same after the last one: inputs are not asked for any more */
    LW_TERMINATED = 128,
    LW_RESTING = LW_INSTANTIATED | LW_INITIALIZATION | LW_EVENT | LW_CONTINUOUS | LW_STEP | LW_TERMINATED,
    LW_RUNNING = LW_EVENT | LW_CONTINUOUS | LW_STEP,
    LW_ANY = LW_RESTING | LW_INTERMEDIATE | LW_INTERMEDIATE_END,
    /* besides a mode, the interface type */
    LW_ONLY_ME = 256,
    LW_ONLY_CS = 512
};

/* X(call, modes in FMI 2.0, modes in FMI 3.0) */
#define LW_CALLS(X)                                                                                      \
    X(LOGGING, LW_ANY, LW_ANY)                                                                           \
    X(SETUP, LW_INSTANTIATED, 0)                                                                         \
    X(ENTER_INITIALIZATION, LW_INSTANTIATED, LW_INSTANTIATED)                                            \
    X(EXIT_INITIALIZATION, LW_INITIALIZATION, LW_INITIALIZATION)                                         \
    X(TERMINATE, LW_RUNNING, LW_RUNNING)                                                                 \
    X(RESET, LW_RESTING, LW_RESTING)                                                                     \
    X(GET, LW_ANY & ~LW_INSTANTIATED, LW_ANY)                                                            \
    X(SET, LW_INSTANTIATED | LW_INITIALIZATION | LW_RUNNING,                                             \
      LW_INSTANTIATED | LW_INITIALIZATION | LW_RUNNING | LW_INTERMEDIATE)                                \
    X(STATE, LW_RESTING, LW_RESTING)                                                                     \
    X(DERIVATIVE, LW_INITIALIZATION | LW_RUNNING | LW_TERMINATED,                                        \
      LW_INITIALIZATION | LW_RUNNING | LW_TERMINATED)                                                    \
    X(UNSUPPORTED, LW_ANY, LW_ANY)                                                                       \
    X(ENTER_EVENT, LW_EVENT | LW_CONTINUOUS, LW_CONTINUOUS)                                              \
    X(DISCRETE_STATES, LW_EVENT, LW_EVENT)                                                               \
    X(ENTER_CONTINUOUS, LW_EVENT, LW_EVENT)                                                              \
    X(COMPLETED_STEP, LW_CONTINUOUS, LW_CONTINUOUS)                                                      \
    X(SET_TIME, LW_EVENT | LW_CONTINUOUS, LW_EVENT | LW_CONTINUOUS)                                      \
    X(SET_STATES, LW_CONTINUOUS, LW_CONTINUOUS)                                                          \
    X(GET_STATES, LW_ONLY_ME | LW_INITIALIZATION | LW_EVENT | LW_CONTINUOUS | LW_TERMINATED,             \
      LW_ONLY_ME | LW_INITIALIZATION | LW_EVENT | LW_CONTINUOUS | LW_TERMINATED)                         \
    X(GET_NOMINALS, LW_ONLY_ME | LW_RESTING, LW_ONLY_ME | LW_RESTING)                                    \
    X(COUNT_STATES, LW_ONLY_ME | LW_RESTING, LW_ONLY_ME | LW_RESTING)                                    \
    X(INPUT_DERIVATIVES, LW_ONLY_CS | LW_INSTANTIATED | LW_INITIALIZATION | LW_STEP, 0)                  \
    X(OUTPUT_DERIVATIVES, LW_ONLY_CS | LW_STEP | LW_TERMINATED,                                          \
      LW_ONLY_CS | LW_STEP | LW_INTERMEDIATE | LW_INTERMEDIATE_END | LW_TERMINATED)                      \
    X(DO_STEP, LW_STEP, LW_STEP)                                                                         \
    X(STEP_STATUS, LW_ONLY_CS | LW_STEP | LW_TERMINATED, 0)

#define LW_MODES_OF_CALL(call, fmi2, fmi3) LW_FMI2_##call = (fmi2), LW_FMI3_##call = (fmi3),
enum { LW_CALLS(LW_MODES_OF_CALL) LW_CALLS_END };

/* In which modes a variable may be set, by LW_FIXED_PARAMETER ... LW_INDEPENDENT of lw_fmu.h. */
static const unsigned lw_settable[] = {
    LW_INSTANTIATED | LW_INITIALIZATION,
    LW_INSTANTIATED | LW_INITIALIZATION | LW_EVENT | LW_STEP,
    LW_INSTANTIATED | LW_INITIALIZATION | LW_RUNNING | LW_INTERMEDIATE,
    LW_INSTANTIATED | LW_INITIALIZATION | LW_RUNNING,
    LW_INSTANTIATED | LW_INITIALIZATION,
    0,
    0};

#endif
