"""The layout for Foxglove and Lichtblick: what its importer asks for, and topics that the log has.

The importer is ``validateLayoutData`` of Lichtblick's ``util/layout.ts``.
"""

import json
import re
import subprocess
import sys

import pytest

from linkwind.log.reader import open_log
from linkwind.view.foxglove import layout
from linkwind.view.recording import open_recording


def leaves(node):
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column")
    assert 0 < node["splitPercentage"] < 100
    return leaves(node["first"]) + leaves(node["second"])


@pytest.mark.parametrize("name", ["planar", "flow", "space", "wakes", "volumes"])
def test_the_importer_takes_it(logs, name):
    made = json.loads(json.dumps(layout(open_recording(logs[name]))))
    assert all(isinstance(made[key], dict) for key in ("configById", "globalVariables", "userNodes"))
    assert isinstance(made["playbackConfig"]["speed"], float)
    assert sorted(leaves(made["layout"])) == sorted(made["configById"])
    assert {panel.split("!")[0] for panel in made["configById"]} == {"3D", "Plot"}


@pytest.mark.parametrize("name", ["planar", "flow", "space", "wakes", "volumes"])
def test_the_log_has_what_it_shows(logs, name):
    log = open_log(logs[name])
    made = layout(open_recording(logs[name]))["configById"]
    scene = made["3D!mechanism"]
    assert set(scene["topics"]) <= set(log.topics)
    assert scene["followTf"] in log.bodies
    assert ("/flow/aero" in scene["topics"]) == (name == "flow")
    assert ("/scene/wake/aero" in scene["topics"]) == (name == "wakes")
    assert ("/scene/volume/aero" in scene["topics"]) == (name == "volumes")
    assert scene["cameraState"]["perspective"] == (name in ("space", "wakes", "volumes"))
    columns = log.columns("/state")
    curves = [curve["value"] for panel in made.values() for curve in panel.get("paths", ())]
    assert len(curves) > 4
    for curve in curves:
        topic, field, index = re.fullmatch(r"(/\w+)\.([\w.]+?)(?:\[(\d+)\])?", curve).groups()
        assert topic == "/state"
        assert int(index or 0) < columns[field].shape[1]


def test_the_command_writes_it(logs, tmp_path):
    file = tmp_path / "layout.json"
    command = [
        sys.executable,
        "-m",
        "linkwind",
        "view",
        str(logs["flow"].parent),
        "--foxglove-layout",
        str(file),
    ]
    subprocess.run(command, check=True, capture_output=True)
    assert json.loads(file.read_text())["configById"]
