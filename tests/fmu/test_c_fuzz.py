"""Random sequences of calls under the address and undefined-behaviour sanitizers."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from linkwind.aero.field import field_table, initial_angles
from linkwind.mechanism import build
from linkwind.scenario import loads
from tests.fmi.scenes import servo
from tests.fmu.c_model import Compiler, aero, build_hook, dynamics
from tests.fmu.conftest import spatial_mechanism
from tests.fmu.test_c_aero import FIELD

HERE = Path(__file__).parent
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-g")
ENVIRONMENT = os.environ | {
    "ASAN_OPTIONS": "detect_leaks=1:abort_on_error=0",
    "UBSAN_OPTIONS": "print_stacktrace=1",
}
CALLS = {3: "8000", 2: "30000"}


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sanitized")
    wrong = folder / "wrong.c"
    wrong.write_text(
        "#include <stdlib.h>\nint main(int n, char **a) { (void)a; char *p = malloc(1); return p[n]; }\n"
    )
    command = [*build_hook().compiler(), *SANITIZERS, str(wrong), "-o", str(folder / "wrong")]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("the compiler has no sanitizers")
    done = subprocess.run([folder / "wrong"], capture_output=True, text=True, check=False, env=ENVIRONMENT)
    assert done.returncode != 0, "the sanitizer does not see an overflow"
    return Compiler(folder, SANITIZERS)


def run(program: Path, version: int, seed: int) -> dict[str, list[int]]:
    done = subprocess.run(
        [program, str(seed), CALLS[version]], capture_output=True, text=True, check=False, env=ENVIRONMENT
    )
    assert done.returncode == 0, done.stdout + done.stderr
    rows = (line.split() for line in done.stdout.splitlines())
    return {name: [int(count) for count in counts] for name, *counts in rows}


def models():
    """Mechanisms and a force model in FMI 3, and the mechanisms with scalar variables in FMI 2."""
    arm = build(servo())
    scenario = loads(FIELD, "field")
    provider = scenario.providers[0]
    field = aero(field_table(scenario, provider), initial_angles(scenario, provider))
    return {
        "dynamics_3": dynamics(*spatial_mechanism()),
        "aero_3": field,
        "dynamics_2": dynamics(*spatial_mechanism(), scalar=True),
        "servo_3": dynamics(arm.tables, arm.q0, arm.v0),
        "servo_2": dynamics(arm.tables, arm.q0, arm.v0, scalar=True),
    }


@pytest.mark.parametrize("name", ["dynamics_3", "aero_3", "dynamics_2", "servo_3", "servo_2"])
def test_random_calls(sanitized, name):
    version = int(name[-1])
    program = sanitized.program(models()[name], version, f"fuzz_{name}", HERE / f"fuzz{version}.c")
    total: dict[str, list[int]] = {}
    for seed in range(1, 6):
        for call, counts in run(program, version, seed).items():
            total[call] = [a + b for a, b in zip(total.get(call, [0] * 4), counts, strict=True)]
    for call, (ok, _, _, error) in total.items():  # every call has been right and wrong
        assert ok > 5, call
        assert error > 5 or call in {"release", "reset"}, call
    assert total["step"][0] > 300
