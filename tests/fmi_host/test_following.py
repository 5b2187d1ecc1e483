"""A worker whose answers come fast is where its host is; slow ones, and those with threads, are free."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest

from linkwind.fmi.host.following import TRIALS
from tests.fmi_host.foreign import Foreign, Variable

FAST = Foreign(
    (Variable("vx", "input"), Variable("Fx", "output")),
    code="#define OUTPUTS(m) (m->v[1] = -m->v[0])",
)
SLOW = "\n#define STEP(m, t, h) (t > 0.0295 ? (usleep(400000), OK) : OK)"
THREAD = (
    "\n#include <pthread.h>\nstatic void *idle(void *x) { pause(); return x; }\n"
    "#define INSTANTIATE(m) do { pthread_t p; pthread_create(&p, NULL, idle, NULL); } while (0)"
)
pytestmark = pytest.mark.skipif(len(os.sched_getaffinity(0)) == 1, reason="there is one processor only")


def where(hosted) -> set[int]:
    return os.sched_getaffinity(hosted.model._instances._parts[0].worker.pid)


def test_fast_answers_come_from_the_processor_of_the_host(host, monkeypatch):
    monkeypatch.setattr("linkwind.fmi.host.following.SHORT", 10.0)  # on a busy machine too
    monkeypatch.setattr("linkwind.fmi.host.following.LONG", 0.3)
    hosted = host(replace(FAST, code=FAST.code + SLOW))
    for k in range(TRIALS - 1):
        hosted.step(k)
    assert where(hosted) == os.sched_getaffinity(0)
    for k in range(TRIALS - 1, 29):
        hosted.step(k)
    assert len(where(hosted)) == 1
    for k in range(29, 32):  # the last of these is slow
        hosted.step(k)
    assert where(hosted) == os.sched_getaffinity(0)


def test_slow_answers_are_left_alone(host, monkeypatch):
    monkeypatch.setattr("linkwind.fmi.host.following.SHORT", 0.0)
    hosted = host(FAST)
    for k in range(TRIALS + 5):
        hosted.step(k)
    assert where(hosted) == os.sched_getaffinity(0)


def test_threads_are_left_alone(host, monkeypatch):
    monkeypatch.setattr("linkwind.fmi.host.following.SHORT", 10.0)
    hosted = host(replace(FAST, code=FAST.code + THREAD))
    for k in range(TRIALS + 5):
        hosted.step(k)
    assert where(hosted) == os.sched_getaffinity(0)
