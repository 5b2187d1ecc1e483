"""Golden vectors: bytes made by the protobuf library alone, for implementations in other languages.

``python -m tests.protocol.test_golden`` writes the files again after a change of the schema.
"""

from __future__ import annotations

import base64
import hashlib
import json
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.json_format import MessageToDict, ParseDict

from linkwind.checkpoints import Checkpoint, Joining, State
from linkwind.checkpoints import decode as decode_piece
from linkwind.frames import FlowFrame, Sent, VolumeFrame, WakeFrame, decode
from linkwind.messages import MotionMessage, WrenchMessage
from linkwind.protocol import ProviderSession
from linkwind.schema import MESSAGES
from tests.fakes import FakeModel

GOLDEN = Path(__file__).parents[2] / "schemas" / "golden"

ABOUT = {"name": "linkwind", "entries": [{"key": "run", "value": "golden"}]}


def numbers(count: int, start: float) -> list[float]:
    """Distinct numbers, none of them exact in binary, one negative zero."""
    return [start + i / 10 for i in range(count - 1)] + [-0.0]


def vectors() -> dict[str, tuple[str, dict[str, Any]]]:
    motion = {
        "position": numbers(6, 0.1),
        "orientation": numbers(8, -3.0),
        "linear": numbers(6, 100.0),
        "angular": numbers(6, -1e-9),
    }
    rest = {name: [0.0] * len(values) for name, values in motion.items()}
    step = {"run": "golden", "step": "120", "iteration": 1, "timeNs": "120000000"}
    wrench = {**step, "provider": "aero", "kind": "WRENCH_KIND_POINT"}
    loads = {"force": numbers(6, 0.7), "torque": numbers(6, -12.3)}
    return {
        "motion": ("MotionStep", {**step, "final": 0, "accepted": motion, "trial": rest}),
        "motion_final": ("MotionStep", {**step, "final": 1, "accepted": motion, "trial": motion}),
        "wrench": ("WrenchStep", {**wrench, **loads}),
        "wrench_added_inertia": ("WrenchStep", {**wrench, **loads, "addedInertia": numbers(72, 0.3)}),
        "flow_frame": ("FlowFrame", flow_frame()),
        "volume_frame": ("VolumeFrame", volume_frame()),
        "wake_frame": ("WakeFrame", wake_frame()),
        "checkpoint": ("Checkpoint", checkpoint()),
        "fetch": ("Control", {"fetch": {"name": "aero", "instance": "i", "offset": "5"}}),
        "fetch_answer": ("Control", {"checkpoint": piece(MEMORY, 5, 8)}),
        "welcome_resume": ("Control", {"welcome": welcome()}),
        "welcome_catch_up": ("Control", {"welcome": welcome() | {"catchUp": catch_up()}}),
        "ready_answers": ("Control", {"ready": ready()}),
        "description": ("Description", {"run": "golden", "scenarioJson": "{}", "records": [ABOUT]}),
        "ending": ("Ending", {"records": [ABOUT], "counts": [{"topic": "/motion", "messages": "1202"}]}),
        "playback_seek": ("Playback", {"paused": True, "timeNs": "120000000"}),
        "hello": (
            "Control",
            {"hello": {"name": "aero", "schemaSha256": "00", "version": "linkwind 0.1.0", "instance": "i"}},
        ),
    }


MEMORY = bytes(range(1, 9))  # comes back in two pieces


def checkpoint() -> dict[str, Any]:
    """Four bytes of memory in one piece; bytes are base64 in JSON."""
    state = bytes([0, 1, 128, 255])
    return piece(state, 0, len(state))


def piece(state: bytes, begin: int, end: int) -> dict[str, Any]:
    """A piece of a provider's memory."""
    content = {"sha256": hashlib.sha256(state).digest(), "state": state[begin:end]}
    when = {
        "number": "3",
        "step": "120",
        "timeNs": "120000000",
        "size": str(len(state)),
        "offset": str(begin),
    }
    encoded = {name: base64.b64encode(value).decode() for name, value in content.items()}
    return {"run": "golden", "provider": "aero"} | when | encoded


def welcome() -> dict[str, Any]:
    """A run that goes on after step 120, and changes after step 500."""
    return {
        "run": "golden", "scenarioJson": "{}", "stepNs": "1000000", "steps": "1200",
        "bodies": ["link1", "link2"], "providerBodies": ["link2"], "checkpointEvery": "40",
        "resume": piece(MEMORY, 0, 5),
        "changes": [{"step": "500", "scenarioJson": "{}"}],
    }  # fmt: skip


def catch_up() -> dict[str, Any]:
    """A provider that was lost after its answers to two motions; here three bytes each."""
    motions = [base64.b64encode(bytes([step, 0, 255])).decode() for step in (121, 122)]
    return {"motions": motions, "frames": "4", "framesTaken": "5", "checkpointsTaken": "3"}


def ready() -> dict[str, Any]:
    """Of that provider."""
    answers = hashlib.sha256(b"".join(hashlib.sha256(bytes([n])).digest() for n in (1, 2))).digest()
    return {
        "name": "aero", "instance": "j", "kind": "WRENCH_KIND_POINT", "rollback": True,
        "answersSha256": base64.b64encode(answers).decode(),
    }  # fmt: skip


def flow_frame() -> dict[str, Any]:
    """Two rows of three cells; bytes are base64 in JSON."""
    values = np.array(numbers(24, 0.25), "<f4")
    parts = {"velocity": values[:12], "pressure": values[12:18], "vorticity": values[18:]}
    arrays = {name: base64.b64encode(part.tobytes()).decode() for name, part in parts.items()}
    where = {"cell": 0.1, "originX": -0.0, "originY": -1.25, "rows": 2, "columns": 3}
    when = {"number": "4", "step": "120", "timeNs": "120000000"}
    return {"run": "golden", "provider": "aero", **when, **where, **arrays}


def volume_frame() -> dict[str, Any]:
    """Two layers of two rows of three cells; bytes are base64 in JSON."""
    values = np.array(numbers(48, 0.25), "<f4")
    parts = {"velocity": values[:36], "pressure": values[36:]}
    arrays = {name: base64.b64encode(part.tobytes()).decode() for name, part in parts.items()}
    where = {"cell": 0.1, "originX": -0.0, "originY": -1.25, "originZ": 0.7}
    size = {"layers": 2, "rows": 2, "columns": 3}
    when = {"number": "4", "step": "120", "timeNs": "120000000"}
    return {"run": "golden", "provider": "aero", **when, **size, **where, **arrays}


def wake_frame() -> dict[str, Any]:
    """Two wings, a row of rings on each and one behind it, one ring a row; bytes are base64 in JSON."""
    values = np.array(numbers(40, 0.25), "<f4")
    parts = {"corner": values[:36], "strength": values[36:]}
    arrays = {name: base64.b64encode(part.tobytes()).decode() for name, part in parts.items()}
    when = {"number": "4", "step": "120", "timeNs": "120000000"}
    return {
        "run": "golden",
        "provider": "aero",
        **when,
        "wings": 2,
        "rows": 2,
        "columns": 1,
        "bound": 1,
        **arrays,
    }


def write() -> None:
    for name, (message, values) in vectors().items():
        encoded = ParseDict(values, MESSAGES[message]()).SerializeToString(deterministic=True)
        text = json.dumps(
            {"message": f"linkwind.v1.{message}", "values": values, "bytes": encoded.hex()}, indent=1
        )
        (GOLDEN / f"{name}.json").write_text(text + "\n")


def golden(name: str) -> tuple[dict[str, Any], bytes]:
    file = json.loads((GOLDEN / f"{name}.json").read_text())
    return file["values"], bytes.fromhex(file["bytes"])


@pytest.mark.parametrize("name", list(vectors()))
def test_files_are_current_and_parse_to_their_values(name: str) -> None:
    message, expected = vectors()[name]
    values, encoded = golden(name)
    assert values == expected
    parsed = MESSAGES[message].FromString(encoded)
    assert MessageToDict(parsed) == MessageToDict(ParseDict(expected, MESSAGES[message]()))


@pytest.mark.parametrize("name", ["motion", "motion_final"])
def test_motion_is_written_and_read_as_the_golden_bytes(name: str) -> None:
    values, encoded = golden(name)
    written = MotionMessage("golden", 2)
    written.stamp(int(values["step"]), values["iteration"], int(values["timeNs"]))
    written.final = bool(values["final"])
    for state in ("accepted", "trial"):
        for field, numbers_ in values[state].items():
            getattr(getattr(written, state), field).ravel()[:] = numbers_
    assert written.payload() == encoded
    read = MotionMessage("golden", 2)
    read.load(encoded, "golden")
    assert (*read.at, read.time_ns, read.final) == (
        120,
        1,
        120_000_000,
        name == "motion_final",
    )
    assert read.accepted.position.tobytes() == np.array(values["accepted"]["position"]).tobytes()


def test_a_frame_is_written_and_read_as_the_golden_bytes() -> None:
    values, encoded = golden("flow_frame")
    number, frame = decode(Sent("flow", encoded), "golden", "aero")
    assert isinstance(frame, FlowFrame)
    assert (number, frame.step, frame.time_ns, frame.shape) == (4, 120, 120_000_000, (2, 3))
    assert (frame.cell, frame.origin) == (0.1, (-0.0, -1.25))
    assert frame.vorticity.tobytes() == base64.b64decode(values["vorticity"])
    assert frame.encode("golden", "aero", 4) == encoded


def test_a_box_of_fluid_is_written_and_read_as_the_golden_bytes() -> None:
    values, encoded = golden("volume_frame")
    number, frame = decode(Sent("volume", encoded), "golden", "aero")
    assert isinstance(frame, VolumeFrame)
    assert (number, frame.step, frame.time_ns, frame.shape) == (4, 120, 120_000_000, (2, 2, 3))
    assert (frame.cell, frame.origin) == (0.1, (-0.0, -1.25, 0.7))
    # The second layer begins with number 18, its second row 9 further, the second cell of that 3 further.
    assert frame.velocity[1, 1, 1].tolist() == np.array(numbers(48, 0.25)[30:33], "<f4").tolist()
    assert frame.pressure.tobytes() == base64.b64decode(values["pressure"])
    assert frame.encode("golden", "aero", 4) == encoded


def test_wings_and_wakes_are_written_and_read_as_the_golden_bytes() -> None:
    values, encoded = golden("wake_frame")
    number, frame = decode(Sent("wake", encoded), "golden", "aero")
    assert isinstance(frame, WakeFrame)
    assert (number, frame.step, frame.time_ns, frame.shape, frame.bound) == (
        4,
        120,
        120_000_000,
        (2, 2, 1),
        1,
    )
    # The second wing begins with number 18, its second edge 6 further, the second corner of that 3 further.
    assert frame.corner[1, 1, 1].tolist() == np.array(numbers(40, 0.25)[27:30], "<f4").tolist()
    assert frame.strength.tobytes() == base64.b64decode(values["strength"])
    assert frame.encode("golden", "aero", 4) == encoded


def test_a_checkpoint_is_split_and_joined_as_the_golden_bytes() -> None:
    _, encoded = golden("checkpoint")
    whole = Joining("golden").add(decode_piece(encoded, "golden", "aero"))
    assert whole == Checkpoint(3, 120, 120_000_000, State.of(bytes([0, 1, 128, 255])))
    assert list(whole.pieces("golden", "aero")) == [encoded]


def test_a_provider_gets_its_memory_back_in_the_golden_pieces() -> None:
    model = FakeModel()
    provider = ProviderSession("aero", lambda scenario, name: model)
    provider.instance = "i"
    provider.welcome(golden("welcome_resume")[1])
    assert provider.fetch() == golden("fetch")[1]
    provider.fetched(golden("fetch_answer")[1])
    assert provider.fetch() is None
    provider.build()
    assert model.calls == [("restore", MEMORY)]


@pytest.mark.parametrize("added", [False, True])
def test_wrench_is_written_and_read_as_the_golden_bytes(added: bool) -> None:
    values, encoded = golden("wrench_added_inertia" if added else "wrench")
    written = WrenchMessage("golden", "aero", 2, added_inertia=added)
    written.stamp(120, 1, 120_000_000)
    written.wrench.force.ravel()[:] = values["force"]
    written.wrench.torque.ravel()[:] = values["torque"]
    if written.wrench.added_inertia is not None:
        written.wrench.added_inertia.ravel()[:] = values["addedInertia"]
    assert written.payload() == encoded
    read = WrenchMessage("golden", "aero", 2, added_inertia=added)
    read.load(encoded, "golden")
    assert read.wrench.torque.tobytes() == np.array(values["torque"]).tobytes()


def test_reader_takes_what_any_protobuf_writer_may_write() -> None:
    """Fields in another order, arrays not packed: legal protobuf, other bytes."""
    values, encoded = golden("wrench")
    message = MESSAGES["WrenchStep"].FromString(encoded)
    torque, rest = MESSAGES["WrenchStep"](torque=message.torque), MESSAGES["WrenchStep"].FromString(encoded)
    rest.ClearField("torque")
    force_unpacked = b"".join(b"\x39" + np.float64(f).tobytes() for f in message.force)
    rest.ClearField("force")
    shuffled = torque.SerializeToString() + force_unpacked + rest.SerializeToString()
    assert shuffled != encoded
    read = WrenchMessage("golden", "aero", 2)
    read.load(shuffled, "golden")
    assert read.wrench.force.ravel().tolist() == values["force"]
    assert read.payload() == encoded


def test_descriptor_set_is_current(tmp_path: Path) -> None:
    schemas = runpy.run_path(str(GOLDEN.parent / "compile.py"))
    fresh = tmp_path / "linkwind.binpb"
    schemas["compile_to"](fresh)
    assert fresh.read_bytes() == schemas["TARGET"].read_bytes()


if __name__ == "__main__":
    write()
