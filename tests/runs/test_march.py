"""Verification in one call of the core: as many steps as can be, and not one verdict that differs for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from linkwind.dynamics.march import RecordedMarch
from linkwind.dynamics.recorder import Recorder
from linkwind.dynamics.service import DynamicsService
from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from linkwind.mechanism import build
from linkwind.runs.comparison import Comparison
from linkwind.runs.here import inprocess_link
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import run
from linkwind.runs.verify import Verified, scenario_of, verify
from linkwind.scenario import Scenario, load, loads
from tests.runs.edit import changed, rewrite
from tests.runs.test_verify import TWO_PROVIDERS
from tests.scenarios.test_orders import TEXT as PARTING

STEPS = 400


class Marched:
    """Counts the steps that were marched, or lets none be."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.steps, self.may = 0, True
        go = RecordedMarch.go

        def counted(march: RecordedMarch, *place: Any) -> Any:
            accepted = place[4]
            last = go(march, *place) if self.may else accepted
            self.steps += last.step - accepted.step
            return last

        monkeypatch.setattr(RecordedMarch, "go", counted)

    def verify(self, log: Path) -> tuple[Verified, int]:
        """Return what is found, the same either way, and how many steps were marched."""
        self.steps, self.may = 0, True
        found = verify(*scenario_of(log))
        marched, self.may = self.steps, False
        assert verify(*scenario_of(log)) == found
        assert self.steps == marched
        return found, marched


@pytest.fixture
def march(monkeypatch: pytest.MonkeyPatch) -> Marched:
    return Marched(monkeypatch)


def fly(scenario: Scenario, folder: Path) -> Path:
    return run(scenario, folder, lambda step: None).log


def of(name: str, *settings: str) -> Scenario:
    end = STEPS * load(name).coupling.step_ns / 1e9
    return load(name, ["bus.transport=inprocess", f"time.end={end!r}", *settings])


PLATE, FIELD, NONE = "two_link", "two_link_field", "four_bar"
WING = 'bodies.link1.shape={type="wing",points=[[-0.2,-0.5],[0.3,-0.4],[0.2,0.5]]}'
REGULAR = [(name, ()) for name in (
    "andrews", "bricard", "chain", "flapper", "four_bar", "stage_separation", "two_link", "two_link_field",
    "two_link_free", "two_link_gust",
)] + [
    *((name, (f"coupling.order={order}",)) for order in range(3) for name in (PLATE, FIELD)),
    (PLATE, ("coupling.adaptive=false",)),
    (PLATE, (WING, "aero.plate.strips=3")),
    (PLATE, ("coupling.step=0.004", "coupling.order=3")),
    *((name, (f"dynamics.integrator={how}",)) for how in ("euler", "semi_implicit_euler", "dopri5", "radau5")
      for name in (PLATE, NONE)),
    (PLATE, ("dynamics.substeps=3",)),
    (PLATE, ("dynamics.method=cfe", "dynamics.stabilisation=projection")),
    (PLATE, ("dynamics.method=incremental", "dynamics.integrator=semi_implicit_euler")),
]  # fmt: skip


@pytest.mark.parametrize(("name", "settings"), REGULAR)
def test_nearly_every_step_of_a_regular_run_is_marched(
    name: str, settings: tuple[str, ...], march: Marched, tmp_path: Path
) -> None:
    scenario = of(name, *settings)
    found, marched = march.verify(fly(scenario, tmp_path / "out"))
    assert (found.difference, found.remark) == (None, "")
    assert found.steps == scenario.steps
    assert marched >= 0.97 * scenario.steps - 10  # all but the start-up, the last, and one behind each call


@pytest.mark.parametrize(
    "settings",
    [
        ("coupling.scheme=explicit",),
        ("coupling.scheme=implicit",),
        ("aero.model=flow", "environment.viscosity=0.01"),
    ],
)
def test_what_is_not_regular_is_left_to_the_scheme(
    settings: tuple[str, ...], march: Marched, tmp_path: Path
) -> None:
    name = "cylinder" if "aero.model=flow" in settings else PLATE
    scenario = load(name, ["bus.transport=inprocess", "time.end=0.02", *settings])
    found, marched = march.verify(fly(scenario, tmp_path / "out"))
    assert (found.difference, found.steps, marched) == (None, scenario.steps, 0)


def test_answers_of_several_providers_are_added(march: Marched, tmp_path: Path) -> None:
    text = TWO_PROVIDERS.replace("end = 0.02", "end = 0.1")
    plate = text.replace(
        'name = "a"\n', 'name = "a"\nshape = { type = "plate", length = 0.2, span = 0.1 }\n'
    ).replace('model = "field"\nbodies = ["a", "b"]', 'model = "plate"\nbodies = ["a"]').split(
        "[providers.field.a]")[0]  # fmt: skip
    for number, toml in enumerate((text, plate)):
        scenario = loads(toml + '[bus]\ntransport = "inprocess"\n', "two.toml")
        log = fly(scenario, tmp_path / str(number))
        found, marched = march.verify(log)
        assert (found.difference, found.steps) == (None, 100)
        assert marched > 80

        def edit(topic: str, at: int, payload: bytes) -> bytes:
            return changed(topic, payload, "torque", 2) if (topic, at) == ("/wrench/left", 61) else payload

        other = rewrite(log, tmp_path / f"{number}.mcap", edit)
        difference = march.verify(other)[0].difference
        assert difference is not None
        assert (difference.topic, difference.step, difference.body) == ("/wrench/left", 60, "b")


def test_what_happens_on_the_way_happens_again(march: Marched, tmp_path: Path) -> None:
    log = fly(of(PLATE, "log.checkpoint_every=37", "bus.recovery=1"), tmp_path / "out")
    found, marched = march.verify(log)
    assert (found.difference, found.steps, found.remark) == (None, STEPS, "")
    assert marched > 0.9 * STEPS
    other = resume(plan(open_log(log), 148, ["environment.density=1.5"]), tmp_path / "branch").outcome.log
    found, marched = march.verify(other)
    assert (found.difference, found.steps, found.remark) == (None, STEPS, "")
    assert marched > 0.9 * STEPS


def test_an_event_in_the_middle(march: Marched, tmp_path: Path) -> None:
    text = PARTING.format(end=0.2).replace('action = "release"', 'action = "release"\nat = 0.1')
    log = fly(loads(text + '[bus]\ntransport = "inprocess"\n', "parting.toml"), tmp_path / "out")
    assert open_log(log).trajectory().event_time[-1, 0] == pytest.approx(0.1)
    found, marched = march.verify(log)
    assert (found.difference, found.steps) == (None, 200)
    assert marched > 180


PLACES = [
    ("/motion", "accepted.position", 1), ("/motion", "trial.angular", 5), ("/motion", "time_ns", None),
    ("/wrench/aero", "force", 4), ("/wrench/aero", "added_inertia", 40), ("/wrench/aero", "provider", None),
    ("/state", "q", 1), ("/state", "reaction", 7), ("/state", "external_work", None),
    ("/state", "motion.linear", 0), ("/step", "extrapolation_error", 2), ("/step", "order", None),
    ("/step", "residual", None), ("/step", "interface_energy", None),
]  # fmt: skip


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(of(PLATE), tmp_path_factory.mktemp("run") / "out")


@pytest.mark.parametrize(("topic", "field", "index"), PLACES)
def test_one_bit_in_the_middle_of_a_call(
    topic: str, field: str, index: int | None, march: Marched, log: Path, tmp_path: Path
) -> None:
    def edit(of_topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, field, index) if (of_topic, number) == (topic, 301) else payload

    difference = march.verify(rewrite(log, tmp_path / "other.mcap", edit))[0].difference
    assert difference is not None
    assert (difference.topic, difference.step, difference.field) == (topic, 300, field)
    assert difference.element == index


def test_a_message_of_another_length(march: Marched, log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return payload + b"\x7a\x00" if (topic, number) == ("/step", 201) else payload

    difference = march.verify(rewrite(log, tmp_path / "other.mcap", edit))[0].difference
    assert difference is not None
    assert (difference.topic, difference.step) == ("/step", 200)


def test_a_hole_in_the_log(march: Marched, log: Path, tmp_path: Path) -> None:
    data = bytearray(log.read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "hole.mcap").write_bytes(data)
    for holed in (tmp_path / "hole.mcap", recover(tmp_path / "hole.mcap", tmp_path / "clean.mcap").file):
        found, marched = march.verify(holed)
        assert (found.difference, found.steps) == (None, STEPS)
        assert 0 < marched < STEPS - 20
        assert "not complete" in found.remark


def test_the_summary_counts_what_was_marched(log: Path) -> None:
    opened, scenario = scenario_of(log)
    results = []
    for with_march in (False, True):
        mechanism = build(scenario)
        comparison = Comparison(opened, scenario, mechanism, wrenches=True)
        service = DynamicsService(scenario, mechanism, opened.run)
        link = inprocess_link(service.session, {})
        service.march = RecordedMarch(comparison, link.providers) if with_march else None
        recorder = Recorder(comparison, scenario, mechanism, service.multibody)
        result = service.run(link, recorder, lambda step: None)
        results.append((result.joint_gap_max_m, result.force_max_N, result.exchanges, result.events))
    assert results[0] == results[1]
    assert results[0][2] == STEPS + 1
