"""Cost of logging and of reading, against mcap's Python code and protobuf's parser in the same run.

Processor time, so that what else the machine does hardly counts; the lock-step step alone is wall clock.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time

import numpy as np
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from linkwind.log.reader import open_log
from linkwind.log.state import StateMessage
from linkwind.log.writer import CHUNK_SIZE, LogWriter
from linkwind.runs.run import run
from linkwind.scenario import load
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion
from linkwind.wire import FixedLayout
from tests.log.sample import NQ, NV, N, encoded, motion_step, new_writer, record, state

MESSAGE_COUNT = 20_000
STEPS = 3_000
REPEATS = 3


def best(function, count):
    """Return the time of one of ``count`` calls made by ``function`` [µs], the best of some runs."""
    times = []
    for _ in range(REPEATS):
        start = process_time()
        function()
        times.append(process_time() - start)
    return min(times) / count * 1e6


def row(case, quantity, value, reference, target):
    """Return a row of the table; ok if the value is at most ``target`` times the reference."""
    ratio = value / reference
    return {
        "case": case,
        "quantity": quantity,
        "value": round(value, 3),
        "reference": round(reference, 3),
        "ratio": round(ratio, 3),
        "ok": ratio <= target,
    }


def write_ours(folder, payload):
    path = folder / "ours.mcap"
    path.unlink(missing_ok=True)
    with new_writer(path) as writer:
        motion = writer.motion
        for k in range(MESSAGE_COUNT):
            motion(payload, k)
        writer.close(final_state_sha256="00")


def write_python(folder, payload):
    with (folder / "python.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema("linkwind.v1.MotionStep", "protobuf", b"")
        channel = writer.register_channel("/motion", "protobuf", schema)
        add = writer.add_message
        for k in range(MESSAGE_COUNT):
            add(channel, k, payload, k, k)
        writer.finish()


def repeat(function, *arguments, **options):
    def loop():
        for _ in range(MESSAGE_COUNT):
            function(*arguments, **options)

    return best(loop, MESSAGE_COUNT)


def generic_state(point):
    """Return a State serialised without a template, as protobuf is used everywhere."""
    message = MESSAGES["State"](step=1, time_ns=2, **point.scalars)
    for name in ("position", "orientation", "linear", "angular"):
        getattr(message.motion, name)[:] = getattr(point.motion, name).ravel()
    for name, array in point.arrays.items():
        getattr(message, name)[:] = array.ravel()
    return message.SerializeToString()


def generic_load(data, arrays):
    """Parse a MotionStep and copy its numbers into arrays, without a template."""
    message = MESSAGES["MotionStep"].FromString(data)
    for part in ("accepted", "trial"):
        for name in ("position", "orientation", "linear", "angular"):
            arrays[f"{part}.{name}"][:] = getattr(getattr(message, part), name)


def encoding_rows():
    point = state(np.random.default_rng(0))
    message = motion_step(1, point.motion)
    layout, data = FixedLayout(message), message.SerializeToString()
    ours = repeat(encoded, StateMessage(N, NQ, NV), 1, 2, point)
    return [
        row("State, 3 bodies", "encode_us", ours, repeat(generic_state, point), 1.0),
        row(
            "MotionStep, 3 bodies",
            "payload_us",
            repeat(layout.payload),
            repeat(message.SerializeToString),
            1.0,
        ),
        row(
            "MotionStep, 3 bodies",
            "load_us",
            repeat(layout.load, data),
            repeat(generic_load, data, FixedLayout(message).views),
            1.0,
        ),
    ]


def reading_rows(folder):
    path = folder / "run.mcap"
    record(path, STEPS)

    def mcap_messages():
        with path.open("rb") as file:
            for _ in StreamReader(file).records:
                pass

    def parser_trajectory():
        for message in open_log(path).decoded("/state"):
            motion = message.message.motion
            for values in (motion.position, motion.orientation, motion.linear, motion.angular):
                np.array(values)

    ours = best(lambda: [None for _ in open_log(path).raw()], 5 * STEPS)
    trajectory = best(lambda: open_log(path).trajectory(), STEPS)
    return [
        row("read a log", "us_per_message", ours, best(mcap_messages, 5 * STEPS), 0.5),
        row("read a log, against 300,000 messages a second", "us_per_message", ours, 1e6 / 300_000, 1.0),
        row("trajectory", "us_per_step", trajectory, best(parser_trajectory, STEPS), 1.0),
    ]


def log_again(outcome, folder):
    """Write every message of a run into a log once more, as the run did."""
    recorded, scenario = open_log(outcome.log), load("two_link")
    path = folder / "again.mcap"
    path.unlink(missing_ok=True)
    bodies, messages = recorded.bodies, list(recorded.raw())
    motion, force = Motion.at_rest(len(bodies)), np.zeros((len(bodies), 3))
    writer = LogWriter(
        path, run="again", scenario_json=scenario.to_json(), body_names=bodies,
        provider_bodies=recorded.provider_bodies, metadata={},
    )  # fmt: skip
    start = process_time()
    with writer:
        for topic, time_ns, payload in messages:
            if topic == "/motion":
                writer.motion(payload, time_ns)
            elif topic == "/wrench/aero":
                writer.wrench("aero", payload, time_ns)
            elif topic == "/state":
                writer.state(payload, time_ns)
            elif topic == "/step":
                writer.step(payload, time_ns)
                writer.scene(time_ns, motion, force)
            elif topic == "/timing":
                writer.timing(payload, time_ns)
        writer.close(final_state_sha256="00")
    return process_time() - start


def step_rows(folder):
    """Return what the log costs of a lock-step step over zenoh, pictures included, against 5 %."""
    shares = []
    for i in range(REPEATS):
        outcome = run(load("two_link", ["time.end=2.0"]), folder / f"run{i}", lambda step: None)
        shares.append((log_again(outcome, folder) / 2000 * 1e6, outcome.result.wall_s / 2000 * 1e6))
    cost, step = sorted(shares, key=lambda pair: pair[0] / pair[1])[REPEATS // 2]
    return [row("log a step of two_link, against the step over zenoh", "us", cost, step, 0.05)]


def main():
    """Return the rows of the table; the reference is mcap's Python code, protobuf's parser, or a bound."""
    payload = motion_step(1, state(np.random.default_rng(0)).motion).SerializeToString()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ours = best(lambda: write_ours(folder, payload), MESSAGE_COUNT)
        reference = best(lambda: write_python(folder, payload), MESSAGE_COUNT)
        rows = [
            row("log a MotionStep", "us_per_message", ours, reference, 0.5),
            row("log a MotionStep, against 3 µs", "us_per_message", ours, 3.0, 1.0),
        ]
        return rows + encoding_rows() + reading_rows(folder) + step_rows(folder)


if __name__ == "__main__":
    for line in main():
        print(line)
