"""MJCF, compiled by MuJoCo: defaults, includes, units and inertias of geometry are its business.

Several joints of one body become a chain: one massless body for each joint but the last.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from linkwind.errors import InputError
from linkwind.mechanism.importers.model import ORIGIN, WORLD, Closure, Joint, Model, Part, Picture, Pose
from linkwind.mechanism.importers.motors import add_motors
from linkwind.mechanism.quaternion import inverse, matrix, product
from linkwind.native.tables import NQ, NV

KINDS = {0: "free", 1: "spherical", 2: "prismatic", 3: "revolute"}  # mjtJoint


def read(path: Path) -> Model:
    """Return the model of an MJCF file.

    Raises:
        InputError: MuJoCo is not installed, or refuses the file.
    """
    mujoco = _mujoco(path)
    warnings: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warnings.append)  # which would write a file otherwise
    try:
        model = _Reader(mujoco, mujoco.MjModel.from_xml_path(str(path)), path).model()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise InputError(f"{path}: MuJoCo refuses it: {' '.join(str(error).split())}. Correct it.") from None
    finally:
        mujoco.set_mju_user_warning(before)
    model.leave_out("warnings of MuJoCo", "it compiled the file all the same", dict.fromkeys(warnings))
    return model


def _mujoco(path: Path) -> Any:
    try:
        import mujoco
    except ImportError:
        raise InputError(
            f"{path}: expected MuJoCo to compile it; got none. Install it: pip install 'linkwind[mjcf]'."
        ) from None
    return mujoco


class _Reader:
    def __init__(self, mujoco: Any, compiled: Any, path: Path) -> None:
        self.mujoco, self.m, self.path = mujoco, compiled, path
        self.data = mujoco.MjData(compiled)  # at qpos0, where every joint is at its zero
        mujoco.mj_kinematics(compiled, self.data)
        mujoco.mj_comPos(compiled, self.data)

    def model(self) -> Model:
        m = self.m
        name = m.names[: m.names.index(b"\0")].decode(errors="replace")
        gravity = np.array(m.opt.gravity) * (not self._off("GRAVITY"))
        model = Model("MJCF", name or self.path.stem, [], gravity, pictures=self._pictures(0))
        last: dict[int, int] = {0: WORLD}  # the part at the end of each body's chain
        for body in range(1, m.nbody):
            parent = last[int(m.body_parentid[body])]
            joints = self._joints(body)
            for joint in joints[:-1]:
                massless = f"{self._name('BODY', body)}_{joint.name}"
                part = Part(massless, f"{self.path}: body", parent, joint, 0.0, joint.point, np.zeros((3, 3)))
                model.parts.append(part)
                parent = len(model.parts) - 1
            model.parts.append(self._part(body, parent, joints[-1]))
            last[body] = len(model.parts) - 1
        self._note_left_out(model)
        self._add_closures(model, last)
        add_motors(model, self.mujoco, m)
        return model

    def _name(self, kind: str, index: int) -> str:
        name = self.mujoco.mj_id2name(self.m, getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}"), index)
        return name or f"{kind.lower()}{index}"

    def _off(self, flag: str) -> bool:
        return bool(self.m.opt.disableflags & getattr(self.mujoco.mjtDisableBit, f"mjDSBL_{flag}"))

    def _joints(self, body: int) -> list[Joint]:
        first, count = int(self.m.body_jntadr[body]), int(self.m.body_jntnum[body])
        if not count:
            return [Joint(f"{self._name('BODY', body)}_fixed", "fixed", np.array(self.data.xpos[body]))]
        return [self._joint(joint) for joint in range(first, first + count)]

    def _joint(self, index: int) -> Joint:
        m, kind = self.m, KINDS[int(self.m.jnt_type[index])]
        point, axis = np.array(self.data.xanchor[index]), np.array(self.data.xaxis[index])
        joint = Joint(self._name("JOINT", index), kind, point)
        first = int(m.jnt_dofadr[index])
        damping = m.dof_damping[first : first + NV[kind]] * (not self._off("DAMPER"))
        joint.damping = damping.tolist() if np.ptp(damping) else float(damping[0])
        joint.stiffness = float(m.jnt_stiffness[index]) * (not self._off("SPRING"))
        if kind in ("revolute", "prismatic"):
            joint.axis = axis
            zero = float(m.qpos0[m.jnt_qposadr[index]])
            low, high = (float(end) - zero for end in m.jnt_range[index])
            joint.stop = (low, high) if m.jnt_limited[index] else None
        if joint.stiffness:
            joint.rest = self._rest(index, kind)
        return joint

    def _rest(self, index: int, kind: str) -> list[float]:
        """Return where the spring is relaxed, from the joint's zero, which is qpos0."""
        first = int(self.m.jnt_qposadr[index])
        relaxed, zero = (at[first : first + NQ[kind]] for at in (self.m.qpos_spring, self.m.qpos0))
        if kind in ("revolute", "prismatic"):
            return [float(relaxed[0] - zero[0])]
        to_world = np.array(self.data.xquat[self.m.jnt_bodyid[index]])
        turn = product(inverse(np.array(zero[-4:])), np.array(relaxed[-4:]))
        return [
            *(relaxed - zero)[:-4].tolist(),
            *product(product(to_world, turn), inverse(to_world)).tolist(),
        ]

    def _part(self, body: int, parent: int, joint: Joint) -> Part:
        m, data = self.m, self.data
        principal = np.array(data.ximat[body]).reshape(3, 3)
        inertia = principal @ np.diag(m.body_inertia[body]) @ principal.T
        name = self._name("BODY", body)
        item = f'{self.path}: <body name="{name}">'
        centre = np.array(data.xipos[body])
        return Part(
            name, item, parent, joint, float(m.body_mass[body]), centre, inertia, self._pictures(body)
        )

    def _pictures(self, body: int) -> list[Picture]:
        first, count = int(self.m.body_geomadr[body]), int(self.m.body_geomnum[body])
        geoms = range(first, first + count)
        seen = [g for g in geoms if not (self.m.geom_contype[g] or self.m.geom_conaffinity[g])] or geoms
        return [picture for g in seen if (picture := self._picture(g)) is not None]

    def _picture(self, geom: int) -> Picture | None:
        kinds, size = self.mujoco.mjtGeom, np.array(self.m.geom_size[geom])
        kind = kinds(int(self.m.geom_type[geom]))
        pose = Pose(np.array(self.data.geom_xpos[geom]), np.array(self.data.geom_xmat[geom]).reshape(3, 3))
        if kind == kinds.mjGEOM_BOX:
            return Picture({"type": "box", "size": (2.0 * size).tolist()}, pose)
        if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_ELLIPSOID):
            axes = np.full(3, size[0]) if kind == kinds.mjGEOM_SPHERE else size
            return Picture({"type": "ellipsoid", "size": (2.0 * axes).tolist()}, pose)
        if kind in (kinds.mjGEOM_CYLINDER, kinds.mjGEOM_CAPSULE):
            name = "cylinder" if kind == kinds.mjGEOM_CYLINDER else "capsule"
            return Picture({"type": name, "diameter": 2.0 * size[0], "length": 2.0 * size[1]}, pose)
        if kind == kinds.mjGEOM_MESH:
            return self._mesh(int(self.m.geom_dataid[geom]), pose)
        return None

    def _mesh(self, mesh: int, pose: Pose) -> Picture | None:
        """Return a mesh where its file is; MuJoCo has moved its frame to its centre of mass."""
        at = int(self.m.mesh_pathadr[mesh])
        if at < 0:
            return None
        file = self.m.paths[at : self.m.paths.index(b"\0", at)].decode(errors="replace")
        moved = Pose(np.array(self.m.mesh_pos[mesh]), matrix(np.array(self.m.mesh_quat[mesh])))
        back = Pose(-moved.rotation.T @ moved.position, moved.rotation.T)
        keys: dict[str, Any] = {"type": "mesh", "file": (self.path.parent / file).resolve().as_uri()}
        scale = np.array(self.m.mesh_scale[mesh]).tolist()
        return Picture(keys if scale == [1.0, 1.0, 1.0] else keys | {"scale": scale}, pose.then(back))

    def _add_closures(self, model: Model, last: Mapping[int, int]) -> None:
        """Add what closes loops; other equality constraints are left out."""
        kinds, m = self.mujoco.mjtEq, self.m
        types = {kinds.mjEQ_CONNECT: "spherical", kinds.mjEQ_WELD: "fixed"}
        for index in range(m.neq):
            name, kind = self._name("EQUALITY", index), kinds(int(m.eq_type[index]))
            bodies, ends = self._ends(index)
            if kind not in types or not m.eq_active0[index]:
                why = "they do not hold"
            elif kind == kinds.mjEQ_WELD and np.abs(ends[0].rotation - ends[1].rotation).max() > 1e-6:
                why = "they are twisted at the joints' zero"
            else:
                points = np.array([end.position for end in ends])
                parts = last[bodies[0]], last[bodies[1]]
                model.closures.append(Closure(name, types[kind], parts, points))
                continue
            model.leave_out("equality constraints", why, [name])

    def _ends(self, index: int) -> tuple[tuple[int, int], tuple[Pose, Pose]]:
        """Return the bodies of a connect or weld, and the frames that it makes coincide, at qpos0."""
        m, data = self.m, self.data
        ids = int(m.eq_obj1id[index]), int(m.eq_obj2id[index])
        if m.eq_objtype[index] == self.mujoco.mjtObj.mjOBJ_SITE:
            sites = [Pose(data.site_xpos[site], data.site_xmat[site].reshape(3, 3)) for site in ids]
            return (int(m.site_bodyid[ids[0]]), int(m.site_bodyid[ids[1]])), (sites[0], sites[1])
        if m.eq_objtype[index] != self.mujoco.mjtObj.mjOBJ_BODY:
            return (0, 0), (ORIGIN, ORIGIN)
        first, second = (Pose(data.xpos[body], data.xmat[body].reshape(3, 3)) for body in ids)
        given = np.array(m.eq_data[index])
        if m.eq_type[index] == self.mujoco.mjtEq.mjEQ_WELD:
            own = Pose(given[3:6], matrix(given[6:10])), Pose(given[0:3], np.eye(3))
        else:
            own = Pose(given[0:3], np.eye(3)), Pose(given[3:6], np.eye(3))
        return ids, (first.then(own[0]), second.then(own[1]))

    def _note_left_out(self, model: Model) -> None:
        m, out = self.m, model.leave_out
        joints = [self._name("JOINT", j) for j in range(m.njnt)]
        of = [joints[j] for j in m.dof_jntid]
        bodies = [self._name("BODY", b) for b in range(m.nbody)]
        cones = np.array(m.jnt_limited) * (np.array(m.jnt_type) == 1)  # of balls
        out("joint limits", "spherical joints have no end", _each(joints, cones))
        out("joint frictions", "dry friction is not modelled", _each(of, m.dof_frictionloss))
        out("armatures", "rotors have no inertia: the motion is another", _each(of, m.dof_armature))
        rotors = getattr(m, "actuator_armature", np.zeros(0))  # of a later version of MuJoCo
        actuators = [self._name("ACTUATOR", i) for i in range(len(rotors))]
        out("armatures", "rotors have no inertia: the motion is another", _each(actuators, rotors))
        out(
            "springs not linear",
            "only their linear part is there",
            _each(joints, getattr(m, "jnt_stiffnesspoly", None)),
        )
        out(
            "dampers not linear",
            "only their linear part is there",
            _each(of, getattr(m, "dof_dampingpoly", None)),
        )
        for what, why, kind, count in (
            ("tendons", "there are none, nor their springs, dampers and limits", "TENDON", m.ntendon),
            ("sensors", "they do not matter to the motion", "SENSOR", m.nsensor),
            ("keyframes", "the start is the joints' zero, or --at", "KEY", m.nkey),
            ("flexible bodies", "bodies are rigid: their vertices fly apart", "FLEX", m.nflex),
        ):
            out(what, why, [self._name(kind, i) for i in range(count)])
        out("gravity compensations", "gravity acts on all bodies", _each(bodies, m.body_gravcomp))
        driven = np.array(m.body_mocapid) >= 0
        out("motion captures", "the bodies stay where they are", _each(bodies, driven))
        out("plugins", "they belong to MuJoCo", _each(bodies, np.array(m.body_plugin) >= 0))
        touching = np.array(m.body_contype) | np.array(m.body_conaffinity)
        out("contacts", "bodies do not touch", _each(bodies, touching))
        if m.opt.density or m.opt.viscosity or np.any(m.opt.wind):
            item = f"density {m.opt.density:g} kg/m³, viscosity {m.opt.viscosity:g} Pa·s"
            out("forces of a fluid", "[aero] has models of its own", [item])


def _each(names: list[str], values: Any) -> list[str]:
    """Return the names with a value that is not zero, each once, in order."""
    if values is None:  # of a later version of MuJoCo
        return []
    rows = np.reshape(np.asarray(values), (len(names), -1)) if len(names) else np.zeros((0, 1))
    return list(dict.fromkeys(name for name, row in zip(names, rows, strict=True) if np.any(row)))
