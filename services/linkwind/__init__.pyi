"""The types of what ``import linkwind`` offers, for editors and checkers; ``__init__.py`` loads it lazily."""

from linkwind.aero.base import Capabilities, ForceModel
from linkwind.api import means, resume, run, serve, table, verify
from linkwind.errors import LinkwindError
from linkwind.fmi.export import export as export_fmu
from linkwind.log.reader import open_log
from linkwind.scenario import load, loads
from linkwind.wind import Wind

__all__ = [
    "Capabilities",
    "ForceModel",
    "LinkwindError",
    "Wind",
    "export_fmu",
    "load",
    "loads",
    "means",
    "open_log",
    "resume",
    "run",
    "serve",
    "table",
    "verify",
]
__version__: str
