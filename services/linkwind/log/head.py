"""What a log says of its run: scenario, bodies, providers, versions, how it ended, and what is missing."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from linkwind.errors import LogError
from linkwind.log import contents
from linkwind.log.chunks import MAGIC, ChannelInfo, record_at
from linkwind.log.facts import Damage
from linkwind.log.scan import Contents

LARGEST_HEADER = 1000  # bytes of MCAP's own first record, and more


class Head:
    """The records of a log that are not messages.

    Attributes:
        path: of the file.
        damage: what is missing, None for a file that is whole.

    Raises:
        LogError: the log is not one of linkwind's.
    """

    def __init__(self, path: Path, found: Contents) -> None:
        self.path = path
        self._contents = found
        self.damage: Damage | None = None
        self._check_origin()

    def record(self, name: str) -> dict[str, str]:
        """Return a metadata record, empty where there is none."""
        return self._contents.metadata.get(name, {})

    @property
    def metadata(self) -> dict[str, str]:
        """Run id, schema hash and what the writer was given besides."""
        return self.record(contents.RUN)

    @property
    def versions(self) -> dict[str, str]:
        """Versions of the programs that made the log, and the processor."""
        return self.record(contents.VERSIONS)

    @property
    def ending(self) -> dict[str, str]:
        """How the run ended, as it was recorded; empty if the writer was killed."""
        return self.record(contents.END)

    @property
    def heard(self) -> bool:
        """Whether a listener made the log, rather than the dynamics."""
        return contents.HEARD in self._contents.metadata

    def _check_origin(self) -> None:
        profile = self._contents.profile
        if profile != contents.PROFILE and contents.RUN not in self._contents.metadata:
            raise LogError(
                f'{self.path}: header: expected profile "{contents.PROFILE}"; got "{profile}". '
                "Another program wrote this MCAP file; give the log.mcap of a linkwind run."
            )

    def check_schemas(self, channels: Iterable[ChannelInfo]) -> None:
        """Raise LogError if a topic of linkwind carries something else than it should."""
        for topic, schema, _ in channels:
            name = contents.message_name(topic)
            if name is not None and schema.name != contents.PACKAGE + name:
                raise LogError(
                    f'{self.path}: {topic}: expected schema {contents.PACKAGE}{name}; got "{schema.name}". '
                    "Read this log with the version of linkwind that wrote it."
                )

    @property
    def run(self) -> str:
        """Id of the run."""
        return self._known(self.metadata.get("run"), "the run id")

    @property
    def has_scenario(self) -> bool:
        """Whether the scenario can be read."""
        return contents.SCENARIO in self._contents.attachments

    @property
    def scenario_json(self) -> str:
        """The resolved scenario."""
        scenario = self._contents.attachments.get(contents.SCENARIO)
        return self._known(None if scenario is None else scenario.decode(), "the scenario")

    @property
    def changes(self) -> dict[int, str]:
        """Scenarios that a resumed run went on with, by the step after which each counts."""
        changes = json.loads(self.metadata.get(contents.CHANGES, "{}"))
        return {step: changes[str(step)] for step in sorted(map(int, changes))}

    @property
    def bodies(self) -> tuple[str, ...]:
        """Bodies in the order of the messages."""
        return tuple(json.loads(self._known(self.metadata.get("bodies"), "the list of bodies")))

    @property
    def provider_bodies(self) -> dict[str, tuple[str, ...]]:
        """Bodies of each provider, in the order of its WrenchStep."""
        providers = json.loads(self._known(self.metadata.get("provider_bodies"), "the list of providers"))
        return {name: tuple(bodies) for name, bodies in providers.items()}

    @property
    def diagnostics(self) -> dict[str, tuple[str, ...]]:
        """Names of the numbers that each provider reports with its wrenches; those that have any."""
        record = self.record(contents.DIAGNOSTICS)
        return {provider: tuple(json.loads(names)) for provider, names in record.items()}

    @property
    def foreign(self) -> dict[str, str]:
        """The providers that were programs of somebody else, and which, for people."""
        programs = self.record(contents.PROGRAMS)
        return {
            name: program or "a program that did not say which"
            for name, program in programs.items()
            if not program.startswith(contents.OURS)
        }

    def _known(self, value: str | None, what: str) -> str:
        if value is None:
            text = self.damage.text if self.damage else "a log without it"
            raise LogError(
                f"{self.path}: expected {what} at the beginning; got {text}. Run the scenario again."
            )
        return value

    @property
    def complete(self) -> bool:
        """Whether the run came to its end and every message of it can be read."""
        return self.damage is None and self.ending.get("complete") == "true"

    @property
    def error(self) -> str | None:
        """What ended the run early: class and text; None if nothing did or the writer was killed."""
        return f"{self.ending['error']}: {self.ending['text']}" if "error" in self.ending else None

    @property
    def final_state_sha256(self) -> str | None:
        """Of the last accepted state; None for a run without an end."""
        return self.ending.get("final_state_sha256")


def check_magic(path: Path) -> None:
    """Raise LogError unless a file can be opened and starts like an MCAP file."""
    try:
        with path.open("rb") as file:
            start = file.read(len(MAGIC))
    except OSError as error:
        raise LogError(f"{path}: expected a log; got {error.strerror}. Check the path.") from error
    if start != MAGIC:
        line = start.split(b"\n")[0]
        shown = f'"{line.decode()}"' if line.isascii() and line.decode().isprintable() else start.hex(" ")
        got = f"a file that starts with {shown}" if start else "an empty file"
        raise LogError(f"{path}: expected an MCAP file; got {got}. Give the log.mcap of a linkwind run.")


def is_blank(path: Path) -> bool:
    """Tell whether a file is a log whose writer was killed before it had said what it is of."""
    with path.open("rb") as file:
        start = file.read(LARGEST_HEADER)
    whole = len(start) == LARGEST_HEADER or record_at(start, len(MAGIC)) is not None
    return not whole and MAGIC.startswith(start[: len(MAGIC)])
