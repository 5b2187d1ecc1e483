"""The protobuf schema: message classes and hash, from the compiled descriptor set.

The descriptor set is made from ``schemas/linkwind/v1/*.proto`` by the command in ``schemas/README.md``
and committed, so that neither an install nor a run needs the protobuf compiler.
"""

from __future__ import annotations

import hashlib
from importlib.resources import files
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

DESCRIPTOR_SET: bytes = (
    files("linkwind").joinpath("_data", "schemas", "linkwind", "v1", "linkwind.binpb").read_bytes()
)
SHA256: str = hashlib.sha256(DESCRIPTOR_SET).hexdigest()


def _classes() -> dict[str, Any]:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(DESCRIPTOR_SET).file:
        pool.Add(file)
    names = (
        "MotionStep", "WrenchStep", "Motion", "Control", "FlowFrame", "VolumeFrame", "WakeFrame",
        "Checkpoint", "State", "Step", "Timing", "Description", "Ending", "Playback",
    )  # fmt: skip
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"linkwind.v1.{name}"))
        for name in names
    }


MESSAGES: dict[str, Any] = _classes()
