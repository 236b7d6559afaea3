"""A check concerns the arms of its scene: all of them, and no others."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from defras_bt.dvrk.checking import run
from defras_bt.dvrk.checking.registered import RegistrationCheck
from defras_bt.dvrk.checking.run import check_bench
from defras_bt.dvrk.checking.workspace import WorkspaceCheck
from defras_bt.dvrk.laboratory import NotRegistered
from defras_bt.dvrk.registering.registration import Placed, Registration, write_registration
from defras_bt.dvrk.settings import Setup
from defras_sim.geometry import Pose
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from tests.dvrk.toy_robot import ToyTransport, toy_setup

NOW = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)


@pytest.fixture(scope="module")
def one_armed() -> Scene:
    scene = load_scene(resource("sim/scenes/demo.yaml"))
    return scene.model_copy(update={"arms": {"psm1": scene.arms["psm1"]}})


@pytest.fixture
def setup(one_armed: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Setup:
    """Of two arms, of which only one is registered; nobody waits for it."""
    transport = ToyTransport("PSM1", "PSM2")

    def wait(time_s: float) -> None:
        transport.clock_s += time_s
        transport.publish()

    monkeypatch.setattr(run, "connect", lambda setup, name: transport)
    monkeypatch.setattr(run, "sleep", wait)
    placed = Placed.of(Pose(np.array(one_armed.arms["psm1"].rcm_m)))
    file = tmp_path / "registration.yaml"
    registration = Registration(measured=NOW, scene=one_armed.name)
    write_registration(registration.with_arm("psm1", placed, NOW), file)
    return toy_setup(registration=file)


def test_an_arm_that_the_scene_does_not_use_is_left_alone(
    setup: Setup, one_armed: Scene, tmp_path: Path
) -> None:
    with check_bench(setup, one_armed, tmp_path) as bench:
        assert set(bench.arms) == set(bench.watches) == set(bench.setup.arms) == {"psm1"}
        for check in (RegistrationCheck(), WorkspaceCheck()):
            assert {one.about.lower() for one in check.run(bench)} == {"psm1"}


def test_an_arm_of_the_scene_that_is_not_there(
    setup: Setup, one_armed: Scene, tmp_path: Path
) -> None:
    alone = setup.used_by(("psm2",))
    with (
        pytest.raises(NotRegistered, match=r"the set-up has no psm1, which the scene 'demo' uses"),
        check_bench(alone, one_armed, tmp_path),
    ):
        pass
