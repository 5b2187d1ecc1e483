"""Forward dynamics of revolute chains and of two_link: the core, MuJoCo and Pinocchio, in turn.

What is timed, without forces or contacts, at one random state, the fastest of several rounds:

- the core: ``lw_multibody_repeat``, a loop in C over kinematics and articulated bodies;
- MuJoCo: ``mj_forward`` with constraints, contacts and sensors off, called from Python;
- Pinocchio: ``pinocchio.aba`` called from Python.

A call from Python costs the peers about 0.3 µs. The targets come from a machine on which Pinocchio took
0.76 µs for two links: 0.25 µs for the core there is a ratio of 0.33, 0.35 µs for two_link one of 0.46.
Run with ``python -m tests.benchmarks core``.
"""

from __future__ import annotations

import timeit
from collections.abc import Callable
from typing import Any

import numpy as np

from linkwind.native.multibody import Integrator, Multibody
from linkwind.spatial import Motion
from tests.native.mechanisms import Body, tables, two_link

ROUNDS = 7
SIZES = (2, 10, 50, 200)
INERTIA = np.diag([0.7, 0.7, 1.4])
Timed = dict[str, Callable[[int], object]]  # name -> evaluate that many times


def chain(n: int) -> list[Body]:
    """Links of the paper in a row, hinged at their ends, the first to the world."""
    first = Body(-1, "revolute", 2.0, INERTIA, child_point=(-0.25, 0.0, 0.0))
    return [first] + [
        Body(k, "revolute", 2.0, INERTIA, (0.25, 0.0, 0.0), (-0.25, 0.0, 0.0)) for k in range(n - 1)
    ]


def ours(bodies: list[Body]) -> Timed:
    multibody = Multibody(tables(bodies))
    rng = np.random.default_rng(1)
    state = multibody.initial_state(rng.normal(size=multibody.nq), rng.normal(size=multibody.nv))
    return {"linkwind": lambda count: multibody.repeat(state, count)}


def mujoco_chain(n: int, planar: bool) -> Timed:
    try:
        import mujoco
    except ImportError:
        return {}
    slides = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>' if planar else ""
    body = '<body pos="{} 0 0"><inertial pos="0.25 0 0" mass="2" diaginertia="0.7 0.7 1.4"/>{}'
    hinge = '<joint type="hinge" axis="0 0 1"/>'
    links = "".join(body.format(0.5 if k else 0, (slides if k == 0 else "") + hinge) for k in range(n))
    flags = '<option><flag contact="disable" constraint="disable" sensor="disable"/></option>'
    xml = f"<mujoco>{flags}<worldbody>{links}{'</body>' * n}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    data.qpos[:], data.qvel[:] = rng.normal(size=model.nq), rng.normal(size=model.nv)

    def evaluate(count: int) -> None:
        for _ in range(count):
            mujoco.mj_forward(model, data)

    return {"MuJoCo": evaluate}


def pinocchio_chain(n: int, planar: bool) -> Timed:
    try:
        import pinocchio
    except ImportError:
        return {}
    model, parent = pinocchio.Model(), 0
    for k in range(n):
        placement = pinocchio.SE3(np.eye(3), np.array([0.5 if k else 0.0, 0.0, 0.0]))
        joint = pinocchio.JointModelPlanar() if planar and k == 0 else pinocchio.JointModelRZ()
        parent = model.addJoint(parent, joint, placement, f"joint{k}")
        inertia = pinocchio.Inertia(2.0, np.array([0.25, 0.0, 0.0]), np.diag([0.7, 0.7, 1.4]))
        model.appendBodyToJoint(parent, inertia, pinocchio.SE3.Identity())
    data, q = model.createData(), pinocchio.neutral(model)
    v, torque = np.random.default_rng(1).normal(size=model.nv), np.zeros(model.nv)

    def evaluate(count: int) -> None:
        for _ in range(count):
            pinocchio.aba(model, data, q, v, torque)

    return {"Pinocchio": evaluate}


def fastest(timed: Timed, count: int) -> dict[str, float]:
    """Return µs per evaluation, the best of several rounds that take turns."""
    best = dict.fromkeys(timed, float("inf"))
    for _ in range(ROUNDS):
        for name, evaluate in timed.items():
            seconds = timeit.timeit(lambda evaluate=evaluate: evaluate(count), number=1)
            best[name] = min(best[name], 1e6 * seconds / count)
    return best


def row(
    case: str, quantity: str, value: float, reference: float | None, target: float | None
) -> dict[str, Any]:
    ratio = None if reference is None else value / reference
    ok = None if target is None or ratio is None else bool(ratio <= target)
    return {
        "case": case,
        "quantity": quantity,
        "value": value,
        "reference": reference,
        "ratio": ratio,
        "ok": ok,
    }


def evaluations() -> list[dict[str, Any]]:
    rows, core = [], {}
    cases = [(f"chain of {n}", chain(n), n, False) for n in SIZES]
    for case, bodies, n, planar in [*cases, ("two_link", two_link(), 2, True)]:
        timed = ours(bodies) | mujoco_chain(n, planar) | pinocchio_chain(n, planar)
        best = fastest(timed, max(200, 20_000 // n))
        core[case] = best.pop("linkwind")
        rows += [row(case, f"µs / {peer}", core[case], time, 1.0) for peer, time in best.items()]
        if n == 2 and "Pinocchio" in best and not planar:
            two_links = best["Pinocchio"]
            rows.append(row(case, "µs / target of the yardstick", core[case], two_links, 0.33))
    if any(r["case"] == "chain of 2" and "yardstick" in r["quantity"] for r in rows):
        rows.append(row("two_link", "µs / target of the yardstick", core["two_link"], two_links, 0.46))
    rows.append(
        row("chain of 200", "µs / chain of 50, linear is 4", core["chain of 200"], core["chain of 50"], 6.0)
    )
    return rows


def calls() -> list[dict[str, Any]]:
    """A macro step and a motion from Python against the evaluations that they contain."""
    multibody = Multibody(tables(two_link()))
    state, out = multibody.initial_state([0, 0, 1.0, 0.5], [1.0, 2.0, 3.0, 4.0]), Motion.at_rest(2)
    nodes, wrenches, added = np.array([-1.0, 0.0, 1.0]), np.ones((3, 2, 6)), np.tile(np.eye(6), (2, 1, 1))

    def advance(count: int) -> None:
        for _ in range(count):
            multibody.advance(state, 1e-3, nodes, wrenches, added, integrator=Integrator.RK4)

    def motion(count: int) -> None:
        for _ in range(count):
            multibody.motion(state, out)

    best = fastest(ours(two_link()) | {"advance": advance, "motion": motion}, 5000)
    evaluation = best["linkwind"]
    return [
        row("two_link", "advance rk4, µs / 4 evaluations", best["advance"], 4 * evaluation, None),
        row("two_link", "motion, µs / evaluation", best["motion"], evaluation, None),
    ]


def main() -> list[dict[str, Any]]:
    """Return the rows; peers that are not installed are left out."""
    return evaluations() + calls()


if __name__ == "__main__":
    for line in main():
        print(line)
