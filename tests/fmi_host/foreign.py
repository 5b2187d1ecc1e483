"""FMUs by somebody else, built from foreign.c with a few lines of C each."""

from __future__ import annotations

import functools
import math
import os
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import fmpy

from linkwind.fmi import toolchain, windows

HEADERS = Path(fmpy.__file__).parent / "c-code"
SOURCE = Path(__file__).with_name("foreign.c")
PLATFORM = {2: "linux64", 3: fmpy.platform_tuple}
WINDOWS = {2: "win64", 3: "x86_64-windows"}
UNITS = {
    "km/h": f'm="1" s="-1" factor="{1 / 3.6!r}"',
    "kN": 'kg="1" m="1" s="-2" factor="1000"',
    "N": 'kg="1" m="1" s="-2"',
}


@dataclass(frozen=True)
class Variable:
    """A variable; ``shape`` entries of "n" are the structural parameter's value."""

    name: str
    causality: str
    shape: tuple[int | str, ...] = ()
    start: float = 0.0
    unit: str = ""
    type: str = "Real"
    discrete: bool = False

    @property
    def room(self) -> int:
        return math.prod(16 if size == "n" else int(size) for size in self.shape)


def vector(name: str, causality: str, unit: str = "", start: float = 0.0) -> list[Variable]:
    """Three scalars name.x, name.y, name.z."""
    return [Variable(f"{name}.{axis}", causality, start=start, unit=unit) for axis in "xyz"]


@dataclass(frozen=True)
class Foreign:
    """An FMU: variables and C macros, see foreign.c."""

    variables: tuple[Variable, ...]
    fmi: int = 2
    interfaces: tuple[str, ...] = ("CoSimulation",)
    attributes: str = 'canHandleVariableCommunicationStepSize="true"'
    code: str = ""
    states: int = 0
    indicators: int = 0
    experiment: str = ""
    extra: dict[str, bytes] = field(default_factory=dict, hash=False)

    def offsets(self) -> list[int]:
        """First value of each variable."""
        return [sum(v.room for v in self.variables[:i]) for i in range(len(self.variables))]

    def at(self, name: str) -> str:
        """C for the first value of a variable."""
        names = [v.name for v in self.variables]
        return f"m->v[{self.offsets()[names.index(name)]}]"


def fmu(folder: Path, foreign: Foreign, name: str = "foreign", *, windows: bool = False) -> Path:
    """Build the FMU, for this platform or for Windows, and return its file."""
    path = folder / f"{name}.fmu"
    description = (_description2 if foreign.fmi == 2 else _description3)(foreign)
    binary, make = f"{PLATFORM[foreign.fmi]}/foreign.so", library
    if windows:
        binary, make = f"{WINDOWS[foreign.fmi]}/foreign.dll", windows_library
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr(f"binaries/{binary}", make(foreign.fmi, header(foreign)))
        for entry, data in foreign.extra.items():
            archive.writestr(entry, data)
    return path


def header(foreign: Foreign) -> str:
    """The generated part of the C code."""
    starts: list[float] = []
    for variable in foreign.variables:
        starts += [variable.start] * variable.room
    sizes = [
        -math.prod(int(s) for s in v.shape if s != "n") if "n" in v.shape else v.room
        for v in foreign.variables
    ]

    def array(numbers: list[float] | list[int]) -> str:
        return "{" + ", ".join(map(repr, numbers)) + "}"

    lines = [
        '#define TOKEN "{8c4e810f-3df3-4a00-8276-176fa3c9f000}"',
        f"#define STARTS {array(starts)}",
        f"#define OFFSETS {array(foreign.offsets())}",
        f"#define SIZES {array(sizes)}",
        f"#define NX {foreign.states}",
        f"#define NZ {foreign.indicators}",
        foreign.code,
    ]
    return "\n".join(lines)


@functools.cache
def library(fmi: int, text: str) -> bytes:
    """Compile foreign.c; what has been compiled before is taken from memory."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "foreign.h").write_text(text)
        target = Path(folder, "foreign.so")
        flags = [
            "-shared",
            "-fPIC",
            "-O0",
            "-ffp-contract=off",
            f"-DFMI={fmi}",
            f"-I{folder}",
            f"-I{HEADERS}",
        ]
        command = [os.environ.get("CC", "cc"), *flags, "-o", str(target), str(SOURCE), "-lm"]
        subprocess.run(command, check=True)
        return target.read_bytes()


@functools.cache
def windows_library(fmi: int, text: str) -> bytes:
    """Compile foreign.c for Windows, on its own runtime alone: zig would make another one first."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "foreign.h").write_text(text)
        (folder / "more.def").write_text("LIBRARY ucrtbase.dll\nEXPORTS\nabort\n_exit\nputs\nfflush\n")
        (folder / "kernel32.def").write_text("LIBRARY kernel32.dll\nEXPORTS\nSleep\n")
        zig = [sys.executable, "-m", "ziglang"]
        runtime = windows.prepare(folder)
        for library_ in ("more", "kernel32"):
            make = ["dlltool", "-m", "i386:x86-64", "-d", f"{library_}.def", "-l", f"lib{library_}.a"]
            toolchain.run([*zig, *make], folder, "an import library")
        flags = ["-target", "x86_64-windows-gnu", "-shared", "-O1", "-s", "-ffp-contract=off", f"-DFMI={fmi}"]
        sources = ["-I.", f"-I{HEADERS}", str(SOURCE), *runtime, "libmore.a", "libkernel32.a"]
        toolchain.run([*zig, "cc", *flags, "-o", "foreign.dll", *sources], folder, "foreign.dll")
        return (folder / "foreign.dll").read_bytes()


def _units(foreign: Foreign) -> str:
    used = {v.unit for v in foreign.variables if v.unit}
    lines = [
        f"<Unit name={quoteattr(unit)}>" + (f"<BaseUnit {UNITS[unit]}/>" if unit in UNITS else "") + "</Unit>"
        for unit in sorted(used)
    ]
    return f"<UnitDefinitions>{''.join(lines)}</UnitDefinitions>" if lines else ""


def _description2(foreign: Foreign) -> str:
    variables = [_scalar2(v, i) for i, v in zip(foreign.offsets(), foreign.variables, strict=True)]
    outputs = "".join(
        f'<Unknown index="{i + 1}"/>' for i, v in enumerate(foreign.variables) if v.causality == "output"
    )
    derivatives = ""
    for i in range(foreign.states):
        variables.append(
            f'<ScalarVariable name="state{i}" valueReference="{400 + i}"><Real/></ScalarVariable>'
        )
        index = len(variables)
        variables.append(
            f'<ScalarVariable name="der{i}" valueReference="{410 + i}"><Real derivative="{index}"/>'
            "</ScalarVariable>"
        )
        derivatives += f'<Unknown index="{index + 1}"/>'
    derivatives = f"<Derivatives>{derivatives}</Derivatives>" if derivatives else ""
    interfaces = _interfaces(foreign, foreign.attributes)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="foreign" guid="{{8c4e810f-3df3-4a00-8276-176fa3c9f000}}"
 generationTool="a test" numberOfEventIndicators="{foreign.indicators}">
{interfaces}{_units(foreign)}
<LogCategories><Category name="logStatusError"/></LogCategories>{foreign.experiment}
<ModelVariables>{"".join(variables)}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs>{derivatives}</ModelStructure></fmiModelDescription>"""


def _interfaces(foreign: Foreign, attributes: str) -> str:
    """The elements of the interfaces; only Co-Simulation has attributes besides those of FMU state."""
    if foreign.fmi == 3:
        attributes = attributes.replace("DirectionalDerivative=", "DirectionalDerivatives=")
    shared = " ".join(part for part in attributes.split() if "FMU" in part or "Derivative" in part)
    return "".join(
        f'<{kind} modelIdentifier="foreign" {attributes if kind == "CoSimulation" else shared}/>'
        for kind in ("ModelExchange", "CoSimulation", "ScheduledExecution")
        if kind in foreign.interfaces
    )


def _scalar2(variable: Variable, reference: int) -> str:
    unit = f" unit={quoteattr(variable.unit)}" if variable.unit else ""
    has_start = variable.causality in ("input", "parameter")
    value = repr(variable.start) if variable.type == "Real" else str(int(variable.start))
    start = f' start="{value}"' if has_start else ""
    fixed = ' variability="fixed"' if variable.causality == "parameter" else ""
    discrete = (
        ' variability="discrete"'
        if variable.discrete or (variable.type != "Real" and variable.causality == "input")
        else fixed
    )
    return (
        f'<ScalarVariable name={quoteattr(variable.name)} valueReference="{reference}" '
        f'causality="{variable.causality}"{discrete}><{variable.type}{unit}{start}/></ScalarVariable>'
    )


def _description3(foreign: Foreign) -> str:
    variables, structure = ['<Float64 name="time" valueReference="999" causality="independent"/>'], ""
    for i, v in enumerate(foreign.variables):
        if v.causality == "structuralParameter":
            variables.append(
                f'<{"UInt64" if v.type == "Real" else v.type} name="{v.name}" valueReference="{i}" '
                f'causality="{v.causality}" start="{"3" if v.type == "Real" else "false"}"/>'
            )
            continue
        n = next((k for k, s in enumerate(foreign.variables) if s.causality == "structuralParameter"), 0)
        dimensions = "".join(
            f'<Dimension valueReference="{n}"/>' if size == "n" else f'<Dimension start="{size}"/>'
            for size in v.shape
        )
        unit = f" unit={quoteattr(v.unit)}" if v.unit else ""
        start = f' start="{v.start!r}"' if v.causality in ("input", "parameter") else ""
        fixed = ' variability="fixed"' if v.causality == "parameter" else ""
        fixed = ' variability="discrete"' if v.discrete else fixed
        variables.append(
            f'<Float64 name={quoteattr(v.name)} valueReference="{i}" causality="{v.causality}"'
            f"{fixed}{unit}{start}>{dimensions}</Float64>"
        )
        structure += f'<Output valueReference="{i}"/>' * (v.causality == "output")
    for i in range(foreign.states):
        variables.append(f'<Float64 name="state{i}" valueReference="{400 + i}"/>')
        variables.append(f'<Float64 name="der{i}" valueReference="{410 + i}" derivative="{400 + i}"/>')
        structure += f'<ContinuousStateDerivative valueReference="{410 + i}"/>'
    for i in range(foreign.indicators):
        variables.append(f'<Float64 name="indicator{i}" valueReference="{420 + i}"/>')
        structure += f'<EventIndicator valueReference="{420 + i}"/>'
    interfaces = _interfaces(foreign, foreign.attributes.replace("FMUstate", "FMUState"))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="foreign"
 instantiationToken="{{8c4e810f-3df3-4a00-8276-176fa3c9f000}}" generationTool="a test">
{interfaces}{_units(foreign)}
<LogCategories><Category name="logStatusError"/></LogCategories>{foreign.experiment}
<ModelVariables>{"".join(variables)}</ModelVariables>
<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"""
