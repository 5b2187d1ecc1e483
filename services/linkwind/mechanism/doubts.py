"""What is not wrong in a mechanism, but perhaps not what was meant: degrees, other units, too long steps."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from linkwind.mechanism.forces import motion_program
from linkwind.native.expressions import derivatives
from linkwind.scenario import Scenario
from linkwind.scenario.forces import Motion
from linkwind.spatial import Array

SLIGHT, WIDE = 0.02, 10.0  # radius of gyration in lengths of a body: of a rod 0.29, of a disc 0.35
ANGLE = {"revolute": 0, "planar": 2}  # which coordinate of a joint is one
LONG = 20.0  # runs that a beat takes: of milliseconds it would be hundreds
LOOKS = 1000  # times at which a motion is looked at
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)  # its multiples, modulo 1, meet no rhythm
STEPS_A_BEAT = 8.0  # that tell its shape, as of a gust
FEWEST = 16  # steps of a run in which there is a beat to see


def doubts(scenario: Scenario) -> Iterator[str]:
    """Yield what to tell the user before a run, a sentence each; the mechanism has been built."""
    yield from _other_units(scenario)
    angles = {(joint.name, ANGLE.get(joint.type)) for joint in scenario.joints}
    times = np.sort(np.arange(LOOKS) * GOLDEN % 1.0) * scenario.time.end
    for index, force in enumerate(scenario.forces):
        if not isinstance(force, Motion):
            continue
        item = f"{scenario.where('forces', index)}.position"
        program = motion_program(force, scenario.time.end, item)
        looks = np.array([derivatives(program.code, program.constants, t) for t in times.tolist()])
        q, _, change = looks[np.isfinite(looks).all(axis=1)].T
        if not q.size:
            continue
        if (force.joint, force.coordinate) in angles:
            yield from _in_degrees(item, q)
        yield from _in_milliseconds(scenario, item, force)
        yield from _too_long_steps(scenario, item, q, change)


def _other_units(scenario: Scenario) -> Iterator[str]:
    """A body's radius of gyration is a part of its length; in mm, g or g·mm² it is far from that."""
    for index, body in enumerate(scenario.bodies):
        if body.shape is None or body.mass == 0.0:
            continue
        flat = isinstance(body.inertia, float)
        inertia = body.inertia if isinstance(body.inertia, float) else max(body.inertia[:3])
        length = body.shape.reference_length if flat else max(body.shape.reference_length, body.shape.span)
        radius = math.sqrt(inertia / body.mass)
        if inertia and not SLIGHT * length < radius < WIDE * length:
            yield (
                f"{scenario.where('bodies', index)}.inertia: {inertia:.3g} kg·m² are {body.mass:.3g} kg "
                f"{radius:.2g} m away from the centre of mass, of a body of {length:.3g} m. Are lengths in "
                "m, masses in kg?"
            )


def _in_degrees(item: str, q: Array) -> Iterator[str]:
    """A propeller turns on and on; what comes back by more than a turn is hardly meant."""
    there = float((q - np.minimum.accumulate(q)).max())
    back = float((np.maximum.accumulate(q) - q).max())
    through = min(there, back)
    if through > math.tau:
        yield (
            f"{item}: it goes to and fro through {through:.3g} rad, {through / math.tau:.2g} turns. If it is "
            "meant in degrees, multiply it by pi/180."
        )


def _in_milliseconds(scenario: Scenario, item: str, motion: Motion) -> Iterator[str]:
    table = motion.position.table
    if table is None or not motion.position.periodic:
        return
    period, end = table[-1][0] - table[0][0], scenario.time.end
    if period > LONG * end:
        yield (
            f"{item}.table: it begins again after {period:.4g} s, and the run takes {end:.4g} s. Are its "
            "times in s?"
        )


def _too_long_steps(scenario: Scenario, item: str, q: Array, change: Array) -> Iterator[str]:
    """Its beat is taken as that of the sine of the same amplitude and largest acceleration."""
    step, amplitude, largest = scenario.coupling.step, 0.5 * float(np.ptp(q)), float(np.abs(change).max())
    if scenario.steps < FEWEST or amplitude == 0.0:
        return
    beat = math.tau * math.sqrt(amplitude / largest) if largest else math.inf
    if beat < 0.99 * STEPS_A_BEAT * step:
        yield (
            f"{item}: it changes as fast as in a beat of {beat:.2g} s, which takes {beat / step:.2g} steps "
            f"of {step:g} s, and is not seen as it is. Use a coupling.step of {beat / STEPS_A_BEAT:.2g} s or "
            "less."
        )
