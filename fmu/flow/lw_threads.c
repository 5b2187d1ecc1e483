#define _POSIX_C_SOURCE 200809L
#include "lw_threads.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

/* How long a thread waits awake [ns]: longer than from one job to the next, while there are more. */
enum { PATIENCE = 100000 };

/* `ticket` holds the parts that are left in its low half and the number of the job in its high half: taking
 * a part is one compare-and-swap, which fails for a thread that is late by a job. `part` and `job` may be
 * read by whoever has a part, because the job does not end before that part is done. */
struct lw_threads {
    uint64_t ticket;
    int32_t unfinished, sleeping, stopping, count;
    pid_t process;
    lw_part *part;
    const void *job;
    pthread_mutex_t mutex;
    pthread_cond_t wake;
    pthread_t thread[];
};

static int32_t left(uint64_t ticket) { return (int32_t)(ticket & 0xffffffffu); }

static void pause_briefly(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

static int64_t now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void work(lw_threads *team) {
    uint64_t ticket = __atomic_load_n(&team->ticket, __ATOMIC_ACQUIRE);
    while (left(ticket) > 0) {
        if (__atomic_compare_exchange_n(&team->ticket, &ticket, ticket - 1, 0, __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE)) {
            team->part(team->job, left(ticket) - 1);
            __atomic_sub_fetch(&team->unfinished, 1, __ATOMIC_ACQ_REL);
            ticket = __atomic_load_n(&team->ticket, __ATOMIC_ACQUIRE);
        }
    }
}

static int idle(lw_threads *team) {
    return left(__atomic_load_n(&team->ticket, __ATOMIC_SEQ_CST)) == 0 &&
           !__atomic_load_n(&team->stopping, __ATOMIC_SEQ_CST);
}

static void sleep_until_work(lw_threads *team) {
    pthread_mutex_lock(&team->mutex);
    __atomic_add_fetch(&team->sleeping, 1, __ATOMIC_SEQ_CST);
    while (idle(team)) {
        pthread_cond_wait(&team->wake, &team->mutex);
    }
    __atomic_sub_fetch(&team->sleeping, 1, __ATOMIC_SEQ_CST);
    pthread_mutex_unlock(&team->mutex);
}

static void *member(void *argument) {
    lw_threads *team = argument;
    while (!__atomic_load_n(&team->stopping, __ATOMIC_ACQUIRE)) {
        const int64_t until = now() + PATIENCE;
        while (idle(team) && now() < until) {
            pause_briefly();
        }
        if (idle(team)) {
            sleep_until_work(team);
        }
        work(team);
    }
    return NULL;
}

static void wake_all(lw_threads *team) {
    if (__atomic_load_n(&team->sleeping, __ATOMIC_SEQ_CST) > 0) {
        pthread_mutex_lock(&team->mutex);
        pthread_cond_broadcast(&team->wake);
        pthread_mutex_unlock(&team->mutex);
    }
}

lw_threads *lw_threads_create(int32_t count) {
    lw_threads *team = calloc(1, sizeof *team + (size_t)count * sizeof team->thread[0]);
    if (!team) {
        return NULL;
    }
    team->count = 1;
    team->process = getpid();
    pthread_mutex_init(&team->mutex, NULL);
    pthread_cond_init(&team->wake, NULL);
    while (team->count < count) {
        if (pthread_create(&team->thread[team->count], NULL, member, team)) {
            lw_threads_destroy(team);
            return NULL;
        }
        ++team->count;
    }
    return team;
}

void lw_threads_run(lw_threads *team, lw_part *part, const void *job, int32_t parts) {
    if (!team) {
        for (int32_t i = 0; i < parts; ++i) {
            part(job, i);
        }
        return;
    }
    const uint64_t number = (__atomic_load_n(&team->ticket, __ATOMIC_RELAXED) >> 32) + 1;
    team->part = part;
    team->job = job;
    __atomic_store_n(&team->unfinished, parts, __ATOMIC_RELAXED);
    __atomic_store_n(&team->ticket, number << 32 | (uint32_t)parts, __ATOMIC_SEQ_CST);
    wake_all(team);
    work(team);
    const int64_t until = now() + PATIENCE;
    while (__atomic_load_n(&team->unfinished, __ATOMIC_ACQUIRE) > 0) {
        if (now() < until) {
            pause_briefly();
        } else {
            sched_yield(); /* its processor may be this one */
        }
    }
}

void lw_threads_destroy(lw_threads *team) {
    if (!team || team->process != getpid()) {
        return; /* after a fork there is nobody to wait for */
    }
    __atomic_store_n(&team->stopping, 1, __ATOMIC_SEQ_CST);
    pthread_mutex_lock(&team->mutex);
    pthread_cond_broadcast(&team->wake);
    pthread_mutex_unlock(&team->mutex);
    for (int32_t i = 1; i < team->count; ++i) {
        pthread_join(team->thread[i], NULL);
    }
    pthread_cond_destroy(&team->wake);
    pthread_mutex_destroy(&team->mutex);
    free(team);
}
