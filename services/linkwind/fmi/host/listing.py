"""A mapping as a table to read, and as the beginning of one to write."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from linkwind.fmi.host.facts import Description
from linkwind.fmi.host.links import Link, Mapping
from linkwind.fmi.host.quantities import INPUTS, OUTPUTS
from linkwind.scenario.providers import FmuModel, FmuVariable

_QUANTITIES = {**INPUTS, **OUTPUTS}


def rows(mapping: Mapping) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Yield direction, FMU variable, unit, quantity, conversion and how it was found; a line per vector."""
    for arrow, links in (("→ in", mapping.inputs), ("← out", mapping.outputs)):
        for _, group in groupby(links, key=lambda link: _alike(link)):
            part = list(group)
            elements = part[0].element if len(part) == 1 else f"{part[0].element} … {part[-1].element}"
            yield (
                arrow,
                elements,
                part[0].unit or "-",
                _quantity(mapping, part),
                _conversion(part[0]),
                part[0].by,
            )
    for name in mapping.held:
        yield "→ in", name, "", "held at its start value", "", "table"
    for name in mapping.unmapped:
        yield "→ in", name, "", "NOT MAPPED", "", ""
    if mapping.ignored:
        names = ", ".join(mapping.ignored[:6]) + (" …" if len(mapping.ignored) > 6 else "")
        yield "← out", names, "", "not used", "", ""


def _alike(link: Link) -> tuple[object, ...]:
    unit = "" if link.quantity == "added_inertia" else link.unit
    return link.quantity, link.body, link.frame, link.point, link.gain, link.bias, unit, link.by


def _quantity(mapping: Mapping, part: list[Link]) -> str:
    link = part[0]
    names = [_QUANTITIES[link.quantity].components[each.component] for each in part]
    if len(names) > 6:
        names = [f"{len(names)} elements"]
    body = "each body" if mapping.per_body else mapping.bodies[link.body]
    return f"{link.quantity} {' '.join(names)}".strip() + f" of {body}"


def _conversion(link: Link) -> str:
    parts = [f"{link.frame} frame"] if link.quantity not in ("angle", "density", "added_inertia") else []
    if link.quantity == "added_inertia":
        parts = ["body frame"]
    if link.point is not None:
        parts.append(f"at {list(link.point)}")
    if link.gain != 1.0:
        parts.append(f"× {link.gain:.6g}")
    if link.bias:
        parts.append(f"{'+' if link.bias > 0 else '−'} {abs(link.bias):.6g}")
    return ", ".join(parts)


def text(fmu: Description, mapping: Mapping) -> str:
    """Return the mapping as a table of plain text."""
    table = [("", f"variable of {fmu.path.name}", "unit", "quantity", "taken as", "by"), *rows(mapping)]
    widths = [max(len(row[column]) for row in table) for column in range(6)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in table
    ]
    lines.insert(1, "─" * max(map(len, lines)))
    return "\n".join(lines)


def entries(mapping: Mapping, settings: FmuModel) -> dict[str, FmuVariable]:
    """Return a table entry for every mapped element, and those of the scenario for outputs not used."""
    written = {name: entry for name, entry in settings.variables.items() if entry.quantity == "none"}
    for link in (*mapping.inputs, *mapping.outputs):
        given = settings.variables.get(link.element) or settings.variables.get(link.element.split("[")[0])
        base = given or FmuVariable(quantity="")
        frame = link.frame if _QUANTITIES[link.quantity].turns else None
        update = {"quantity": _name(mapping, link), "frame": frame, "point": link.point}
        written[link.element] = base.model_copy(update=update)
    return written


def toml(fmu: Description, mapping: Mapping) -> str:
    """Return ``[aero.fmu]`` with an entry for every input and output, to be changed."""
    lines = [
        f"# Run with: linkwind run SCENARIO --force-fmu {fmu.path.name}",
        "[aero]",
        'model = "fmu"',
        "",
        "[aero.fmu]",
        f'sha256 = "{fmu.sha256}"',
        "",
        "# [body.]quantity[.component], or a table with quantity, frame, point, unit, scale, offset",
        "[aero.fmu.variables]",
    ]
    lines += [f'"{link.element}" = {_entry(mapping, link)}' for link in (*mapping.inputs, *mapping.outputs)]
    lines += [f'# "{name}" = "…"   # input without a meaning: must be mapped' for name in mapping.unmapped]
    lines += [f'# "{name}" = "…"   # output, not used' for name in mapping.ignored]
    return "\n".join(lines) + "\n"


def _name(mapping: Mapping, link: Link) -> str:
    label = _QUANTITIES[link.quantity].label(link.component)
    return (
        f"{link.quantity}{label}"
        if mapping.per_body
        else f"{mapping.bodies[link.body]}.{link.quantity}{label}"
    )


def _entry(mapping: Mapping, link: Link) -> str:
    name = _name(mapping, link)
    if link.frame == "world" and link.point is None:
        return f'"{name}"'
    point = f", point = {list(link.point)}" if link.point else ""
    return f'{{ quantity = "{name}", frame = "{link.frame}"{point} }}'
