"""FMUs that several tests share: each is made once."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import pytest

from linkwind.fmi.export import Exported, content_of, export
from linkwind.fmi.part import EXPORTABLE
from linkwind.scenario import builtin_names, load
from tests.fmi.scenes import eventful, servo, sheared, spatial

# part, version of FMI, arrays
FORMS = [
    (part, fmi, arrays)
    for part in ("dynamics", "aero")
    for fmi, arrays in (("2", "native"), ("3", "native"), ("3", "scalar"))
]
# A flow is not exported, and the mechanisms in one are those of the others.
SCENARIOS = (
    "spatial",
    "eventful",
    "servo",
    *(n for n in builtin_names() if load(n).providers[0].model in EXPORTABLE),
)


@cache
def scenario(name: str):
    own = {"spatial": spatial, "eventful": eventful, "servo": servo, "sheared": sheared}
    return own[name]() if name in own else load(name)


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    """Return a function: the file of an FMU for this machine."""
    folder = tmp_path_factory.mktemp("fmus")

    @cache
    def make(name="two_link", fmi="3", part="dynamics", arrays="native"):
        out = folder / f"{name}-{fmi}-{part}-{arrays}.fmu"
        return export(scenario(name), out, fmi=fmi, part=part, arrays=arrays).file

    return make


@pytest.fixture(scope="session")
def unpacked(tmp_path_factory):
    """Return a function: a folder with everything of an FMU but binaries."""

    @cache
    def make(name, part, fmi, arrays):
        folder = tmp_path_factory.mktemp("unpacked")
        for path, content in content_of(scenario(name), fmi=fmi, part=part, arrays=arrays).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
        return folder

    return make


@pytest.fixture(scope="session")
def everywhere(tmp_path_factory) -> Exported:
    """The FMU of two_link for all platforms, FMI 3."""
    if find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed: pip install 'linkwind[fmu]'")
    out = tmp_path_factory.mktemp("everywhere") / "all.fmu"
    return export(scenario("two_link"), out, fmi="3", platforms=["all"])
