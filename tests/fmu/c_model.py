"""FMU binaries for the tests of the C layers, with tables written here, without the exporter."""

from __future__ import annotations

import ctypes
import importlib.util
import math
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from linkwind.native.forces import FieldTable, PlateTable
from linkwind.native.multibody import Tables
from linkwind.native.wind import WindTable

ROOT = Path(__file__).resolve().parents[2]
C = ROOT / "fmu"
OK, WARNING, DISCARD, ERROR = range(4)
TOKEN = "{8c4e810f-3df3-4a00-8276-176fa3c9f000}"

KNOWN = {
    "MASS",
    "INERTIA",
    "PARENT_POINT",
    "CHILD_POINT",
    "GRAVITY",
    "STIFFNESS",
    "DAMPING",
    "REST",
    "FORCE_NUMBER",
    "RTOL",
    "ATOL",
    "FORCE",
    "TORQUE",
    "FORCE_INPUT",
    "ADDED_INERTIA",
    "EVENT_COMMAND",
    "Q",
    "V",
}
INPUTS = {
    "dynamics": {"FORCE", "TORQUE", "FORCE_INPUT", "ADDED_INERTIA"},
    "aero": {"POSITION", "ORIENTATION", "LINEAR", "ANGULAR", "WIND_INPUT"},
}
INTEGERS = (
    "closure_body", "closure_rows", "event_joint", "event_action", "event_occasion", "event_side",
    "force_type", "force_body", "force_start", "force_code", "force_input",
)  # fmt: skip
FIXED = {"PARENT_POINT", "CHILD_POINT"}


@dataclass(frozen=True)
class Model:
    """One FMU's data: the C text, and where its variables are.

    Attributes:
        text: of lw_fmu_data.c.
        references: value references of each section, in the order of its values.
        sizes: number of values of each section.
        scalar: every value is a variable (FMI 2), instead of one variable for each section (FMI 3).
    """

    text: str
    references: dict[str, list[int]]
    sizes: dict[str, int]
    part: str
    scalar: bool


def _array(kind: str, name: str, values) -> str:
    items = [float(v).hex() if kind == "double" else str(int(v)) for v in np.ravel(values)] or ["0"]
    return f"const {kind} lw_fmu_{name}[] = {{{', '.join(items)}}};\n"


def _causality(part: str, section: str, calculated: set[str]) -> str:
    if section in calculated:
        return "LW_CALCULATED"
    if section in INPUTS[part]:
        return "LW_INPUT"
    if section == "EVENT_COMMAND":
        return "LW_DISCRETE_INPUT"
    if part == "dynamics" and section in ("Q", "V"):
        return "LW_STATE"
    return "LW_FIXED_PARAMETER" if section in FIXED else "LW_TUNABLE_PARAMETER"


def _model(part, sections, start, calculated, integers, constants, scalar, token=TOKEN) -> Model:
    rows, references, offset = ['{"time", LW_TYPE_TIME, LW_INDEPENDENT, 0, 0, 1}'], {}, 0
    for name, size in sections.items():
        kind, single = ("BOOLEAN", True) if name == "EVENT_COMMAND" else ("FLOAT64", scalar)
        head = f"LW_TYPE_{kind}, {_causality(part, name, calculated)}, LW_{part.upper()}_{name}"
        pieces = [(f"{name}[{k}]", k, 1) for k in range(size)] if single else [(name, 0, size)][: size > 0]
        references[name] = list(range(len(rows), len(rows) + len(pieces)))
        rows += [f'{{"{label}", {head}, {offset + at}, {count}}}' for label, at, count in pieces]
        offset += size
    for k, name in enumerate(integers):
        references[name] = [len(rows)]
        rows.append(f'{{"{name}", LW_TYPE_INT32, LW_TUNABLE_PARAMETER, 0, {k}, 1}}')
    values = np.concatenate([np.ravel(start.get(name, np.zeros(size))) for name, size in sections.items()])
    text = '#include "lw_fmu.h"\n' + f'const char lw_fmu_token[] = "{token}";\n'
    text += 'const char lw_fmu_model_name[] = "test";\n'
    text += "const lw_fmu_variable lw_fmu_variables[] = {" + ",\n".join(rows) + "};\n"
    text += f"const uint32_t lw_fmu_variable_count = {len(rows)}, lw_fmu_value_count = {offset};\n"
    text += _array("double", "start", values) + _array("int32_t", "integers", [*integers.values(), 0, 0][:2])
    text += constants
    return Model(text, references, sections, part, scalar)


def dynamics(tables: Tables, q0, v0, *, integrator=2, substeps=1, scalar=False, token=TOKEN) -> Model:
    """Return the FMU of a mechanism."""
    n, nq, nv, closures = len(tables.parent), len(q0), len(v0), len(tables.closure_rows)
    forces, inputs = len(tables.force_type), len(tables.force_input)
    events = len(tables.event_joint)
    sections = {
        "MASS": n,
        "INERTIA": 6 * n,
        "PARENT_POINT": 3 * n,
        "CHILD_POINT": 3 * n,
        "GRAVITY": 3,
        "STIFFNESS": nv,
        "DAMPING": nv,
        "REST": nq,
        "FORCE_NUMBER": 3 * forces,
        "RTOL": 1,
        "ATOL": 1,
        "FORCE": 3 * n,
        "TORQUE": 3 * n,
        "FORCE_INPUT": inputs,
        "ADDED_INERTIA": 36 * n,
        "EVENT_COMMAND": events,
        "Q": nq,
        "V": nv,
        "DER_Q": nq,
        "DER_V": nv,
        "POSITION": 3 * n,
        "ORIENTATION": 4 * n,
        "LINEAR": 3 * n,
        "ANGULAR": 3 * n,
        "LINEAR_ACCELERATION": 3 * n,
        "ANGULAR_ACCELERATION": 3 * n,
        "REACTION_FORCE": 3 * n,
        "REACTION_TORQUE": 3 * n,
        "CLOSURE_FORCE": 3 * closures,
        "CLOSURE_TORQUE": 3 * closures,
        "EVENT_TIME": events,
        "EVENT_INDICATOR": events,
        "FORCE_EFFORT": forces,
        "FORCE_POWER": forces,
        "KINETIC_ENERGY": 1,
        "POTENTIAL_ENERGY": 1,
    }
    start = {name: getattr(tables, name.lower()) for name in sections if hasattr(tables, name.lower())}
    start["FORCE_INPUT"] = tables.force_constants[tables.force_input]
    start |= {"RTOL": 1e-6, "ATOL": 1e-9, "Q": q0, "V": v0}
    constants = f"const int32_t lw_fmu_n = {n}, lw_fmu_nq = {nq}, lw_fmu_nv = {nv};\n"
    constants += f"const int32_t lw_fmu_closures = {closures}, lw_fmu_forces = {forces};\n"
    constants += f"const int32_t lw_fmu_events = {events}, lw_fmu_inputs = {inputs};\n"
    constants += f"const int32_t lw_fmu_instructions = {len(tables.force_code)};\n"
    constants += f"const int32_t lw_fmu_constants = {len(tables.force_constants)};\n"
    for name in ("parent", "order", "joint_type", "q_index", "v_index", *INTEGERS):
        constants += _array("int32_t", name, getattr(tables, name))
    for name in (
        "parent_rotation", "child_rotation", "closure_point", "closure_rotation", "closure_length",
        "event_threshold", "event_restitution", "force_point", "force_constants",
    ):  # fmt: skip
        constants += _array("double", name, getattr(tables, name))
    integers = {"INTEGRATOR": integrator, "SUBSTEPS": substeps}
    return _model("dynamics", sections, start, set(sections) - KNOWN, integers, constants, scalar, token)


def aero(table: PlateTable | FieldTable, theta=(), *, scalar=False) -> Model:
    """Return the FMU of a force model."""
    n = len(table.body)
    plate = isinstance(table, PlateTable)
    sections = {
        "DENSITY": 1,
        "WIND": 3,
        "LENGTH": n,
        "SPAN": n,
        "POSITION": 3 * n,
        "ORIENTATION": 4 * n,
        "LINEAR": 3 * n,
        "ANGULAR": 3 * n,
        "WIND_INPUT": table.wind.inputs if plate else 0,
        "FORCE": 3 * n,
        "TORQUE": 3 * n,
        "ADDED_INERTIA": 36 * n,
    }
    start = {"ORIENTATION": np.tile([1.0, 0.0, 0.0, 0.0], n)}
    gusts, field, coefficients, strips, curves = np.zeros((0, 9)), [[0], [0], [0.0]], 0, 0, np.zeros((3, 0))
    if plate:
        start |= {"DENSITY": table.density, "WIND": table.wind.uniform}
        start |= {"WIND_INPUT": table.wind.constants[: table.wind.inputs]}
        start |= {"LENGTH": table.size[:, 0], "SPAN": table.size[:, 1]}
        gusts, coefficients = table.wind.gusts, int(table.coefficients)
        strips, curves = table.strips, table.curves
    else:
        field = [table.start, table.code, table.constants]
    constants = f"const int32_t lw_fmu_n = {n}, lw_fmu_nq = 0, lw_fmu_nv = 0;\n"
    constants += (
        f"const int32_t lw_fmu_aero_model = {int(not plate)}, lw_fmu_coefficients = {coefficients};\n"
    )
    constants += f"const int32_t lw_fmu_strips = {strips}, lw_fmu_curve_size = {curves.shape[1]};\n"
    constants += _array("double", "curves", curves)
    planform = table.planform if plate else np.zeros(0)
    constants += f"const int32_t lw_fmu_planform_size = {planform.size};\n"
    constants += _array("double", "planform", planform)
    constants += f"const int32_t lw_fmu_gust_count = {len(gusts)};\n" + _array("double", "gusts", gusts)
    wind = table.wind if plate else WindTable(np.zeros(3), gusts)
    constants += f"const int32_t lw_fmu_wind_instructions = {len(wind.code)};\n"
    constants += _array("int32_t", "wind_code", wind.code if len(wind.code) else [0])
    constants += _array("double", "wind_constants", wind.constants if len(wind.constants) else [0.0])
    count = len(wind.constants)
    constants += f"const int32_t lw_fmu_wind_constant_count = {count}, lw_fmu_wind_inputs = {wind.inputs};\n"
    constants += _array("int32_t", "field_start", field[0]) + _array("int32_t", "field_code", field[1])
    constants += _array("double", "field_constants", field[2])
    constants += _array("double", "theta", theta if len(theta) else np.zeros(n))
    calculated = {"FORCE", "TORQUE", "ADDED_INERTIA"}
    return _model("aero", sections, start, calculated, {}, constants, scalar)


# ---- compiling ----


@cache
def build_hook():
    spec = importlib.util.spec_from_file_location("hatch_build", C / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def sources(part: str, version: int) -> list[Path]:
    """Return the C files of an FMU besides its data."""
    left_out = {f"lw_part_{'aero' if part == 'dynamics' else 'dynamics'}.c", f"lw_fmi{5 - version}.c"}
    folders = [C / ("core" if part == "dynamics" else "aero"), C / "fmi"]
    shared = [C / "core" / "lw_expression.c"] if part == "aero" else []
    return sorted(shared + [f for folder in folders for f in folder.glob("*.c") if f.name not in left_out])


def flags() -> list[str]:
    hook = build_hook()
    includes = [f"-I{C / folder}" for folder in ("core", "aero", "fmi")]
    return [*hook.FLAGS, *hook.WARNINGS, "-Werror", "-DLW_API=", *includes]


class Compiler:
    """Compiles every file once into a folder, and links models from that."""

    def __init__(self, folder: Path, extra: tuple[str, ...] = ()) -> None:
        self.folder, self._extra = folder, extra

    def _object(self, source: Path) -> Path:
        out = self.folder / f"{source.parent.name}_{source.stem}.o"
        if not out.exists():
            self._run([*flags(), *self._extra, "-c", str(source), "-o", str(out)])
        return out

    def _run(self, arguments: list[str]) -> None:
        done = subprocess.run(
            [*build_hook().compiler(), *arguments], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr

    def _link(self, model: Model, version: int, name: str, more: list[Path], mode: list[str]) -> Path:
        place = self.folder / name
        place.mkdir()
        data = place / "lw_fmu_data.c"
        data.write_text(model.text)
        with ThreadPoolExecutor(2) as pool:
            objects = list(pool.map(self._object, [*sources(model.part, version), *more]))
        out = place / "model"
        self._run([*flags(), *self._extra, *mode, str(data), *map(str, objects), "-lm", "-o", str(out)])
        return out

    def library(self, model: Model, version: int, name: str) -> Path:
        """Return a shared library."""
        return self._link(model, version, name, [], ["-shared"])

    def program(self, model: Model, version: int, name: str, main: Path) -> Path:
        """Return a program with the functions of the FMU in it."""
        return self._link(model, version, name, [main], [])


# ---- calling ----

Logger3 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
Update3 = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,
    ctypes.c_double,
    *[ctypes.c_bool] * 4,
    ctypes.POINTER(ctypes.c_bool),
    ctypes.POINTER(ctypes.c_double),
)


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


class Instance:
    """One instance through FMI 3; every call returns its status, messages are collected."""

    def __init__(
        self,
        library: Path,
        model: Model,
        *,
        exchange=False,
        token=TOKEN,
        update=None,
        early=False,
        logging=True,
    ) -> None:
        self.library, self.model, self.messages = ctypes.CDLL(str(library)), model, []
        self._keep = [
            Logger3(
                lambda _e, status, category, text: self.messages.append(
                    (status, (category or b"").decode(), text.decode())
                )
            )
        ]
        name, logger = b"instance", self._keep[0] if logging else None
        if exchange:
            function = self.library.fmi3InstantiateModelExchange
            arguments = [name, token.encode(), None, False, logging, None, logger]
        else:
            function = self.library.fmi3InstantiateCoSimulation
            self._keep.append(Update3(update) if update else None)
            tail = [None, 0, None, logger, self._keep[1]]
            arguments = [name, token.encode(), None, False, logging, False, early, *tail]
            function.argtypes = (
                [ctypes.c_char_p] * 3
                + [ctypes.c_bool] * 4
                + [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
            )
        function.restype = ctypes.c_void_p
        self.at = ctypes.c_void_p(function(*arguments))

    def call(self, name: str, *arguments) -> int:
        return getattr(self.library, f"fmi3{name}")(self.at, *arguments)

    def do(self, name: str, *arguments) -> None:
        status = self.call(name, *arguments)
        assert status == OK, (name, status, self.messages[-1:])

    def initialize(self, time=0.0, stop=None) -> Instance:
        self.do(
            "EnterInitializationMode",
            False,
            ctypes.c_double(0.0),
            ctypes.c_double(time),
            stop is not None,
            ctypes.c_double(stop or 0.0),
        )
        self.do("ExitInitializationMode")
        return self

    def vrs(self, *sections: str) -> np.ndarray:
        return np.array([r for s in sections for r in self.model.references[s]], dtype=np.uint32)

    def size(self, *sections: str) -> int:
        return sum(self.model.sizes[s] for s in sections)

    def get(self, *sections: str) -> np.ndarray:
        vrs, values = self.vrs(*sections), np.full(self.size(*sections), math.nan)
        self.do(
            "GetFloat64",
            pointer(vrs),
            ctypes.c_size_t(len(vrs)),
            pointer(values),
            ctypes.c_size_t(values.size),
        )
        return values

    def get_time(self) -> float:
        vrs, values = np.zeros(1, dtype=np.uint32), np.zeros(1)
        self.do("GetFloat64", pointer(vrs), ctypes.c_size_t(1), pointer(values), ctypes.c_size_t(1))
        return float(values[0])

    def try_set(self, section: str, values) -> int:
        vrs, data = self.vrs(section), np.ascontiguousarray(np.ravel(values), dtype=float)
        return self.call(
            "SetFloat64", pointer(vrs), ctypes.c_size_t(len(vrs)), pointer(data), ctypes.c_size_t(data.size)
        )

    def set(self, section: str, values) -> None:
        assert self.try_set(section, values) == OK, self.messages[-1:]

    def set_integer(self, name: str, value: int) -> int:
        vrs, data = self.vrs(name), np.array([value], dtype=np.int32)
        return self.call("SetInt32", pointer(vrs), ctypes.c_size_t(1), pointer(data), ctypes.c_size_t(1))

    def try_command(self, values) -> int:
        vrs, data = self.vrs("EVENT_COMMAND"), np.array(values, dtype=np.bool_)
        size = ctypes.c_size_t
        return self.call("SetBoolean", pointer(vrs), size(len(vrs)), pointer(data), size(data.size))

    def commands(self) -> list[bool]:
        vrs, data = self.vrs("EVENT_COMMAND"), np.zeros(self.size("EVENT_COMMAND"), dtype=np.bool_)
        size = ctypes.c_size_t
        self.do("GetBoolean", pointer(vrs), size(len(vrs)), pointer(data), size(data.size))
        return data.tolist()

    def try_step(self, point: float, size: float) -> tuple[int, bool, float]:
        flags_, last = (ctypes.c_bool * 3)(), ctypes.c_double()
        at = [ctypes.byref(flags_, k) for k in range(3)]
        status = self.call(
            "DoStep", ctypes.c_double(point), ctypes.c_double(size), True, *at, ctypes.byref(last)
        )
        return status, flags_[2], last.value

    def step(self, point: float, size: float) -> None:
        status, _, _ = self.try_step(point, size)
        assert status == OK, self.messages[-1:]

    def get_state(self) -> ctypes.c_void_p:
        handle = ctypes.c_void_p()
        self.do("GetFMUState", ctypes.byref(handle))
        return handle

    def serialize(self, handle: ctypes.c_void_p) -> bytes:
        size = ctypes.c_size_t()
        self.do("SerializedFMUStateSize", handle, ctypes.byref(size))
        data = ctypes.create_string_buffer(size.value)
        self.do("SerializeFMUState", handle, data, size)
        return data.raw

    def deserialize(self, data: bytes) -> tuple[int, ctypes.c_void_p]:
        handle = ctypes.c_void_p()
        return self.call(
            "DeserializeFMUState", data, ctypes.c_size_t(len(data)), ctypes.byref(handle)
        ), handle

    def derivative(self, kind: str, unknowns, knowns, seed) -> np.ndarray:
        of, by = self.vrs(*unknowns), self.vrs(*knowns)
        seed = np.ascontiguousarray(seed, dtype=float)
        out = np.full(self.size(*(unknowns if kind == "Directional" else knowns)), math.nan)
        size = ctypes.c_size_t
        self.do(
            f"Get{kind}Derivative",
            pointer(of),
            size(len(of)),
            pointer(by),
            size(len(by)),
            pointer(seed),
            size(seed.size),
            pointer(out),
            size(out.size),
        )
        return out

    def free(self) -> None:
        self.library.fmi3FreeInstance(self.at)
