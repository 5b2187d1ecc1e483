"""What newcomers need not wait for: `pytest -m slow` runs it, and CI does."""

import os

import pytest
from hypothesis import settings

FLOWS = (
    "cylinder",
    "falling_plate",
    "flapper_wake",
    "fruit_fly",
    "two_link_flow_free",
    "vortex_induced_vibration",
)
SLOW = (
    "tests/docker/test_stay.py",
    "tests/bus/test_secure.py::test_recorder_is_told_as_well",
    "tests/dynamics/test_recovery.py::test_a_death_at_any_moment_changes_no_bit[right-",
    "tests/dynamics/test_recovery.py::test_a_death_at_any_moment_changes_no_bit[left-explicit",
    "tests/dynamics/test_recovery.py::test_a_death_at_any_moment_changes_no_bit[left-implicit",
    "tests/faults/test_disk.py::test_disk_that_can_only_be_read_all_at_once[False",
    "tests/faults/test_disk.py::test_slow_disk",
    "tests/runs/test_conformance.py::test_our_own_provider",
    "tests/runs/test_conformance.py::test_what_is_wrong_is_found",
    "tests/runs/test_reproduce.py::test_the_paper",
    "tests/faults/test_killed_and_resumed.py",
    "tests/faults/test_large_checkpoints.py",
    "tests/faults/test_processes.py::test_dynamics_lost_ends_the_provider_and_leaves_a_readable_log[stopped",
    "tests/faults/test_restarted.py",
    "tests/faults/test_recovery.py::test_a_cut_network",
    "tests/faults/test_recovery.py::test_a_flow",
    "tests/faults/test_recovery.py::test_a_stopped",
    "tests/faults/test_recovery.py::test_another",
    "tests/faults/test_recovery.py::test_many",
    "tests/faults/test_recovery.py::test_one_that_comes_back_is_killed",
    "tests/faults/test_recovery.py::test_over_tls",
    "tests/fmi/test_export.py::test_portable_binaries_are_the_same_bytes_too",
    "tests/fmi/test_platforms.py",
    "tests/fmi/test_ssp.py::test_every_input_is_connected",
    "tests/fmi_host/test_wine.py",
    "tests/fmu/test_c_fuzz.py",
    "tests/native/test_compilers.py",
    *(
        f"tests/native/{file}.py::test_bits_do_not_depend_on_instructions_and_compiler[{n}"
        for file in ("test_boundary3", "test_lattice3_binding", "test_lattice_binding", "test_vortex")
        for n in ("avx2", "avx512f")
    ),
    "tests/networks",
    "tests/own/test_example.py::test_the_kite",
    "tests/own/test_runs.py::test_a_hidden_memory",
    "tests/own/test_runs.py::test_a_provider_in_python_that_is_killed",
    "tests/runs/test_damaged.py",
    "tests/runs/test_record.py::test_a_listener_that_is_too_slow",
    "tests/runs/test_record.py::test_the_run_is_not_disturbed[killed",
    "tests/runs/test_record.py::test_the_run_is_not_disturbed[told",
    "tests/runs/test_replay.py::test_interrupted",
    "tests/runs/test_replay.py::test_many_messages",
    "tests/runs/test_replay.py::test_paused",
    "tests/runs/test_resume.py::test_a_flow",
    "tests/runs/test_silent.py::test_one_that_always_hangs",
    "tests/runs/test_silent.py::test_it_is_ended_and_another_one_takes_its_place[-1",
    "tests/runs/test_silent.py::test_it_is_ended_and_another_one_takes_its_place[37",
    "tests/runs/test_space.py::test_verified_and_resumed_from_every_checkpoint[several",
    "tests/runs/test_validate.py::test_vortex[flutter",
    "tests/scenarios/test_logs.py",
    "tests/scenarios/test_orders.py::test_an_order_over_the_bus",
    "tests/security",
    "tests/view/test_file.py::test_the_numbers_around_the_room_are_in_the_picture[size1",
    "tests/view/test_file.py::test_the_numbers_around_the_room_are_in_the_picture[size2",
    "tests/view/test_live.py",
    "tests/view/test_vortices.py::test_between_two_frames",
    "tests/view/test_wakes.py::test_between_two_frames",
    *(
        f"tests/runs/test_verify.py::test_every_built_in_scenario_gives_the_same_bits_again[{n}"
        for n in FLOWS
    ),
    *(f"tests/scenarios/test_runs.py::test_run_leaves_a_complete_log_and_a_report[{n}" for n in FLOWS),
    *(f"tests/scenarios/test_runs.py::test_transport_changes_no_bit[{n}" for n in FLOWS),
)

# How long an example takes says how busy the machine is, and nothing about the program.
settings.register_profile("linkwind", deadline=None)
settings.load_profile("linkwind")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them, before those that are not wanted are left out."""
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker("slow")


def pytest_xdist_auto_num_workers() -> int:
    """Return one more than there are cores: tests of processes wait a quarter of their time."""
    return len(os.sched_getaffinity(0)) + 1
