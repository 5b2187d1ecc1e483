"""The constants of an FMU as C: ``lw_fmu_data.c``, from the same list as the model description."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from linkwind.fmi.layout import starts
from linkwind.fmi.part import Part
from linkwind.fmi.variables import Variable

_PER_LINE = 8


def source(part: Part, token: str) -> str:
    """Return the C file with the tables of ``part`` and the token of its model description."""
    lines = [
        f"/* The constants of the model {part.identifier}, written by linkwind. */",
        '#include "lw_fmu.h"',
        "",
        f'const char lw_fmu_token[] = "{token}";',
        f'const char lw_fmu_model_name[] = "{part.scenario.name}";',
        "",
        "const lw_fmu_variable lw_fmu_variables[] = {",
        *_variables(part),
        "};",
        f"const uint32_t lw_fmu_variable_count = {len(part.variables)};",
        "",
    ]
    start = part.start()
    lines += _array("double", "start", map(float.hex, start.tolist()))
    lines.append(f"const uint32_t lw_fmu_value_count = {len(start)};")
    lines += _array("int32_t", "integers", map(str, part.integers))
    for name, table in part.tables.items():
        if isinstance(table, int):
            lines.append(f"const int32_t lw_fmu_{name} = {table};")
        elif table.dtype == np.float64:
            lines += _array("double", name, map(float.hex, table.ravel().tolist()))
        else:
            lines += _array("int32_t", name, map(str, table.ravel().tolist()))
    return "\n".join(lines) + "\n"


def _variables(part: Part) -> Iterator[str]:
    first = starts(part.sections)
    for variable in part.variables:
        if variable.causality == "independent":
            fields = ["LW_TYPE_TIME", "LW_INDEPENDENT", "0", "0", "1"]
        elif variable.integer:
            fields = ["LW_TYPE_INT32", "LW_TUNABLE_PARAMETER", "0", str(variable.offset), "1"]
        else:
            section = f"LW_{part.name.upper()}_{variable.section}"
            offset = first[variable.section] + variable.offset
            fields = [
                f"LW_TYPE_{variable.type.upper()}",
                _causality(variable),
                section,
                str(offset),
                str(variable.size),
            ]
        yield f'    {{"{variable.name}", {", ".join(fields)}}},'


def _causality(variable: Variable) -> str:
    if variable.causality == "parameter":
        return f"LW_{variable.variability.upper()}_PARAMETER"
    if variable.causality == "input":
        return "LW_DISCRETE_INPUT" if variable.variability == "discrete" else "LW_INPUT"
    return "LW_STATE" if variable.initial == "exact" else "LW_CALCULATED"


def _array(kind: str, name: str, items: Iterable[str]) -> list[str]:
    values = list(items) or ["0"]  # C has no empty arrays
    rows = [values[at : at + _PER_LINE] for at in range(0, len(values), _PER_LINE)]
    return [
        f"const {kind} lw_fmu_{name}[] = {{",
        *(f"    {', '.join(row)}," for row in rows),
        "};",
    ]
