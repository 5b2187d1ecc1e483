/* A team of threads that share the parts of a job.
 *
 * Parts are handed out as threads ask for them, so that one that the system holds up delays the job by one
 * part at most. Which thread does a part must not matter to the result.
 */
#ifndef LW_THREADS_H
#define LW_THREADS_H

#include <stdint.h>

#include "lw_math.h"

typedef struct lw_threads lw_threads;
typedef void lw_part(const void *job, int32_t part);

/* Start a team of `count` threads, the caller's included. Returns NULL if there are not enough resources.
 * A process made by fork has no team: its jobs are done by the caller alone. */
LW_API lw_threads *lw_threads_create(int32_t count);

/* Do all parts 0 ... parts - 1 of a job, and return when the last one is done. A team does one job at a
 * time; without one (NULL) the caller does every part, in order. */
void lw_threads_run(lw_threads *team, lw_part *part, const void *job, int32_t parts);

LW_API void lw_threads_destroy(lw_threads *team);

#endif
