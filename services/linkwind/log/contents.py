"""What a linkwind log holds, by the names that its writer and its reader share.

Topics carry the messages of ``schemas/linkwind/v1``; ``log_time`` is simulation time [ns]. Beside them
the file has the resolved scenario as an attachment and metadata records.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable

LOG = "log.mcap"  # in the folder of a run
PROFILE = "linkwind"  # of the MCAP header
PACKAGE = "linkwind.v1."

MOTION, STATE, STEP, TIMING = "/motion", "/state", "/step", "/timing"
WRENCH = "/wrench/"  # and the name of the provider
FLOW = "/flow/"  # and the name of the provider: foxglove.Grid
VOLUME, WAKE = "/volume/", "/wake/"  # and the name of the provider: VolumeFrame, WakeFrame, without a sender
FRAMES = (FLOW, VOLUME, WAKE)
CHECKPOINT = "/checkpoint/"  # and the name of the provider
TRANSFORMS, SCENE = "/tf", "/scene"  # pictures for Foxglove, decimated
SCENE_OF = {kind: f"{SCENE}{kind}" for kind in (VOLUME, WAKE)}  # and the provider: its frames, for Foxglove

MESSAGE_OF = {MOTION: "MotionStep", STATE: "State", STEP: "Step", TIMING: "Timing"}
MESSAGES_OF = {WRENCH: "WrenchStep", VOLUME: "VolumeFrame", WAKE: "WakeFrame", CHECKPOINT: "Checkpoint"}

SCENARIO = "scenario.json"  # attachment: the resolved scenario

RUN = "linkwind"  # metadata: run id, bodies, schema hash and what the caller adds
VERSIONS = "linkwind.versions"  # metadata: versions of the programs, processor
DIAGNOSTICS = "linkwind.diagnostics"  # metadata: names of each provider's own numbers; missing without any
PROGRAMS = "linkwind.programs"  # metadata: program and version of each provider, as it said
RETURNS = "linkwind.returns"  # metadata: providers that were lost and came back; missing without any
HEARD = "linkwind.heard"  # metadata: what a listener has missed; missing in a log of the dynamics' own
END = "linkwind.end"  # metadata: how the run ended; missing when the writer was killed

# In RUN, where the run does not come from a scenario alone:
RESUMED_STEP, CHANGES = "resumed_step", "changes"  # after which step it went on; scenarios by step (JSON)
SUBSTITUTED = "substituted"  # which side was live, DYNAMICS or the name of a provider
RECORD = "recorded_log"  # the file that the other side comes from
DYNAMICS = "dynamics"

OURS = "linkwind "  # how a provider of linkwind's begins in PROGRAMS


def providers(kind: str, topics: Iterable[str]) -> tuple[str, ...]:
    """Return the providers that have a topic of a kind such as ``FLOW``, in the order of the topics."""
    return tuple(topic.removeprefix(kind) for topic in topics if topic.startswith(kind))


def message_name(topic: str) -> str | None:
    """Return the name of the message that a topic carries, None for a topic that is not linkwind's."""
    for start, name in MESSAGES_OF.items():
        if topic.startswith(start):
            return name
    return MESSAGE_OF.get(topic)


def sealed(record: dict[str, str]) -> dict[str, str]:
    """Return a metadata record with a checksum, which MCAP itself does not give it."""
    return record | {"crc32": _checksum(record)}


def unsealed(record: dict[str, str]) -> dict[str, str] | None:
    """Return a metadata record without its checksum, None if the checksum is wrong."""
    bare = {key: value for key, value in record.items() if key != "crc32"}
    return bare if record.get("crc32") == _checksum(bare) else None


def _checksum(record: dict[str, str]) -> str:
    return f"{zlib.crc32(json.dumps(record, sort_keys=True).encode()):08x}"
