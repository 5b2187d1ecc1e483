"""Runs to report on, made without linkwind: the paper's two links in a gust, and a flapper in 3-D."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from linkwind.log.tables import Trajectory
from linkwind.report.data import Run

MASS, INERTIA, LC, G = 2.0, 1.4, 0.25, 9.81
PI2 = 2 * np.pi


def scenario(**changes):
    link = {"mass": MASS, "inertia": INERTIA, "shape": {"type": "plate", "length": 0.5, "span": 1.0}}
    return {
        "name": "two_link_gust",
        "description": "Two links on a hinge in a gusty wind of 5 m/s.",
        "time": {"end": 1.2},
        "environment": {"gravity": [0.0, -G, 0.0], "density": 1.225, "wind": [-5.0, 0.0, 0.0], "gusts": []},
        "bodies": [{"name": "link1", "position": [0.0, 0.0, 0.0], **link}, {"name": "link2", **link}],
        "joints": [
            {
                "name": "hinge",
                "type": "revolute",
                "parent": "link1",
                "child": "link2",
                "parent_point": [-LC, 0.0, 0.0],
                "child_point": [-LC, 0.0, 0.0],
                "axis": [0.0, 0.0, 1.0],
            }
        ],
        "providers": [{"name": "aero", "model": "field", "bodies": ["link1", "link2"], "every": 1}],
        "dynamics": {"method": "reduced", "integrator": "rk4", "substeps": 1},
        "coupling": {"scheme": "pec", "order": 3, "adaptive": True, "step": 1e-3},
        "bus": {"transport": "zenoh"},
        **changes,
    }


def points(theta):
    """The hinge from each centre of mass."""
    return -LC * np.column_stack([np.cos(theta), np.sin(theta)])


def gust(t, at, velocity, theta, omega):
    """F1 of the paper's facts: wrench (fx, fy, torque) of both bodies."""
    (x, y), b = at.T, np.arange(2)
    gx = 1 + 0.3 * np.sin(PI2 * (12 * t + 1.3 * x)) + 0.2 * np.sin(PI2 * (35 * t - 0.9 * y + 0.3 * b))
    gy = 0.3 * np.cos(PI2 * (17 * t + 1.1 * y)) + 0.2 * np.sin(PI2 * (29 * t + x))
    u = np.column_stack([-5 * gx, 5 * gy]) - velocity
    n, e = np.column_stack([-np.sin(theta), np.cos(theta)]), np.column_stack([np.cos(theta), np.sin(theta)])
    un, ue, size = (u * n).sum(1), (u * e).sum(1), np.linalg.norm(u, axis=1)
    fn, fe = 2.2 * 0.3 * un * size, 0.2 * 0.3 * ue * np.abs(ue)
    force = fn[:, None] * n + fe[:, None] * e
    return np.column_stack([force, -0.08 * fn * ue / size - 0.15 * omega * np.abs(un)])


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def two_links(t, state):
    """All that Newton and Euler say of the two links at one time, with the hinge force as an unknown."""
    x1, y1, *theta = state[:4]
    vx1, vy1, *omega = state[4:8]
    theta, omega = np.array(theta), np.array(omega)
    p = points(theta)
    side = np.column_stack([-p[:, 1], p[:, 0]])  # d(p)/dθ
    at = np.array([[x1, y1], [x1, y1] + p[0] - p[1]])
    velocity = np.array([[vx1, vy1], [vx1, vy1] + omega[0] * side[0] - omega[1] * side[1]])
    wrench = gust(t, at, velocity, theta, omega)
    # Unknown: a1 (2), a2 (2), α (2), hinge force on body 2 (2).
    matrix, right = np.zeros((8, 8)), np.zeros(8)
    for b, sign in ((0, -1.0), (1, 1.0)):
        rows = slice(2 * b, 2 * b + 2)
        matrix[rows, rows] = MASS * np.eye(2)
        matrix[rows, 6:] = -sign * np.eye(2)
        right[rows] = wrench[b, :2] + [0.0, -MASS * G]
        matrix[4 + b, 4 + b] = INERTIA
        matrix[4 + b, 6:] = -sign * np.array([-p[b, 1], p[b, 0]])
        right[4 + b] = wrench[b, 2]
        matrix[6:, rows] = sign * np.eye(2)
        matrix[6:, 4 + b] = sign * side[b]
        right[6:] += sign * omega[b] ** 2 * p[b]
    solution = np.linalg.solve(matrix, right)
    power = (wrench[:, :2] * velocity).sum() + wrench[:, 2] @ omega
    return at, velocity, theta, omega, wrench, solution, power


def derivative(t, state):
    *_, solution, power = two_links(t, state)
    return np.concatenate([state[4:8], solution[:2], solution[4:6], [power]])


def planar(steps=1200, **changes) -> Run:
    """The two links for 1.2 s, or less with fewer steps; integrated with DOP853."""
    t = np.arange(steps + 1) * 1e-3
    start = [0, 0, np.pi - 0.3, 0.3, -0.5, 0.2, 0.6, -0.4, 0.0]
    if steps:
        states = solve_ivp(derivative, (0, t[-1]), start, "DOP853", t, rtol=1e-10, atol=1e-10).y.T
    else:
        states = np.array([start])
    known = [two_links(*pair) for pair in zip(t, states, strict=True)]
    at, velocity, theta, omega, force, solution = (
        np.array(part) for part in list(zip(*known, strict=True))[:6]
    )
    k = len(t)

    def pad(xy, z):  # (k, 2, 2) and (k, 2) to (k, 2, 6): forces or linear in x, y; turning about z
        return np.concatenate([xy, np.zeros((k, 2, 3)), z[:, :, None]], axis=2)

    zeros = np.zeros((k, 2))
    reaction = np.stack([np.zeros((k, 2)), solution[:, 6:]], axis=1)
    half = theta / 2
    random = np.random.default_rng(7)
    kinetic = 0.5 * MASS * (velocity**2).sum((1, 2)) + 0.5 * INERTIA * (omega**2).sum(1)
    potential = MASS * G * at[:, :, 1].sum(1)
    path = Trajectory(
        step=np.arange(k, dtype=np.uint64),
        t=t,
        position=np.dstack([at, zeros]),
        orientation=np.dstack([np.cos(half), zeros, zeros, np.sin(half)]),
        linear=np.dstack([velocity, zeros]),
        angular=np.dstack([zeros, zeros, omega]),
        q=states[:, :4],
        v=states[:, 4:8],
        acceleration=pad(solution[:, :4].reshape(k, 2, 2), solution[:, 4:6]),
        reaction=pad(reaction, zeros),
        wrench=pad(force[:, :, :2], force[:, :, 2]),
        kinetic_energy=kinetic,
        potential_energy=potential,
        external_work=states[:, 8],
        dissipated_work=np.zeros(k),
        joint_gap=np.abs(random.normal(0, 2e-16, k)),
        closure_reaction=np.zeros((k, 0, 6)),
        event_time=np.zeros((k, 0)),
        force_effort=np.zeros((k, 0)),
        force_power=np.zeros((k, 0)),
    )
    errors = 10.0 ** random.normal([0, -1, -2, -2.5], 0.4, (k, 4))
    return run_of(scenario(**changes), path, errors)


def run_of(description, path, errors, **changes) -> Run:
    k = len(path.t)
    random = np.random.default_rng(8)
    order = np.minimum(np.arange(k), np.where(np.arange(k) % 400 > 370, 2, 3))
    values = {
        "scenario": description,
        "complete": True,
        "error": None,
        "versions": {"linkwind": "0.1.0", "python": "3.11.2"},
        "trajectory": path,
        "coupling_time": path.t,
        "order": order,
        "extrapolation_error": errors,
        "interface_energy": 1e-7 * random.normal(size=k),
        "exchange": random.lognormal(np.log(70e-6), 0.25, k),
    }
    return Run(**{**values, **changes})


def flapper(steps=800) -> Run:
    """A body with two wings that beat while it climbs and turns: prescribed, not solved."""
    t = np.arange(steps + 1) * 1e-3
    k = len(t)
    names = ["body", "left", "right"]
    turn = Rotation.from_euler("ZX", np.column_stack([0.9 * t, np.zeros(k)]))
    beat = 0.9 * np.sin(PI2 * 5 * t)
    beats = [turn * Rotation.from_rotvec(side * beat[:, None] * [1.0, 0.0, 0.0]) for side in (1.0, -1.0)]
    centre = np.column_stack([np.cos(0.9 * t), np.sin(0.9 * t), 0.4 * t + 0.03 * np.sin(PI2 * 5 * t)])
    roots = [np.array([0.0, side * 0.04, 0.0]) for side in (1.0, -1.0)]
    arms = [np.array([0.0, side * 0.25, 0.0]) for side in (1.0, -1.0)]
    places = zip(roots, beats, arms, strict=True)
    wings = [centre + turn.apply(root) + w.apply(arm) for root, w, arm in places]
    position = np.stack([centre, *wings], axis=1)
    # The plate's chord lies along x and its span along z: turned so that the span runs along the wing.
    lay = Rotation.from_euler("X", 90, degrees=True)
    turns = [turn] + [w * lay for w in beats]
    orientation = np.stack([np.roll(r.as_quat(), 1, axis=1) for r in turns], axis=1)
    linear = np.gradient(position, t, axis=0)
    wrench = np.zeros((k, 3, 6))
    wrench[:, 1:, 2] = (3.0 - 6.0 * np.cos(PI2 * 5 * t))[:, None]
    wrench[:, 0, 0] = -0.5
    bodies = [{"name": names[0], "mass": 0.3, "inertia": [1e-3] * 3 + [0.0] * 3}]
    wing = {"mass": 0.05, "inertia": [1e-4] * 3 + [0.0] * 3}
    wing["shape"] = {"type": "plate", "length": 0.2, "span": 0.5}
    bodies += [{"name": name, **wing} for name in names[1:]]
    joints = [
        {
            "name": f"{name}_root",
            "type": "spherical",
            "parent": "body",
            "child": name,
            "parent_point": root.tolist(),
            "child_point": lay.inv().apply(-arm).tolist(),
        }
        for name, root, arm in zip(names[1:], roots, arms, strict=True)
    ]
    description = scenario(
        name="flapper", description="A body with two wings.", bodies=bodies, joints=joints, time={"end": 0.8}
    )
    description["environment"] = {
        "gravity": [0.0, 0.0, -G],
        "density": 1.2,
        "wind": [-1.0, 0.0, 0.0],
        "gusts": [{"amplitude": [1.0, 0.0, 0.0], "frequency": 2.0, "wavenumber": [0.0, 0.0, 0.0]}],
    }
    path = Trajectory(
        step=np.arange(k, dtype=np.uint64),
        t=t,
        position=position,
        orientation=orientation,
        linear=linear,
        angular=np.zeros((k, 3, 3)),
        q=np.zeros((k, 0)),
        v=np.zeros((k, 0)),
        acceleration=np.zeros((k, 3, 6)),
        reaction=0.5 * wrench,
        wrench=wrench,
        kinetic_energy=0.5 * (linear**2).sum((1, 2)),
        potential_energy=G * position[:, :, 2].sum(1),
        external_work=t.copy(),
        dissipated_work=np.zeros(k),
        joint_gap=np.full(k, 1e-16),
        closure_reaction=np.zeros((k, 0, 6)),
        event_time=np.zeros((k, 0)),
        force_effort=np.zeros((k, 0)),
        force_power=np.zeros((k, 0)),
    )
    return run_of(description, path, np.full((k, 4), np.nan))


def repeated(run, times):
    """A longer run, made of the same one over and over."""
    path = run.trajectory
    long = Trajectory(*(np.concatenate([part] * times) for part in path))
    long = long._replace(t=np.arange(len(long.t)) * 1e-3)
    return run_of(run.scenario, long, np.ones((len(long.t), 4)))
