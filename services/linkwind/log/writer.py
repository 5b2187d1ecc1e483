"""Writing the authoritative log of a run.

The MCAP writer is foxglove-sdk's (Rust). Messages gather in a chunk; a chunk reaches the file whole, with
its checksum, when it is full and at every flush. Hence a process that is killed loses at most the
messages since the last flush, and what is in the file can be trusted. Chunks are not compressed: the
trajectory is full-precision float64, of which zstd saves a tenth and costs more than the writing.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any

from foxglove import Channel, Context, Schema, open_mcap
from foxglove.channels import FrameTransformsChannel, SceneUpdateChannel
from foxglove.mcap import MCAPWriteOptions
from foxglove.messages import Grid, SceneUpdate

from linkwind import schema
from linkwind.errors import LogError
from linkwind.frames import Frame
from linkwind.log import contents, frames
from linkwind.log.scene import Scene
from linkwind.log.sink import Sink
from linkwind.log.versions import versions
from linkwind.spatial import Array, Motion

_log = logging.getLogger("linkwind")

FLUSH_INTERVAL = 1.0  # s
CHUNK_SIZE = 256 * 1024  # bytes; a chunk is what a damaged byte makes unreadable


class LogWriter:
    """One log file, from the start of a run to its end; an exception that leaves the block is recorded::

        with LogWriter(path, run=run, ...) as log:
            ...
            log.close(final_state_sha256=digest)

    Args:
        path: file to make; it must not exist.
        run: id of the run.
        scenario_json: the resolved scenario.
        body_names: bodies in the order of the messages.
        provider_bodies: bodies of each provider, in the order of its WrenchStep.
        metadata: what else belongs to the run, such as ``tables_sha256`` and ``library_sha256``.
        required: whether a log that cannot be written ends the run.

    Attributes:
        path: the file.
        flush_interval: wall-clock time [s] after which messages are in the file; may be changed at any time.
        records: metadata written so far, by name.

    Raises:
        LogError: the file exists or cannot be made.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        run: str,
        scenario_json: str,
        body_names: Sequence[str],
        provider_bodies: Mapping[str, Sequence[str]],
        metadata: Mapping[str, str],
        flush_interval: float = FLUSH_INTERVAL,
        required: bool = True,
    ) -> None:
        self.path = Path(path)
        self.flush_interval, self._required = flush_interval, required
        self.cut = ""
        self._open()
        self._write_head(run, scenario_json, body_names, provider_bodies, metadata)
        self._channels(provider_bodies)
        self._scene = Scene(json.loads(scenario_json))
        self._calls = self._states = 0
        self._closed = False
        self.flush()

    @property
    def size(self) -> int:
        """Bytes that the file was given so far."""
        return self._file.seek(0)

    def _open(self) -> None:
        try:
            self._file = Sink(self.path)
        except OSError as error:
            raise LogError(
                f"{self.path}: expected to make a new log file; got {error.strerror}. Choose another --out."
            ) from error
        # Without seeking, the SDK writes a chunk in one piece, never a part of it.
        how: dict[str, Any] = {"compression": None, "chunk_size": CHUNK_SIZE, "disable_seeking": True}
        options = MCAPWriteOptions(profile=contents.PROFILE, **how)
        self._context = Context()
        self._writer = open_mcap(self._file, context=self._context, writer_options=options)

    def _write_head(
        self,
        run: str,
        scenario_json: str,
        body_names: Sequence[str],
        provider_bodies: Mapping[str, Sequence[str]],
        metadata: Mapping[str, str],
    ) -> None:
        record = {
            "run": run,
            "bodies": json.dumps(list(body_names)),
            "provider_bodies": json.dumps({name: list(bodies) for name, bodies in provider_bodies.items()}),
            "schema_sha256": schema.SHA256,
        }
        self.records: dict[str, dict[str, str]] = {}
        self._write_record(contents.RUN, record | dict(metadata))
        self._write_record(contents.VERSIONS, versions())
        self._writer.attach(
            log_time=0,
            create_time=0,
            name=contents.SCENARIO,
            media_type="application/json",
            data=scenario_json.encode(),
        )

    def _write_record(self, name: str, record: dict[str, str]) -> None:
        self.records[name] = record
        self._writer.write_metadata(name, contents.sealed(record))

    def _channels(self, providers: Mapping[str, Sequence[str]]) -> None:
        self._opened: list[Any] = []
        self._motion = self._channel(contents.MOTION)
        self._wrench = {name: self._channel(contents.WRENCH + name) for name in providers}
        self._state = self._channel(contents.STATE)
        self._step = self._channel(contents.STEP)
        self._timing = self._channel(contents.TIMING)
        self._transforms = FrameTransformsChannel(contents.TRANSFORMS, context=self._context)
        self._scenes = SceneUpdateChannel(contents.SCENE, context=self._context)
        self._opened += [self._transforms, self._scenes]
        self._rare = {contents.TIMING: self._timing}  # the others are opened when there is a message

    def _channel(self, topic: str, kind: Schema | None = None) -> Callable[[bytes, int], None]:
        """Open a channel; return its method that logs a payload at a time, without the layers above.

        Args:
            topic: of linkwind's, which gives the message type, or another.
            kind: the message type of another.
        """
        name = f"{contents.PACKAGE}{contents.message_name(topic)}"
        ours = Schema(name=name, encoding="protobuf", data=schema.DESCRIPTOR_SET)
        channel = Channel(topic, schema=kind or ours, message_encoding="protobuf", context=self._context)
        self._opened.append(channel)
        return channel.base.log

    def motion(self, payload: bytes, time_ns: int) -> None:
        """Log an encoded MotionStep at simulation time ``time_ns``."""
        self._motion(payload, time_ns)
        if monotonic() >= self._due:
            self.flush()

    def wrench(self, provider: str, payload: bytes, time_ns: int) -> None:
        """Log an encoded WrenchStep of ``provider``."""
        self._wrench[provider](payload, time_ns)

    def state(self, payload: bytes, time_ns: int) -> None:
        """Log an encoded State: an accepted communication point."""
        self._states += 1
        self._state(payload, time_ns)
        if monotonic() >= self._due:
            self.flush()

    def step(self, payload: bytes, time_ns: int) -> None:
        """Log an encoded Step."""
        self._step(payload, time_ns)

    def timing(self, payload: bytes, time_ns: int) -> None:
        """Log an encoded Timing."""
        self._timing(payload, time_ns)

    def scene(self, time_ns: int, motion: Motion, force: Array) -> None:
        """Log pictures for Foxglove, of every so many-th call; called once a communication point.

        Args:
            time_ns: simulation time [ns].
            motion: accepted poses, in W at the centres of mass.
            force: total on every body [N], shape (n, 3), in W.
        """
        due = self._calls % self._scene.stride == 0
        self._calls += 1
        if due:
            self._transforms.log(self._scene.transforms(time_ns, motion), log_time=time_ns)
            self._scenes.log(self._scene.update(time_ns, motion, force), log_time=time_ns)

    def frame(self, provider: str, frame: Frame) -> None:
        """Log a frame of the fluid that ``provider`` showed, at the frame's own time."""
        self.copy(frames.topic_of(frame, provider), frames.encode(frame), frame.time_ns)

    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None:
        """Log a piece of a checkpoint of ``provider``, at the checkpoint's own time."""
        self.copy(contents.CHECKPOINT + provider, payload, time_ns)

    def copy(self, topic: str, payload: bytes, time_ns: int) -> None:
        """Log a timing, a frame or a checkpoint as another log has it, and the picture that goes with it."""
        kind = Grid.get_schema() if topic.startswith(contents.FLOW) else None
        self._copy(topic, payload, time_ns, kind)
        picture = frames.picture(topic, payload)
        if picture is not None:
            self._copy(*picture, time_ns, SceneUpdate.get_schema())

    def _copy(self, topic: str, payload: bytes, time_ns: int, kind: Schema | None) -> None:
        if topic not in self._rare:
            self._rare[topic] = self._channel(topic, kind)
        self._rare[topic](payload, time_ns)

    def diagnostics(self, names: Mapping[str, Sequence[str]]) -> None:
        """Record the names of the numbers that providers report with their wrenches; none, nothing."""
        record = {provider: json.dumps(list(each)) for provider, each in names.items() if each}
        if record:
            self._write_record(contents.DIAGNOSTICS, record)

    def programs(self, programs: Mapping[str, str]) -> None:
        """Record which program each provider is, as it says."""
        self._write_record(contents.PROGRAMS, dict(programs))

    def returned(self, provider: str, step: int, after_s: float) -> None:
        """Record that a provider was lost at a step and came back after some time [s].

        The last such record of a log has those before in it.
        """
        before = self.records.get(contents.RETURNS, {})
        back = {"provider": provider, "step": step, "after_s": after_s}
        self._write_record(contents.RETURNS, before | {str(len(before) + 1): json.dumps(back)})

    def flush(self) -> None:
        """Bring every message so far into the file, where a killed process leaves it.

        Raises:
            LogError: a write failed now or before, for want of space say.
        """
        self._writer.flush()
        self._due = monotonic() + self.flush_interval
        self._check()

    def _check(self) -> None:
        if self._file.failure is None:
            return
        why = self._file.failure.strerror
        reason = f"{self.path}: expected to write the log; got {why}. The file is cut there"
        if self._required:
            raise LogError(
                f"{reason}. Free space, or choose another --out, and run again."
            ) from self._file.failure
        if not self.cut:
            self.cut = f"{reason}, about step {max(0, self._states - 1)}"
            _log.warning("%s; the run goes on without (log.required = false)", self.cut)

    def close(self, *, final_state_sha256: str | None = None, error: BaseException | None = None) -> None:
        """Record how the run ended and finish the file; a second call does nothing.

        The run is complete if ``final_state_sha256`` is given and ``error`` is not.

        Args:
            final_state_sha256: of the last accepted state.
            error: what ended the run early.

        Raises:
            LogError: a write failed, and ``error`` does not say so already.
        """
        if self._closed:
            return
        self._closed = True
        complete = error is None and final_state_sha256 is not None
        record = {"complete": json.dumps(complete), "steps": str(max(0, self._states - 1))}
        if final_state_sha256 is not None:
            record["final_state_sha256"] = final_state_sha256
        if error is not None:
            record |= {"error": type(error).__name__, "text": str(error)}
        self._write_record(contents.END, record)
        self._writer.close()
        for channel in self._opened:
            channel.close()
        self._file.close()
        if not isinstance(error, LogError):
            self._check()

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(error=error)
