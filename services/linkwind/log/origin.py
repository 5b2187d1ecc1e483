"""Where the run of a log comes from, for people, and what it came through, if not from its scenario alone."""

from __future__ import annotations

import json
from collections.abc import Iterator

from linkwind.log import contents
from linkwind.log.reader import Log


def origin(log: Log) -> Iterator[str]:
    """Yield what there is to be said, a sentence each: nothing for a run from beginning to end."""
    metadata = log.metadata
    for provider in json.loads(log.scenario_json)["providers"]:
        own = provider.get(provider["model"], {})
        if "sha256" in own:
            file = own.get("source", "an FMU")
            yield f'the forces of "{provider["name"]}" come from {file} with SHA-256 {own["sha256"]}'
    for name, program in log.foreign.items():
        yield f'the forces of "{name}" come from a program that is not linkwind\'s: {program}'
    record = metadata.get(contents.RECORD)
    if contents.RESUMED_STEP in metadata:
        yield f"resumed after step {metadata[contents.RESUMED_STEP]} of run {metadata['resumed_run']}"
    for step in log.changes:
        yield f"other settings count after step {step}"
    for text in log.record(contents.RETURNS).values():
        back = json.loads(text)
        name, step, after_s = back["provider"], back["step"], back["after_s"]
        yield f'"{name}" was lost at step {step} and came back after {after_s:.1f} s'
    if log.heard:
        yield "heard on the bus by linkwind record"
    live = metadata.get(contents.SUBSTITUTED)
    if live == contents.DYNAMICS:
        yield f"live dynamics under the forces recorded in {record}"
    elif live is not None:
        yield (
            f'"{live}" live against the motion recorded in {record}: wrenches are live ones, motion, joint '
            "reactions and energies the recorded ones"
        )
