"""Rows of four-bars and chains in other tools, each by its own means: what ``bench_loops`` times.

All return a ``Flight``: it starts anew, goes on to each of some times, and returns where the tip is then.
Rods are of 1 m and 1 kg, and move in the x, y plane. A tool that is not installed raises ImportError.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from linkwind.native.multibody import Integrator, Multibody
from tests.native.loops import four_bars
from tests.native.mechanisms import Body, motion_of, tables

ROD = np.diag([1 / 24, 1 / 24, 1 / 12])
Flight = Callable[[np.ndarray], np.ndarray]
"""Takes times [s], shape (m,), returns x, y of the tip at them [m], shape (m, 2)."""


def chain(count: int) -> tuple[Multibody, np.ndarray]:
    """Rods in a row on hinges, the first on the world, released level."""
    rods = [Body(i - 1, "revolute", 1.0, ROD, (0.5 if i else 0, 0, 0), (-0.5, 0, 0)) for i in range(count)]
    multibody = Multibody(tables(rods))
    return multibody, multibody.initial_state(np.zeros(count), np.zeros(count))


def linkwind(case: str, count: int, integrator: Integrator, step: float, **how: float) -> Flight:
    """The C core, called from Python once from each time to the next."""
    multibody, start = (four_bars if case == "four-bars" else chain)(count)
    tip = 0 if case == "four-bars" else count - 1
    held, calm = np.zeros(1), np.zeros((1, multibody.n, 6))

    def fly(times: np.ndarray) -> np.ndarray:
        state, now, path = start, 0.0, []
        for t in times:
            substeps = 1 if integrator == Integrator.DOPRI5 else max(1, round((t - now) / step))
            state, _ = multibody.advance(
                state, t - now, held, calm, None, integrator=integrator, substeps=substeps, **how
            )
            motion, now = motion_of(multibody, state), t
            w, _, _, z = motion.orientation[tip]
            path.append(motion.position[tip, :2] + [0.5 * (w * w - z * z), w * z])
        return np.array(path)

    return fly


def _mujoco_xml(case: str, count: int, step: float, integrator: str) -> str:
    rod = '<inertial pos="0.5 0 0" mass="1" diaginertia="0.0416666667 0.0416666667 0.08333333333333333"/>'
    hinge = '<joint type="hinge" axis="0 0 1"/>'
    if case == "chain":
        place = ['<body pos="0 0 0">', *['<body pos="1 0 0">'] * (count - 1)]
        bodies = "".join(f"{p}{hinge}{rod}" for p in place) + "</body>" * count
        loops = ""
    else:
        bodies, turn = "", '<body name="{}" pos="{} 0 0" euler="0 0 {}">'
        for i in range(count + 1):
            inner = f"{turn.format(f'k{i}', 1, -90)}{hinge}{rod}</body>" if i < count else ""
            bodies += f"{turn.format(f'c{i}', i, 90)}{hinge}{rod}{inner}</body>"
        loops = "".join(f'<connect body1="k{i}" body2="c{i + 1}" anchor="1 0 0"/>' for i in range(count))
    return f"""<mujoco><option timestep="{step!r}" integrator="{integrator}" gravity="0 -9.81 0"
        iterations="100" tolerance="1e-14"><flag contact="disable" sensor="disable"/></option><default>
        <equality solref="{2 * step!r} 1" solimp="0.9999 0.9999 0.001"/></default>
        <worldbody>{bodies}</worldbody><equality>{loops}</equality></mujoco>"""


def mujoco(case: str, count: int, integrator: str, step: float) -> Flight:
    """MuJoCo: loops by soft constraints as stiff as the step allows; ``mj_step`` makes many steps."""
    import mujoco as mj

    model = mj.MjModel.from_xml_string(_mujoco_xml(case, count, step, integrator))
    data = mj.MjData(model)
    tip = model.body("c0").id if case == "four-bars" else model.nbody - 1

    def fly(times: np.ndarray) -> np.ndarray:
        mj.mj_resetData(model, data)
        if case == "four-bars":
            data.qvel[:] = [*[-1.0, 1.0] * count, -1.0]
        path, now = [], 0.0
        for t in times:
            mj.mj_step(model, data, nstep=round((t - now) / step))
            mj.mj_kinematics(model, data)
            now = t
            path.append((data.xpos[tip] + data.xmat[tip].reshape(3, 3)[:, 0])[:2])
        return np.array(path)

    return fly


class Pinocchio:
    """Pinocchio through its Python binding: ``aba`` or ``constraintDynamics``, RK4 in numpy."""

    def __init__(self, case: str, count: int, step: float) -> None:
        import pinocchio as pin

        self.pin, self.step, self.four_bars = pin, step, case == "four-bars"
        model = self.model = pin.Model()
        model.gravity.linear = np.array([0.0, -9.81, 0.0])
        self.contacts = pin.StdVec_RigidConstraintModel()
        if self.four_bars:
            cranks, couplers = [self._rod(0, 0.0)], []
            for i in range(count):  # branch after branch, as its Cholesky factors need it
                couplers.append(self._rod(cranks[i], 1.0))
                cranks.append(self._rod(0, i + 1.0))
            end = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
            for coupler, crank in zip(couplers, cranks[1:], strict=True):
                joined = (coupler, end, crank, end, pin.ReferenceFrame.LOCAL)
                self.contacts.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *joined))
            self.q0 = np.array([*[np.pi / 2, -np.pi / 2] * count, np.pi / 2])
            self.v0 = np.array([*[-1.0, 1.0] * count, -1.0])
        else:
            parent = 0
            for i in range(count):
                parent = self._rod(parent, 1.0 if i else 0.0)
            self.q0, self.v0 = np.zeros(count), np.zeros(count)
        self.data, self.torque = model.createData(), np.zeros(model.nv)
        if self.four_bars:
            self.contact_data = pin.StdVec_RigidConstraintData()
            for contact in self.contacts:  # without stabilisation it does not get over singular positions
                contact.m_baumgarte_parameters.Kp, contact.m_baumgarte_parameters.Kd = 100.0, 20.0
                self.contact_data.append(contact.createData())
            self.proximal = pin.ProximalSettings(1e-14, 1e-10, 20)
            pin.initConstraintDynamics(model, self.data, self.contacts, self.contact_data)

    def _rod(self, parent: int, x: float) -> int:
        pin, place = self.pin, self.pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
        joint = self.model.addJoint(parent, pin.JointModelRZ(), place, f"j{self.model.njoints}")
        self.model.appendBodyToJoint(
            joint, pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), ROD), pin.SE3.Identity()
        )
        return joint

    def acceleration(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        if not self.four_bars:
            return self.pin.aba(self.model, self.data, q, v, self.torque).copy()
        return self.pin.constraintDynamics(
            self.model, self.data, q, v, self.torque, self.contacts, self.contact_data, self.proximal
        ).copy()

    def __call__(self, times: np.ndarray) -> np.ndarray:
        a, h, q, v, path, now = self.acceleration, self.step, self.q0, self.v0, [], 0.0
        for t in times:
            for _ in range(round((t - now) / h)):
                k1 = a(q, v)
                v2 = v + h / 2 * k1
                k2 = a(q + h / 2 * v, v2)
                v3 = v + h / 2 * k2
                k3 = a(q + h / 2 * v2, v3)
                v4 = v + h * k3
                k4 = a(q + h * v3, v4)
                q, v = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            now = t
            self.pin.forwardKinematics(self.model, self.data, q)
            tip = self.data.oMi[1 if self.four_bars else self.model.njoints - 1]
            path.append(tip.act(np.array([1.0, 0.0, 0.0]))[:2])
        return np.array(path)


class Exudyn:
    """Exudyn: rigid bodies in the plane with hinges, generalised-α; all steps of a span by one call."""

    def __init__(self, case: str, count: int, step: float, solver: str = "GeneralizedAlpha") -> None:
        import exudyn as exu
        from exudyn import itemInterface as items  # noqa: N813

        exu.config.printToConsole = False
        self.exu, self.items, self.step = exu, items, step
        self.solver = getattr(exu.DynamicSolverType, solver)
        self.system = exu.SystemContainer().AddSystem()
        self.ground = self.system.AddObject(items.ObjectGround())
        if case == "chain":
            before, place = self.ground, (0.0, 0.0, 0.0)
            for i in range(count):
                rod = self._rod((i + 0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
                self._hinge(before, place, rod)
                before, place = rod, (0.5, 0.0, 0.0)
            tip = before
        else:
            cranks = [self._rod((i, 0.5, np.pi / 2), (0.5, 0.0, -1.0)) for i in range(count + 1)]
            couplers = [self._rod((i + 0.5, 1.0, 0.0), (1.0, 0.0, 0.0)) for i in range(count)]
            for i, crank in enumerate(cranks):
                self._hinge(self.ground, (float(i), 0.0, 0.0), crank)
            for i, coupler in enumerate(couplers):
                self._hinge(cranks[i], (0.5, 0.0, 0.0), coupler)
                self._hinge(coupler, (0.5, 0.0, 0.0), cranks[i + 1], (0.5, 0.0, 0.0))
            tip = cranks[0]
        sensor = items.SensorBody(
            bodyNumber=tip, localPosition=[0.5, 0.0, 0.0], outputVariableType=exu.OutputVariableType.Position,
            storeInternal=True, writeToFile=False,
        )  # fmt: skip
        self.sensor = self.system.AddSensor(sensor)
        self.system.Assemble()

    def _rod(self, pose: tuple[float, ...], twist: tuple[float, ...]) -> int:
        items = self.items
        node = self.system.AddNode(
            items.NodeRigidBody2D(referenceCoordinates=list(pose), initialVelocities=list(twist))
        )
        body = self.system.AddObject(
            items.ObjectRigidBody2D(physicsMass=1.0, physicsInertia=1 / 12, nodeNumber=node)
        )
        middle = self.system.AddMarker(items.MarkerBodyPosition(bodyNumber=body))
        self.system.AddLoad(items.LoadForceVector(markerNumber=middle, loadVector=[0.0, -9.81, 0.0]))
        return body

    def _hinge(
        self, first: int, place: tuple[float, ...], second: int, other: tuple[float, ...] = (-0.5, 0.0, 0.0)
    ) -> None:
        markers = [
            self.system.AddMarker(self.items.MarkerBodyPosition(bodyNumber=body, localPosition=list(point)))
            for body, point in ((first, place), (second, other))
        ]
        self.system.AddObject(self.items.ObjectJointRevolute2D(markerNumbers=markers))

    def __call__(self, times: np.ndarray) -> np.ndarray:
        settings = self.exu.SimulationSettings()
        span, every = settings.timeIntegration, float(times[0])
        span.numberOfSteps, span.endTime = round(times[-1] / self.step), float(times[-1])
        span.verboseMode = 0
        span.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = every
        settings.linearSolverType = self.exu.LinearSolverType.EigenSparse
        self.system.SolveDynamic(settings, solverType=self.solver, showHints=False)
        stored = self.system.GetSensorStoredData(self.sensor)
        return np.array([stored[np.argmin(np.abs(stored[:, 0] - t)), 1:3] for t in times])
