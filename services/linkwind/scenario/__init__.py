"""Scenarios: TOML files and built-ins, parsed once into frozen, validated models.

>>> scenario = load("two_link", ["coupling.step=5e-4"])
>>> scenario.coupling.step_ns
500000
"""

from linkwind.scenario.bodies import Body, Joint
from linkwind.scenario.loading import builtin_names, builtin_text, from_json, load, loads, template
from linkwind.scenario.model import Scenario
from linkwind.scenario.providers import FieldExpressions, PlateModel, Provider
from linkwind.scenario.settings import Bus, Coupling, Dynamics, Environment, Gust, Time
from linkwind.scenario.shapes import AnyShape, Circle, Ellipse, Ellipsoid, Plate, Polygon, Rectangle, Wing

__all__ = [
    "AnyShape",
    "Body",
    "Bus",
    "Circle",
    "Coupling",
    "Dynamics",
    "Ellipse",
    "Ellipsoid",
    "Environment",
    "FieldExpressions",
    "Gust",
    "Joint",
    "Plate",
    "PlateModel",
    "Polygon",
    "Provider",
    "Rectangle",
    "Scenario",
    "Time",
    "Wing",
    "builtin_names",
    "builtin_text",
    "from_json",
    "load",
    "loads",
    "template",
]
