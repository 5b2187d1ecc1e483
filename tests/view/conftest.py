import pytest

from linkwind import aero
from linkwind.runs.run import run
from linkwind.scenario import load
from tests.flows import VortexModel
from tests.report.chromium import PROGRAM, Chromium
from tests.volumes import VolumeModel

SPINNER = """
name = "spinner"
[time]
end = 0.2
[environment]
wind = ["20*t", 0, 0]
[[bodies]]
name = "arm"
mass = 1.0
inertia = [0.02, 0.06, 0.07, 0.0, 0.0, 0.0]
shape = { type = "rectangle", length = 0.6, width = 0.1, span = 0.05 }
angular_velocity = [1.0, 2.0, 9.0]
[[joints]]
name = "ball"
type = "spherical"
parent = "world"
child = "arm"
child_point = [-0.3, 0.0, 0.0]
[bus]
transport = "inprocess"
"""


WAKES = [
    "time.end=0.04",
    "aero.model=vortex",
    *(f"aero.vortex.{setting}" for setting in ("chordwise=2", "spanwise=3", "wake=15", "frames=4")),
]


@pytest.fixture(scope="package")
def logs(tmp_path_factory):
    """Logs by name: planar, with a flow, in space, with wakes, with fluid in a box, cut."""
    folder = tmp_path_factory.mktemp("logs")
    here = ["bus.transport=inprocess"]

    def log(name, scenario, settings):
        return run(load(scenario, settings), folder / name, lambda step: None).log

    (folder / "spinner.toml").write_text(SPINNER)
    made = {
        "planar": log("planar", "two_link", [*here, "time.end=0.3"]),
        "space": log("space", str(folder / "spinner.toml"), []),
        "wakes": log("wakes", "flapper", [*here, *WAKES]),
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(aero.MODELS, "none", lambda scenario, provider: VortexModel(every=10))
        made["flow"] = log("flow", "two_link", [*here, "time.end=0.05", "aero.model=none"])
        patch.setitem(aero.MODELS, "none", lambda scenario, provider: VolumeModel(every=20))
        made["volumes"] = log("volumes", str(folder / "spinner.toml"), ["time.end=0.06", "aero.model=none"])
    (folder / "cut").mkdir()
    made["cut"] = folder / "cut" / "log.mcap"
    made["cut"].write_bytes(made["planar"].read_bytes()[:-200_000])
    return made


@pytest.fixture(scope="package")
def browser(tmp_path_factory):
    if PROGRAM is None:
        pytest.skip("needs chromium: apt-get install chromium")
    chromium = Chromium(tmp_path_factory.mktemp("profile"))
    size = {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    chromium.send("Emulation.setDeviceMetricsOverride", **size)
    yield chromium
    chromium.close()
