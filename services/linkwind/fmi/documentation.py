"""The pages in ``documentation/``: what is computed, how, and every variable."""

from __future__ import annotations

from html import escape

from linkwind.fmi.coordinates import force_names
from linkwind.fmi.part import Part
from linkwind.fmi.variables import Variable
from linkwind.scenario import Environment, Provider
from linkwind.scenario.functions import Function

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; } td, th { padding: .15rem .8rem .15rem 0; text-align: left; }
th { border-bottom: 1px solid #8a949c; } td { border-bottom: 1px solid #e3e7ea; vertical-align: top; }
.eq { font: italic 1.1em/1.6 Cambria, Georgia, serif; margin-left: 2rem; } figure { margin: 0; }
code { font-size: .92em; }
"""

_DYNAMICS = """
<h2>Equations</h2>
<p>Rigid bodies in a tree of joints, in joint coordinates <i>q</i> and velocities <i>v</i>:</p>
<p class="eq">q̇ = N(q) v,<br>
M(q) v̇ + c(q, v) = −k (q − q<sub>rest</sub>) − d v + Σ J<sub>b</sub>(q)ᵀ (w<sub>b</sub> − A<sub>b</sub>
a<sub>b</sub>)
</p>
<p>with the mass matrix M, Coriolis and gravity terms c, springs k and dampers d of the joints, and for
each body b
the wrench w<sub>b</sub> = (F, T) in the world at the centre of mass, the added inertia A<sub>b</sub>
(6×6, in the
body frame) and the acceleration a<sub>b</sub> = (a, alpha). They are solved by the articulated-body
algorithm
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, doi:10.1007/978-1-4899-7560-7), in a time
proportional to
the number of bodies.</p>
<h2>Time steps</h2>
<p>Co-Simulation: inputs are held over a communication step, unless their derivatives are given (FMI 2; of
added
inertia and commands there are none). The step
is taken by <code>solver.integrator</code> (0 Euler, 1 semi-implicit Euler, 2 Runge–Kutta of order 4, 3
Dormand–Prince
with the tolerances <code>solver.rtol</code> and <code>solver.atol</code>) in
<code>solver.substeps</code> equal parts. Model Exchange: the states are all q and v.</p>
<h2>Events</h2>
<p>Joints may be released, locked or stopped, at a time, on a condition or on command. Co-Simulation finds
the time
within its steps, Model Exchange has an event indicator for each. An event on command happens when its
Boolean input
<code>….command</code> becomes true, from false or at the start: at the beginning of the next communication
step, or
in Event Mode. It happens once; <code>….time</code> tells when, −1 that it has not.</p>
<h2>Force elements</h2>
<p>Springs, actuators, prescribed motions, forces at points and buoyancy are part of the mechanism. Inputs
of them
are what the expressions of actuators and forces at points use by name; nobody has to set them. Expressions
are of
time t; a spring's also of length and rate, an actuator's of the coordinate q and its rate v, that of a force
at a point
of x y z vx vy vz wx wy wz theta of the body.</p>
"""

_SETS = {
    "ristroph": "Lift and drag follow from the angle of attack, blended from attached to stalled flow at "
    "14°, and act at a centre of pressure that moves; rotation adds lift and a moment. Source: H. Li, "
    "T. Goodwill, Z. J. Wang, L. Ristroph, J. Fluid Mech. 937, A6 (2022), doi:10.1017/jfm.2022.89.",
    "andersen": "A circulation with a translational and a rotational part gives the lift; drag is quadratic, "
    "and a torque is against the rotation. Source: A. Andersen, U. Pesavento, Z. J. Wang, J. Fluid Mech. "
    "541, 65 (2005), doi:10.1017/S002211200500594X.",
    "table": "Lift, drag and moment about the quarter chord, nose up, are those of this table over the angle "
    "of attack, with monotone cubics between its rows.",
}


def index(part: Part, picture: str, *, has_references: bool) -> bytes:
    """Return ``index.html``, self-contained.

    Args:
        part: what is exported.
        picture: of the mechanism, as SVG.
        has_references: whether the FMU has reference results.
    """
    scenario = part.scenario
    provider = part.provider
    link = '<a href="fmi-ls-ref.html">Reference results</a> come with this FMU.'
    checked = link if has_references else ""
    equations = (
        _DYNAMICS + _forces(part)
        if provider is None
        else _plate(provider) + _wind(part.scenario.environment)
        if provider.model == "plate"
        else _field(part)
    )
    text = f"""<!DOCTYPE html>
<html lang="en"><head><meta
charset="utf-8"><title>{escape(part.identifier)}</title><style>{_STYLE}</style></head>
<body>
<h1>{escape(part.identifier)}</h1>
<p>{escape(part.description)}</p>
<figure>{picture}<figcaption>The mechanism at its start, seen along z.</figcaption></figure>
<p>All values are in SI units. Vectors are in the world frame W at the centres of mass; orientations are
unit
quaternions (w, x, y, z), body to world. The default step is {scenario.coupling.step!r} s, the default end
{scenario.time.end!r} s. {checked}</p>
{equations}
{_table("Parameters", part, "parameter")}
{_table("Inputs", part, "input")}
{_table("Outputs", part, "output")}
{_bodies(part)}
</body></html>
"""
    return text.encode()


def references(part: Part) -> bytes:
    """Return ``fmi-ls-ref.html``, about the reference results."""
    text = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Reference
results</title><style>{_STYLE}</style></head><body>
<h1>Reference results of {escape(part.identifier)}</h1>
<p><code>extra/org.fmi-standard.fmi-ls-ref</code> holds one experiment: inputs at communication points,
and what
follows from them by Co-Simulation with the default parameters. Each row of the inputs is set before the
step that
starts at its time, and held over the step; the results are read at the end of steps, before new inputs
are set.
They were computed without this FMU, by the library that it was exported from; on the same kind of
processor an
importer gets the same numbers to the last bit, elsewhere to some 1e-12.</p>
<p>In Model Exchange, with the inputs held in the same way, they agree to the tolerance of the
integrator.</p>
</body></html>
"""
    return text.encode()


def _wind(environment: Environment) -> str:
    """The wind that plates meet, as the scenario states it."""
    functions = [
        f"<code>{escape(_law(function))}</code> along {'xyz'[i]}"
        for i, function in environment.wind_functions.items()
    ]
    stated = f", functions of time t and place x y z, {', '.join(functions)}" if functions else ""
    gusts = f", and {len(environment.gusts)} travelling gusts" if environment.gusts else ""
    return f"<p>The wind is the sum of the parameter <code>wind</code>{stated}{gusts}.</p>"


def _plate(provider: Provider) -> str:
    """How plates meet the air, with the numbers of a table."""
    plate = provider.plate
    rows = [["α, deg", "C<sub>l</sub>", "C<sub>d</sub>", "C<sub>m</sub>"], *(plate.table or ())]
    cells = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    table = f"<table>{cells}</table>" if plate.coefficients == "table" else ""
    count = "one strip" if plate.strips == 1 else f"{plate.strips} equal strips"
    return (
        "<h2>Equations</h2><p>Each body is a thin flat plate of chord c (along x of its body frame), span s "
        f"(along z) and normal along y, in a quasi-steady flow. Its span is {count}; each meets the air with "
        f"the velocity of its own centre. {_SETS[plate.coefficients]}</p>{table}<p>With n strips, the "
        "added mass m = π ρ (c/2)² s along the normal and the added inertia m (c/2)²/8 about the span and "
        "m s² (1 − 1/n²)/12 about the chord act on the acceleration and are returned as the matrix A. A wing "
        "has its mean chord for c; its strips have chords of their own and act at their centres of area, all "
        "of which scale with c and s, and A is their sum, moved to the centre of mass.</p>"
    )


def _field(part: Part) -> str:
    """The expressions of a field, as the scenario states them."""
    assert part.provider is not None
    rows = []
    for body in part.bodies:
        expressions = part.provider.field.get(body)
        if expressions is None:
            continue
        stated = [(f"{name}", text) for name, text in expressions.let.items()]
        stated += [(name, getattr(expressions, name)) for name in ("fx", "fy", "fz", "tx", "ty", "tz")]
        rows += [(body, name, text) for name, text in stated if text != "0"]
    cells = "".join(
        f"<tr><td>{escape(body)}</td><td>{escape(name)}</td><td><code>{escape(text)}</code></td></tr>"
        for body, name, text in rows
    )
    return (
        "<h2>Equations</h2><p>Force and torque on each body as expressions of time t, position x y z, "
        "velocity vx vy vz, angular velocity wx wy wz, and theta, the angle about z, unwrapped.</p>"
        f"<table><tr><th>body</th><th>name</th><th>expression</th></tr>{cells}</table>"
    )


def _forces(part: Part) -> str:
    """The force elements, as the scenario states them."""
    rows = []
    for name, force in zip(force_names(part.mechanism), part.scenario.forces, strict=True):
        stated = list(getattr(force, "let", {}).items())
        laws = ("force", "position", "fx", "fy", "fz", "tx", "ty", "tz")
        stated += [(key, _law(law)) for key in laws if (law := getattr(force, key, None)) is not None]
        rows += [(name, force.type, key, text) for key, text in stated or [("", "")]]
    if not rows:
        return ""
    cells = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(kind)}</td><td>{escape(key)}</td>"
        f"<td><code>{escape(text)}</code></td></tr>"
        for name, kind, key, text in rows
    )
    return f"<table><tr><th>name</th><th>type</th><th></th><th>expression</th></tr>{cells}</table>"


def _law(law: Function) -> str:
    return law.expression if law.expression is not None else f"a table of {len(law.table or ())} points"


def _table(title: str, part: Part, causality: str) -> str:
    rows = "".join(map(_row, (entry for entry in part.variables if entry.causality == causality)))
    if not rows:
        return ""
    head = "<tr><th>name</th><th>size</th><th>unit</th><th>start</th><th></th><th>meaning</th></tr>"
    return f"<h2>{title}</h2><table>{head}{rows}</table>"


def _row(variable: Variable) -> str:
    unit = variable.quantity.unit.name if variable.quantity.unit else ""
    start = ", ".join(f"{value:.6g}" for value in variable.start) if any(variable.start) else "0"
    if variable.boolean:
        start = "true" if any(variable.start) else "false"
    cells = (
        f"<code>{escape(variable.name)}</code>",
        " × ".join(map(str, variable.dimensions)),
        unit,
        start if variable.start else "",
        variable.variability if variable.causality == "parameter" else "",
        escape(variable.description),
    )
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _bodies(part: Part) -> str:
    """The joints: who carries whom."""
    mechanism = part.mechanism
    names = (*mechanism.bodies, "world")
    rows = "".join(
        f"<tr><td>{escape(joint)}</td><td>{escape(names[int(parent)])}</td><td>{escape(body)}</td></tr>"
        for joint, parent, body in zip(
            mechanism.joints, mechanism.tables.parent, mechanism.bodies, strict=True
        )
    )
    return f"<h2>Joints</h2><table><tr><th>joint</th><th>parent</th><th>child</th></tr>{rows}</table>"
