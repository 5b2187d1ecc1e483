"""A provider that uses nothing of linkwind: drag on every body, F = -c |v| v.

    pip install eclipse-zenoh==1.10.2 protobuf
    python provider.py tcp/127.0.0.1:7447          # to: linkwind dynamics two_link

It follows schemas/README.md from top to bottom. It remembers the last accepted state, of which it makes no
use; put your memory there. linkwind conformance finds nothing wrong.
A copy of it elsewhere needs --schema FILE: the compiled schema, linkwind/v1/linkwind.binpb.
"""

import argparse
import hashlib
import json
import queue
import sys
import time
import uuid
from math import hypot
from pathlib import Path

import zenoh
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

DRAG = 0.5  # N·s²/m²
POINT = 1  # kind of the wrench: the value at t_{k+1}
PIECE = 2**20  # bytes of a checkpoint in a message, at most

beside = Path(__file__).parent.parent / "linkwind/v1/linkwind.binpb"
parser = argparse.ArgumentParser(description="Drag on every body of a linkwind run.")
parser.add_argument("endpoint", help="of the dynamics, such as tcp/127.0.0.1:7447")
parser.add_argument("name", nargs="?", default="aero", help="of this provider, as in the scenario")
parser.add_argument("--schema", type=Path, default=beside, help="the compiled schema, linkwind.binpb")
given = parser.parse_args()
name = given.name

# ---- the schema ----

try:
    descriptors = given.schema.read_bytes()
except OSError as error:
    parser.error(
        f"{given.schema}: expected the compiled schema, schemas/linkwind/v1/linkwind.binpb of linkwind; "
        f"got {error.strerror}. Say where it is: --schema FILE"
    )
pool = descriptor_pool.DescriptorPool()
for file in descriptor_pb2.FileDescriptorSet.FromString(descriptors).file:
    pool.Add(file)
Control, MotionStep, WrenchStep, Checkpoint = (
    message_factory.GetMessageClass(pool.FindMessageTypeByName(f"linkwind.v1.{message}"))
    for message in ("Control", "MotionStep", "WrenchStep", "Checkpoint")
)

# ---- the bus ----

config = zenoh.Config()
settings = {
    "mode": "peer",
    "region_name": "provider",
    "connect/endpoints": [given.endpoint],
    "scouting/multicast/enabled": False,
    "transport/link/tx/lease": 1000,
}
for key, value in settings.items():
    config.insert_json5(key, json.dumps(value))
session = zenoh.open(config)


def request(run, patience=float("inf"), **body):
    """Ask the dynamics until it answers, or for so many seconds."""
    asked, end = Control(**body).SerializeToString(), time.monotonic() + patience
    while time.monotonic() < end:
        replies = session.get(f"linkwind/v1/{run}/control/{name}", payload=asked, timeout=min(5.0, patience))
        for reply in replies:
            if reply.ok is not None:
                answer = Control.FromString(reply.ok.payload.to_bytes())
                if answer.HasField("refuse"):
                    sys.exit(answer.refuse.reason)
                return answer
        time.sleep(0.05)
    return None


# ---- hand-shake ----

instance = uuid.uuid4().hex
inbox = queue.SimpleQueue()


def join():
    """Say Hello, learn what the run is, listen to it."""
    global welcome, bodies, wrenches, checkpoints, held, start, saved, at, answer, memory
    hello = {
        "name": name,
        "schema_sha256": hashlib.sha256(descriptors).hexdigest(),
        "version": "provider.py 1",  # program and version, for people and for the log
        "instance": instance,
    }
    welcome = request("*", hello=hello).welcome
    bodies = [list(welcome.bodies).index(body) for body in welcome.provider_bodies]
    base = f"linkwind/v1/{welcome.run}"
    motions = session.declare_subscriber(
        f"{base}/motion", lambda sample: inbox.put(sample.payload.to_bytes())
    )
    fault = session.declare_subscriber(f"{base}/fault", lambda _: inbox.put(None))
    left = session.liveliness().declare_subscriber(
        f"{base}/alive/dynamics",
        lambda sample: inbox.put(None) if sample.kind == zenoh.SampleKind.DELETE else None,
    )
    block = {"congestion_control": zenoh.CongestionControl.BLOCK}
    wrenches = session.declare_publisher(f"{base}/wrench/{name}", **block)
    checkpoints = session.declare_publisher(f"{base}/checkpoint/{name}", **block)
    token = session.liveliness().declare_token(f"{base}/alive/{name}")
    held = motions, fault, left, token  # zenoh ends what nobody holds
    resumed = welcome.HasField("resume")
    start = welcome.resume.step if resumed else -1  # committed before the first motion
    saved = welcome.resume.number - 1 if resumed else 0
    memory = fetch(welcome.resume) if resumed else b""
    at, answer = (start, 0), b""


def fetch(first):
    """Return the memory of which the dynamics has sent the first piece."""
    whole = first.state
    while len(whole) < first.size:
        following = {"name": name, "instance": instance, "offset": len(whole)}
        whole += request(welcome.run, fetch=following).checkpoint.state
    if hashlib.sha256(whole).digest() != first.sha256:
        sys.exit("the checkpoint to go on from was damaged on the way")
    return whole


# ---- the force model ----


def wrench(motion):
    """Return the answer to a motion."""
    found = WrenchStep(
        run=welcome.run,
        provider=name,
        step=motion.step,
        iteration=motion.iteration,
        time_ns=motion.time_ns,
        kind=POINT,
    )
    for body in bodies:
        v = motion.trial.linear[3 * body : 3 * body + 3]
        found.force.extend(-DRAG * hypot(*v) * component for component in v)
        found.torque.extend([0.0, 0.0, 0.0])
    return found.SerializeToString(deterministic=True)


# ---- lock step ----


class ProtocolError(Exception):
    """The dynamics did something else than the protocol says."""


def commit(step, accepted):
    """Take an accepted state, then save the memory if that is due."""
    global memory, saved
    if step != start:
        memory = accepted.SerializeToString(deterministic=True)
    if welcome.checkpoint_every and step and step % welcome.checkpoint_every == 0:
        saved += 1
        if saved > welcome.catch_up.checkpoints_taken:
            keep(step)


def keep(step):
    """Send the memory, piece by piece."""
    for offset in range(0, max(1, len(memory)), PIECE):
        piece = Checkpoint(
            run=welcome.run,
            provider=name,
            number=saved,
            step=step,
            time_ns=step * welcome.step_ns,
            size=len(memory),
            sha256=hashlib.sha256(memory).digest(),
            offset=offset,
            state=memory[offset : offset + PIECE],
        )
        checkpoints.put(piece.SerializeToString())


def respond(payload):
    """Return the answer to a motion message; None if there is none to give."""
    global at, answer
    motion = MotionStep.FromString(payload)
    if motion.final:
        commit(motion.step, motion.accepted)
        return None
    asked = (motion.step, motion.iteration)
    if asked < at:
        return b""
    if asked == at and answer:
        return answer
    if asked == (at[0] + 1, 0):
        if motion.step:
            commit(motion.step - 1, motion.accepted)
    elif asked != (at[0], at[1] + 1):
        raise ProtocolError(f"expected step {at[0] + 1}; got {motion.step}: a motion was lost")
    at, answer = asked, wrench(motion)
    return answer


def take_part():
    """Catch up, say Ready, answer motion after motion until the run is over."""
    again = [hashlib.sha256(respond(motion)).digest() for motion in welcome.catch_up.motions]
    ready = {"name": name, "instance": instance, "kind": POINT, "rollback": True}
    if welcome.HasField("catch_up"):
        ready["answers_sha256"] = hashlib.sha256(b"".join(again)).digest()
    request(welcome.run, ready=ready)
    while (payload := inbox.get()) is not None:
        if not payload:
            continue
        reply = respond(payload)
        if reply is None:
            request(welcome.run, bye={"name": name, "checkpoints": saved})
            break
        if reply:
            wrenches.put(reply)


with session:  # closed however this ends: an open one keeps the process, and its liveliness token, alive
    join()
    try:
        take_part()
    except Exception as error:  # whatever it was, the dynamics is told why nobody will answer
        told = {"participant": name, "step": at[0] + 1, "code": type(error).__name__, "text": str(error)}
        request(welcome.run, patience=1.0, fault=told)
        raise
