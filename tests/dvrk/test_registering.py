"""From landmarks to the registration file, and from a diagnosis into it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from defras_bt.cli.dvrk import app
from defras_bt.cli.errors import UserError
from defras_bt.dvrk.crtk.arm import CrtkArm, NotFresh
from defras_bt.dvrk.registering.adoption import NothingToAdopt, adopted, without_adopted
from defras_bt.dvrk.registering.landmarks import (
    COLUMNS,
    Landmark,
    read_landmarks,
    usual_landmarks,
    write_landmarks,
)
from defras_bt.dvrk.registering.registration import (
    Placed,
    Registration,
    read_registration,
    write_registration,
)
from defras_bt.dvrk.registering.touching import NotStill, touched_m
from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.effects.arm_layer import ArmLayer
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Pose
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_file import write_scene
from defras_sim.worlds.force_sensor import NO_FORCE
from defras_sim.yaml_source import InvalidFile
from tests.dvrk.toy_robot import PERIOD_S, ToyTransport, toy_setup

NOW = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
BASE = Pose(np.array([0.02, 0.1, 0.2]), Rotation.from_rotvec([0.0, 0.1, 0.3]).as_matrix())
SETUP = """\
name: bench
arms:
  psm1: {name: PSM1, frame: PSM1_base}
"""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))


def landmarks(scene: Scene, noise_m: float = 0.0) -> list[Landmark]:
    """As an arm that stands at BASE touches them."""
    rng = np.random.default_rng(2)
    return [
        Landmark(name, at_m, BASE.inverse().apply(at_m) + noise_m * rng.standard_normal(3))
        for name, at_m in usual_landmarks(scene).items()
    ]


class TestLandmarks:
    """Places that are easy to find, and their file."""

    def test_the_usual_ones_are_the_corners_and_the_middle(self, scene: Scene) -> None:
        assert list(usual_landmarks(scene)) == [
            f"grasp point {point}" for point in ((1, 1), (5, 1), (5, 5), (1, 5), (3, 3))
        ]

    def test_they_come_back_as_written(self, scene: Scene, tmp_path: Path) -> None:
        given = landmarks(scene)
        write_landmarks(given, tmp_path / "l.csv")
        for before, after in zip(given, read_landmarks(tmp_path / "l.csv"), strict=True):
            assert after.name == before.name
            np.testing.assert_allclose(after.found_m, before.found_m, atol=1e-6)

    def test_faults_are_said_in_their_line(self, tmp_path: Path) -> None:
        file = tmp_path / "l.csv"
        file.write_text(",".join(COLUMNS) + "\na,0,0,0,1,2,3\nb,0,0,0,1,two,3\nc,0,0\n")
        with pytest.raises(InvalidFile) as fault:
            read_landmarks(file)
        assert "l.csv:3:1: b: could not convert string to float: 'two'" in str(fault.value)
        assert "l.csv:4:1: c:" in str(fault.value)

    def test_missing_columns_are_named(self, tmp_path: Path) -> None:
        file = tmp_path / "l.csv"
        file.write_text("name,x_m\na,1\n")
        with pytest.raises(InvalidFile, match="no column tissue_x_m"):
            read_landmarks(file)


class TestTouching:
    """The tip while it rests on a landmark."""

    @pytest.fixture
    def transport(self) -> ToyTransport:
        return ToyTransport("PSM1")

    @pytest.fixture
    def arm(self, transport: ToyTransport) -> CrtkArm:
        arm = CrtkArm(toy_setup().arms["psm1"], transport)
        transport.publish()
        return arm

    def test_the_tip_not_the_reported_point_touches(
        self, transport: ToyTransport, arm: CrtkArm
    ) -> None:
        reported = transport.arms["PSM1"].setpoint
        tip_m = touched_m(arm, pause=lambda _: None)
        np.testing.assert_allclose(tip_m, reported.position_m + 0.0286 * reported.rotation[:, 2])

    def test_an_arm_that_moves_touches_nothing(self, transport: ToyTransport, arm: CrtkArm) -> None:
        def moving(_: float) -> None:
            toy = transport.arms["PSM1"]
            toy.setpoint = toy.setpoint.moved(np.array([0.0002, 0.0, 0.0]))
            transport.clock_s += PERIOD_S
            transport.publish()

        with pytest.raises(NotStill, match="hold it still"):
            touched_m(arm, pause=moving)

    def test_an_arm_that_says_nothing_touches_nothing(
        self, transport: ToyTransport, arm: CrtkArm
    ) -> None:
        transport.clock_s += 1.0
        with pytest.raises(NotFresh, match=r"measured_cp of PSM1 is 1\.000 s old"):
            touched_m(arm, pause=lambda _: None)


class TestAdopting:
    """The layers of the twin are the independent reference: they act as the robot would."""

    def test_a_tool_offset_moves_the_arms(self, scene: Scene) -> None:
        values = {"x_m": 0.003, "y_m": -0.002, "turn_z_rad": 0.05}
        extended = scene.extended({"tool_offset": values})
        registration = Registration(measured=NOW, scene=scene.name)
        registration = registration.with_arm("psm1", Placed.of(BASE), NOW)
        rcm_m = np.array(scene.arms["psm1"].rcm_m)
        base_from_tip = Pose(np.array([0.01, 0.02, -0.12]))
        layer = ArmLayer(rcm_m, Layers.of(extended.model.extension).arm)
        layer.follow(0.0, BASE @ base_from_tip)
        true = layer.tip(NO_FORCE)
        new = adopted(registration, extended, NOW).arms["psm1"].pose @ base_from_tip
        np.testing.assert_allclose(new.position_m, true.position_m, atol=1e-9)
        np.testing.assert_allclose(new.rotation, true.rotation, atol=1e-9)

    def test_a_camera_registration_moves_the_camera(self, scene: Scene) -> None:
        extended = scene.extended({"camera_registration": {"z_m": 0.004, "turn_x_rad": 0.03}})
        camera = tissue_from_camera(scene.depth_camera)
        registration = Registration(measured=NOW, scene=scene.name)
        registration = registration.with_camera("depth", Placed.of(camera), NOW)
        seen_m = np.random.default_rng(0).uniform(-0.05, 0.05, (20, 3)) + [0, 0, 0.25]
        layer = CameraLayer(scene.depth_camera, Layers.of(extended.model.extension).camera)
        new = adopted(registration, extended, NOW).cameras["depth"].pose
        np.testing.assert_allclose(
            layer.reported(new.apply(seen_m)), camera.apply(seen_m), atol=1e-9
        )

    def test_nothing_is_adopted_twice(self, scene: Scene, tmp_path: Path) -> None:
        extended = scene.extended({"tool_offset": {"x_m": 0.004}})
        measured = Placed.of(BASE).model_copy(update={"landmarks": 5, "rms_m": 0.0004})
        registration = Registration(measured=NOW, scene=scene.name)
        registration = adopted(registration.with_arm("psm1", measured, NOW), extended, NOW)
        placed = registration.arms["psm1"]
        assert placed.position_m[0] == pytest.approx(BASE.position_m[0] + 0.004)
        assert (placed.landmarks, placed.rms_m) == (5, 0.0004), "it was not entered by hand"
        write_registration(registration, tmp_path / "registration.yaml")
        known = read_registration(tmp_path / "registration.yaml")
        assert known == registration
        with pytest.raises(NothingToAdopt, match="tool_offset was adopted already"):
            adopted(known, extended, NOW)
        later = scene.extended({"tool_offset": {"x_m": -0.001}})
        again = adopted(known, later, NOW).arms["psm1"]
        assert again.position_m[0] == pytest.approx(BASE.position_m[0] + 0.003)

    def test_the_scene_keeps_the_rest(self, scene: Scene) -> None:
        extended = scene.extended({"tool_offset": {"x_m": 0.001}, "stiffness": {"factor": 1.2}})
        assert list(without_adopted(extended).model.extension) == ["stiffness"]

    def test_without_such_an_effect(self, scene: Scene) -> None:
        with pytest.raises(NothingToAdopt, match="neither tool_offset nor camera_registration"):
            adopted(Registration(measured=NOW, scene="demo"), scene, NOW)

    @pytest.mark.parametrize(
        ("effect", "says"),
        [
            ("tool_offset", "concerns the arms, of which none is registered"),
            ("camera_registration", "concerns the depth camera, which is not registered"),
        ],
    )
    def test_what_it_concerns_is_not_registered(self, scene: Scene, effect: str, says: str) -> None:
        extended = scene.extended({effect: {"x_m": 0.002}})
        with pytest.raises(NothingToAdopt, match=says):
            adopted(Registration(measured=NOW, scene="demo"), extended, NOW)


class TestCommand:
    """defras dvrk register."""

    @pytest.fixture
    def setup_file(self, tmp_path: Path) -> Path:
        file = tmp_path / "lab.yaml"
        file.write_text(SETUP)
        return file

    def register(self, *arguments: str) -> str:
        result = CliRunner().invoke(app, ["register", *arguments])
        if isinstance(result.exception, Exception):
            raise result.exception
        assert result.exit_code == 0
        return result.output

    def test_from_a_file(self, scene: Scene, setup_file: Path) -> None:
        points = setup_file.with_name("points.csv")
        write_landmarks(landmarks(scene, noise_m=0.0003), points)
        said = self.register("psm1", "demo", "--setup", str(setup_file), "--points", str(points))
        assert "grasp point (1, 1): 0." in said
        assert "This is too much" not in said
        placed = read_registration(setup_file.with_name("registration.yaml")).arms["psm1"]
        assert placed.landmarks == 5
        assert placed.rms_m is not None
        assert placed.rms_m < 0.001
        np.testing.assert_allclose(placed.pose.position_m, BASE.position_m, atol=0.002)

    def test_too_large_residuals_are_warned_of(self, scene: Scene, setup_file: Path) -> None:
        points = setup_file.with_name("points.csv")
        write_landmarks(landmarks(scene, noise_m=0.004), points)
        said = self.register("psm1", "demo", "--setup", str(setup_file), "--points", str(points))
        assert "above 2 mm on average the check fails, above 4 mm for a new one it warns" in said

    def test_what_was_registered_for_another_scene_is_given_up(
        self, scene: Scene, setup_file: Path
    ) -> None:
        file = setup_file.with_name("registration.yaml")
        old = Registration(measured=NOW, scene="other").with_camera("depth", Placed.of(BASE), NOW)
        write_registration(old, file)
        points = setup_file.with_name("points.csv")
        write_landmarks(landmarks(scene), points)
        said = self.register("psm1", "demo", "--setup", str(setup_file), "--points", str(points))
        new = read_registration(file)
        assert new.scene == "demo"
        assert not new.cameras
        assert "what it says (depth) does not hold for 'demo'" in said
        kept = file.with_name("registration_20260301T093000.yaml")
        assert str(kept) in said
        assert read_registration(kept) == old

    def test_a_diagnosis_of_another_scene_is_not_adopted(
        self, scene: Scene, setup_file: Path
    ) -> None:
        file, found = setup_file.with_name("registration.yaml"), setup_file.with_name("found.yaml")
        extended = scene.extended({"tool_offset": {"x_m": 0.002}, "stiffness": {"scale": 1.2}})
        write_scene(extended.model_copy(update={"name": "demo_extended"}), found)
        old = Registration(measured=NOW, scene="demo").with_arm("psm1", Placed.of(BASE), NOW)
        arguments = ("--setup", str(setup_file), "--found", str(found))
        write_registration(old, file)
        with pytest.raises(UserError, match="was measured for the scene 'demo', not for 'sim1'"):
            self.register("adopt", "sim1", *arguments)
        assert read_registration(file) == old
        other = old.model_copy(update={"scene": "sim1"})
        write_registration(other, file)
        with pytest.raises(UserError, match="is the scene 'demo_extended', not 'sim1_extended'"):
            self.register("adopt", "sim1", *arguments)
        assert read_registration(file) == other
        write_registration(old, file)
        self.register("adopt", "demo", *arguments)
        assert read_registration(file).arms["psm1"].position_m[0] == pytest.approx(0.022)
        rest = load_scene(found.with_name("found_registered.yaml"))
        assert list(rest.model.extension) == ["stiffness"]
        assert rest.name == "demo", "a run is allowed only of what was registered"

    @pytest.mark.parametrize(
        ("arguments", "says"),
        [
            (("psm3",), "valid are psm1, psm2, depth, endoscope, adopt"),
            (("psm1",), "nobody can be asked here; give --points"),
            (("depth",), "give --points"),
            (("adopt",), "give --found"),
        ],
    )
    def test_what_cannot_be_done(
        self, setup_file: Path, arguments: tuple[str, ...], says: str
    ) -> None:
        with pytest.raises(UserError, match=says):
            self.register(*arguments, "demo", "--setup", str(setup_file))
