"""``terminalsAndIcons.xml`` of FMI 3: a terminal for each body, so that tools connect all of it at once.

The rule is ``bus``: what has the same name on both sides is connected. The terminals of a mechanism and of
its force model fit each other.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from linkwind.fmi.description import to_bytes
from linkwind.fmi.part import Part
from linkwind.fmi.picture import Stroke

KIND = "linkwind.body"
ICON = "body"
ICON_DRAWING = [
    Stroke((0.5, 0.5), (0.5, 0.5), 0.9, "#e07b39"),
    Stroke((0.5, 0.5), (0.5, 0.5), 0.4, "#ffffff"),
]
_SIDE = 100.0  # of the FMU's icon, in the units of its coordinate system
_HALF = 4.0  # of a terminal's


def terminals(part: Part) -> bytes:
    """Return the XML file."""
    root = ET.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = ET.SubElement(root, "GraphicalRepresentation")
    square = {"x1": "0", "y1": "0", "x2": f"{_SIDE:g}", "y2": f"{_SIDE:g}"}
    ET.SubElement(graphics, "CoordinateSystem", square | {"suggestedScalingFactorTo_mm": "0.2"})
    ET.SubElement(graphics, "Icon", square)
    group = ET.SubElement(root, "Terminals")
    side = _SIDE if part.name == "dynamics" else 0.0
    for i, body in enumerate(part.bodies):
        terminal = ET.SubElement(
            group,
            "Terminal",
            name=body,
            matchingRule="bus",
            terminalKind=KIND,
            description=f"Wrench on {body} and its motion",
        )
        for variable in part.variables:
            owner, _, member = variable.name.partition(".")
            if owner == body and variable.causality in ("input", "output"):
                ET.SubElement(
                    terminal,
                    "TerminalMemberVariable",
                    variableName=variable.name,
                    memberName=member,
                    variableKind="signal",
                )
        height = _SIDE * (1.0 - (i + 0.5) / len(part.bodies))
        corners = zip(("x1", "y1", "x2", "y2"), (-_HALF, -_HALF, _HALF, _HALF), strict=True)
        place = {name: f"{(side if name[0] == 'x' else height) + off:g}" for name, off in corners}
        ET.SubElement(terminal, "TerminalGraphicalRepresentation", place | {"iconBaseName": ICON})
    return to_bytes(root)
