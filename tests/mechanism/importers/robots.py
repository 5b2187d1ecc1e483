"""Robot files of our own, and what MuJoCo makes of the same files."""

from __future__ import annotations

import mujoco
import numpy as np

from linkwind.mechanism import Mechanism, build
from linkwind.native.multibody import NQ, NV, Multibody
from linkwind.scenario import Scenario

TYPES = ["revolute", "continuous", "prismatic", "fixed"]
NAMES = {0: "free", 1: "spherical", 2: "prismatic", 3: "revolute"}


def numbers(values) -> str:
    return " ".join(repr(float(x)) for x in np.ravel(values))


def random_urdf(seed: int, n: int = 10, roots: str = "") -> str:
    """A tree with frames turned in every way; ``roots`` is XML between the world and the first link."""
    rng = np.random.default_rng(seed)
    parts = [
        '<link name="world"/>',
        roots or '<joint name="j0" type="fixed">' + ends("world", 0) + "</joint>",
    ]
    for i in range(n):
        principal = rng.uniform(0.65, 1.0, 3) * rng.uniform(0.1, 0.5)
        six = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (*principal, 0.01, -0.008, 0.005), strict=True)
        moments = " ".join(f'{key}="{float(value)!r}"' for key, value in six)
        parts.append(
            f'<link name="l{i}"><inertial>{origin(rng)}<mass value="{float(rng.uniform(0.5, 3))!r}"/>'
            f"<inertia {moments}/></inertial></link>"
        )
        if i:
            kind = TYPES[(i + seed) % 4]
            parts.append(
                f'<joint name="j{i}" type="{kind}">{origin(rng)}{ends(f"l{rng.integers(i)}", i)}'
                f'<axis xyz="{numbers(unit(rng))}"/><limit lower="-9" upper="9" effort="1" velocity="1"/>'
                f'<dynamics damping="{float(rng.uniform(0, 0.3))!r}"/></joint>'
            )
    return f'<robot name="random">{"".join(parts)}</robot>'


def unit(rng):
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def origin(rng) -> str:
    return f'<origin xyz="{numbers(rng.normal(size=3) * 0.4)}" rpy="{numbers(rng.uniform(-3, 3, 3))}"/>'


def ends(parent: str, child: int) -> str:
    return f'<parent link="{parent}"/><child link="l{child}"/>'


class Pair:
    """The same mechanism in the core and in MuJoCo, which has its own readers of both formats."""

    def __init__(self, scenario: Scenario, compiled: mujoco.MjModel) -> None:
        self.m, self.d = compiled, mujoco.MjData(compiled)
        flags = ("CONSTRAINT", "ACTUATION", "CONTACT")
        for flag in flags:
            self.m.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))
        self.m.dof_armature[:] = 0.0
        self.m.opt.gravity[:] = scenario.environment.gravity
        mujoco.mj_setConst(self.m, self.d)
        mujoco.mj_resetData(self.m, self.d)
        mujoco.mj_forward(self.m, self.d)
        self.frames = self.d.xmat.reshape(-1, 3, 3).copy()  # at qpos0
        self.quaternions = self.d.xquat.copy()
        self.mechanism: Mechanism = build(scenario)
        self.core = Multibody(self.mechanism.tables, self.mechanism.bodies)
        self.joints = list(range(self.m.njnt))

    def place(self, joint: int) -> int:
        """Our index of MuJoCo's joint; a free one is found by its body."""
        name = mujoco.mj_id2name(self.m, mujoco.mjtObj.mjOBJ_JOINT, joint)
        body = mujoco.mj_id2name(self.m, mujoco.mjtObj.mjOBJ_BODY, self.m.jnt_bodyid[joint])
        names = self.mechanism.joints
        return names.index(name) if name in names else names.index(f"world-{body}")

    def random_state(self, seed: int):
        """The same state of both, free bodies apart, which start as they are; ours is returned."""
        rng, t = np.random.default_rng(seed), self.mechanism.tables
        q, v = self.mechanism.q0.copy(), self.mechanism.v0.copy()
        mujoco.mj_resetData(self.m, self.d)
        for joint in self.joints:
            kind, place = NAMES[self.m.jnt_type[joint]], self.place(joint)
            at, of = self.m.jnt_qposadr[joint], self.m.jnt_dofadr[joint]
            ours, rates = t.q_index[place], t.v_index[place]
            if kind == "free":
                continue
            speed = rng.normal(size=NV[kind])
            self.d.qvel[of : of + NV[kind]] = speed
            if kind == "spherical":
                turn = unit4(rng)
                self.d.qpos[at : at + 4] = turn
                frame = self.quaternions[self.m.jnt_bodyid[joint]]
                q[ours : ours + 4] = conjugated(turn, frame)
                v[rates : rates + 3] = self.frames[self.m.jnt_bodyid[joint]] @ speed
            else:
                angle = rng.uniform(-1.5, 1.5)
                self.d.qpos[at : at + NQ[kind]] = self.m.qpos0[at] + angle
                q[ours], v[rates] = angle, speed[0]
        mujoco.mj_forward(self.m, self.d)
        return self.core.initial_state(q, v)

    def accelerations(self, state):
        """Ours and MuJoCo's, joint by joint in the same frames; of free bodies those of the body."""
        found = self.core.evaluate(state, np.zeros((self.core.n, 6)))
        mujoco.mj_rnePostConstraint(self.m, self.d)
        ours, theirs = [], []
        for joint in self.joints:
            kind, place = NAMES[self.m.jnt_type[joint]], self.place(joint)
            body, of = self.m.jnt_bodyid[joint], self.m.jnt_dofadr[joint]
            if kind == "free":
                both = np.zeros(6)
                mujoco.mj_objectAcceleration(self.m, self.d, mujoco.mjtObj.mjOBJ_BODY, body, both, 0)
                ours.append(found.acceleration[place][3:])
                theirs.append(both[:3])
                continue
            rates = self.mechanism.tables.v_index[place]
            frame = self.frames[body] if kind == "spherical" else np.eye(1)
            ours.append(found.joint_acceleration[rates : rates + NV[kind]])
            theirs.append(frame @ self.d.qacc[of : of + NV[kind]])
        return np.concatenate(ours), np.concatenate(theirs)

    def differ(self, seeds) -> float:
        """Largest difference of accelerations, relative to the largest acceleration."""
        worst = 0.0
        for seed in seeds:
            ours, theirs = self.accelerations(self.random_state(seed))
            worst = max(worst, np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max()))
        return worst


def unit4(rng):
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


def conjugated(turn, frame):
    """The turn, given in a frame that is ``frame`` in the world, in the world's axes."""
    back, half, whole = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_negQuat(back, frame)
    mujoco.mju_mulQuat(half, frame, turn)
    mujoco.mju_mulQuat(whole, half, back)
    return whole
