"""A plate on a hinge in a stream that comes from the side: a small run in a flow of three dimensions."""

STEP = 2.5e-4  # s, one lattice step

HINGED = f"""
[time]
end = {30 * STEP!r}
[environment]
gravity = [0.0, -9.81, 0.0]
density = 1.2
viscosity = 2e-4
wind = [2.0, 0.5, -0.4]
[[bodies]]
name = "plate"
mass = 1e-2
inertia = [8e-6, 1.6e-5, 9e-6, 1e-6, 0.0, 0.0]
shape = {{ type = "plate", length = 0.1, span = 0.1 }}
[[joints]]
name = "hinge"
type = "revolute"
parent = "world"
child = "plate"
axis = [0.3, 0.1, 1.0]
child_point = [-0.05, 0.0, 0.0]
[aero]
model = "flow"
[aero.flow]
dimensions = 3
cells = 10
window = [0.64, 0.56, 0.56]
start_time = 2e-3
frames = 3
[coupling]
step = {STEP!r}
[log]
checkpoint_every = 10
"""
