"""A 3-D mechanism with every kind of joint, and what it is exported as."""

from __future__ import annotations

from linkwind.scenario import Scenario, load, loads

SPATIAL = """
[time]
end = 0.2
[environment]
gravity = [0.3, -9.81, 0.5]
[[bodies]]
name = "hub"
mass = 2.0
inertia = [0.3, 0.5, 0.6, 0.02, -0.01, 0.03]
position = [0.1, 0.2, 0.3]
orientation = [0.8, 0.0, 0.6, 0.0]
velocity = [0.4, -0.2, 0.1]
angular_velocity = [0.2, 0.5, -0.3]
[[bodies]]
name = "arm"
mass = 1.0
inertia = [0.1, 0.12, 0.2, 0.0, 0.0, 0.0]
orientation = [0.96, 0.28, 0.0, 0.0]
angular_velocity = [0.6, -0.3, 0.4]
[[bodies]]
name = "flap"
mass = 0.7
inertia = [0.05, 0.04, 0.06, 0.0, 0.0, 0.0]
[[bodies]]
name = "slider"
mass = 0.5
inertia = [0.02, 0.03, 0.02, 0.0, 0.0, 0.0]
[[bodies]]
name = "lid"
mass = 0.2
inertia = [0.01, 0.01, 0.015, 0.0, 0.0, 0.0]
[[bodies]]
name = "sledge"
mass = 1.2
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
velocity = [0.3, 0.1, 0.0]
angular_velocity = [0.0, 0.0, 0.7]
[[joints]]
name = "ball"
type = "spherical"
parent = "hub"
child = "arm"
parent_point = [0.3, 0.1, 0.0]
child_point = [-0.2, 0.0, 0.05]
stiffness = 3.0
damping = 0.1
[[joints]]
name = "flap"
type = "revolute"
parent = "arm"
child = "flap"
parent_point = [0.2, 0.0, 0.0]
child_point = [-0.2, 0.0, 0.0]
axis = [0.3, 0.4, 1.0]
stiffness = 2.0
[[joints]]
name = "rail"
type = "prismatic"
parent = "hub"
child = "slider"
parent_point = [0.0, 0.2, 0.0]
axis = [0.0, 1.0, 0.5]
stiffness = 5.0
damping = 0.2
[[joints]]
name = "glue"
type = "fixed"
parent = "slider"
child = "lid"
parent_point = [0.0, 0.1, 0.0]
child_point = [0.0, -0.05, 0.0]
[[joints]]
name = "ground"
type = "planar"
parent = "world"
child = "sledge"
child_point = [0.05, 0.0, 0.0]
stiffness = [1.0, 2.0, 0.5]
[[forces]]
name = "flap"
type = "spring"
parent = "flap"
child = "lid"
parent_point = [0.2, 0.0, 0.1]
stiffness = 8.0
damping = 0.3
[[forces]]
name = "tether"
type = "spring"
parent = "world"
child = "sledge"
parent_point = [1.0, 1.0, 1.0]
child_point = [0.1, 0.0, 0.0]
stiffness = 3.0
rest = 0.5
force = { table = [[0.0, -1.0], [1.0, 0.0], [2.0, 3.0]], interpolation = "cubic" }
[[forces]]
name = "motor"
type = "actuator"
joint = "rail"
force = "0.5*sin(9*t) - 0.1*q*v"
[[forces]]
name = "beat"
type = "motion"
joint = "flap"
position = "0.4*sin(12*t)"
[[forces]]
name = "jet"
type = "point_force"
body = "lid"
point = [0.02, 0.0, 0.01]
frame = "body"
fx = "0.3*cos(5*t) - 0.1*vz"
ty = "0.01*theta"
[[forces]]
name = "float"
type = "buoyancy"
body = "sledge"
point = [0.0, 0.1, 0.0]
volume = 0.3
[aero]
model = "field"
[aero.field.hub]
fx = "-2*vx + x"
ty = "0.1*sin(7*t)"
[aero.field.arm]
tz = "-0.3*wz + cos(theta)"
[dynamics]
integrator = "rk4"
substeps = 2
[coupling]
scheme = "explicit"
step = 1e-3
"""


def spatial() -> Scenario:
    """Return the scenario; the joint that carries the flap has the flap's name."""
    return loads(SPATIAL, "spatial")


EVENTFUL = """
[time]
end = 0.4
[[bodies]]
name = "crank"
mass = 1.0
inertia = 0.1
angle_deg = 80.0
angular_velocity = 3.0
[[bodies]]
name = "rod"
mass = 1.0
inertia = 0.4
[[bodies]]
name = "rocker"
mass = 1.0
inertia = 0.2
[[bodies]]
name = "payload"
mass = 0.5
inertia = 0.02
angle_deg = 0.0
[[bodies]]
name = "ball"
mass = 0.3
inertia = 0.01
position = [4.0, 0.2]
[[joints]]
name = "pivot"
type = "revolute"
parent = "world"
child = "crank"
child_point = [-0.5, 0.0]
[[joints]]
name = "knee"
type = "revolute"
parent = "crank"
child = "rod"
parent_point = [0.5, 0.0]
child_point = [-1.0, 0.0]
[[joints]]
name = "ground"
type = "revolute"
parent = "world"
child = "rocker"
parent_point = [2.0, 0.0]
child_point = [-0.75, 0.0]
[[joints]]
name = "loop"
type = "revolute"
parent = "rod"
child = "rocker"
parent_point = [1.0, 0.0]
child_point = [0.75, 0.0]
[[joints]]
name = "hook"
type = "revolute"
parent = "crank"
child = "payload"
parent_point = [0.2, 0.0]
child_point = [-0.1, 0.0]
[[joints]]
name = "guide"
type = "prismatic"
parent = "world"
child = "ball"
parent_point = [4.0, 0.0]
axis = [0.0, 1.0]
stop = [0.0, 1.0]
restitution = 0.6
[[events]]
name = "drop"
joint = "hook"
action = "release"
at = 0.1234
[aero]
model = "field"
[aero.field.payload]
fy = "-0.1*vy"
"""


def eventful() -> Scenario:
    """A four-bar that drops something at a time, and a ball that bounces."""
    return loads(EVENTFUL, "eventful.toml")


SERVO = """
[time]
end = 0.4
[[bodies]]
name = "upper"
mass = 1.2
inertia = 0.05
angle_deg = -60.0
[[bodies]]
name = "lower"
mass = 0.8
inertia = 0.03
angle_deg = -20.0
[[bodies]]
name = "load"
mass = 0.3
inertia = 0.002
angle_deg = 10.0
[[joints]]
name = "shoulder"
type = "revolute"
parent = "world"
child = "upper"
child_point = [-0.3, 0.0]
[[joints]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
parent_point = [0.3, 0.0]
child_point = [-0.25, 0.0]
[[joints]]
name = "grip"
type = "revolute"
parent = "lower"
child = "load"
parent_point = [0.25, 0.0]
child_point = [-0.05, 0.0]
damping = 0.01
[[events]]
name = "brake"
joint = "elbow"
action = "lock"
[[events]]
name = "drop"
joint = "grip"
action = "release"
[[forces]]
name = "motor"
type = "actuator"
joint = "shoulder"
inputs = { u = 0.0 }
force = "u - 0.05*v"
[[forces]]
name = "spring"
type = "actuator"
joint = "elbow"
inputs = { target = 0.4, gain = 2.0 }
force = "gain*sin(target - q) - 0.1*v"
[[forces]]
name = "jet"
type = "point_force"
body = "lower"
point = [0.1, 0.0]
frame = "body"
inputs = { throttle = 0.5 }
fy = "throttle*cos(3*t)"
[aero]
model = "field"
[aero.field.load]
fx = "-0.1*vx"
fy = "-0.1*vy"
[coupling]
scheme = "explicit"
step = 1e-3
"""


def servo() -> Scenario:
    """An arm with a motor, a controlled elbow and a jet, that brakes and drops its load on command."""
    return loads(SERVO, "servo.toml")


def sheared() -> Scenario:
    """Two plates in a wind of which each component is of another kind."""
    wind = "['-5*(max(y, 0.1)/10)**0.14', { table = [[0, 1], [0.05, 2], [0.1, 1]], periodic = true }, 'u']"
    return load("two_link", [f"environment.wind={wind}", "environment.inputs.u=0.5", "aero.plate.strips=2"])
