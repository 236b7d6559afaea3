"""A scene of a patient's anatomy keeps the promises that slabs keep."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.rest_shape import NotASlab
from defras_sim.retraction import rehearse
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_file import write_scene
from defras_sim.scene_from_surface import believed_scene
from defras_sim.tissue.model import TissueModel
from defras_sim.yaml_source import InvalidFile


@pytest.fixture(scope="module")
def scene(flap: Anatomy) -> Scene:
    return believed_scene(flap, name="flap", description="", thickness_m=0.005, held="far")


@pytest.fixture
def file(scene: Scene, tmp_path: Path) -> Path:
    write_scene(scene, tmp_path / "flap.yaml")
    return tmp_path / "flap.yaml"


def test_it_is_read_as_it_was_written(scene: Scene, file: Path) -> None:
    assert load_scene(file) == scene
    assert (file.parent / "flap.npz").is_file()


def test_holes_and_grasp_points_lie_on_the_surface(scene: Scene, flap: Anatomy) -> None:
    there = scene.is_hole
    holes_m = scene.holes_m[there]
    np.testing.assert_allclose(holes_m[:, :2], scene.holes_xy_m[there], atol=1e-9)
    np.testing.assert_allclose(holes_m, flap.lower.at(scene.holes_xy_m[there]))
    assert 60 < there.sum() < there.size
    assert set(scene.attachments.map[0]) == {" ", "."}
    for point in scene.grasp_points:
        place_m = scene.grasp_point_m(*point)
        np.testing.assert_allclose(place_m, flap.upper.at(scene.grasp_xy_m(*point)))
        assert flap.room_m(place_m[None, :2])[0] >= scene.grasp.patch_radius_m
    assert (1, 1) not in scene.grasp_points


def test_the_held_edge_is_the_one_asked_for(flap: Anatomy) -> None:
    for edge, axis, sign in (("far", 0, 1), ("near", 0, -1), ("left", 1, 1), ("right", 1, -1)):
        made = believed_scene(flap, name="flap", description="", thickness_m=0.005, held=edge)
        held_m = made.holes_xy_m[made.attached]
        assert sign * held_m[:, axis].mean() > 0.02
        assert abs(held_m[:, 1 - axis].mean()) < 0.008


def test_other_attachments_leave_blanks_blank(scene: Scene) -> None:
    other = scene.with_attached(~scene.attached & scene.is_hole)
    assert np.array_equal(other.attached, ~scene.attached & scene.is_hole)
    for row, drawn in zip(scene.attachments.map, other.attachments.map, strict=True):
        assert [mark == " " for mark in row] == [mark == " " for mark in drawn]


@pytest.mark.parametrize("mesh", ["twin", "actual"])
def test_the_region_is_hidden_at_rest_on_both_meshes(scene: Scene, mesh: str) -> None:
    model = TissueModel(scene if mesh == "twin" else scene.simulated)
    state = model.solve({})
    assert state.converged
    assert roi_visibility(scene, RayCaster(state.surface)) == 0.0
    np.testing.assert_allclose(state.nodes_m, model.mesh.nodes_m, atol=1e-12)
    # Whatever the mesh, the surface is the same.
    np.testing.assert_allclose(state.surface.vertices_m, scene.tissue.anatomy.vertices_m, atol=1e-9)


def test_a_hole_without_tissue_cannot_hold(scene: Scene) -> None:
    model = TissueModel(scene)
    stiffness = np.zeros(len(scene.holes_xy_m))
    stiffness[np.flatnonzero(~scene.is_hole)[0]] = 100.0
    with pytest.raises(ValueError, match="without tissue over it"):
        model.set_hole_stiffness(stiffness)


def test_a_retraction_exposes_the_region_and_both_meshes_agree_about_it(scene: Scene) -> None:
    near = scene.model_copy(
        update={"motion": scene.motion.model_copy(update={"pull_height_m": 0.02})}
    )
    twin, actual = (
        rehearse(each, (1, 3), ("pull",), step_m=0.005) for each in (near, near.simulated)
    )
    assert twin.finished
    assert actual.finished
    assert twin.force_max_n > 0.01
    assert twin.force_max_n == pytest.approx(actual.force_max_n, rel=0.15)
    assert twin.visibility[-1] == pytest.approx(actual.visibility[-1], abs=0.1)
    ground_m = scene.grasp_point_m(1, 3)
    np.testing.assert_allclose(twin.stopped_at_m, ground_m + [0, 0, 0.02], atol=1e-12)


def told(file: Path) -> str:
    with pytest.raises(InvalidFile) as caught:
        load_scene(file)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("tetrahedron10", "hexahedron20", "an anatomy's meshes are of tetrahedron10"),
        ("flap.npz", "other.npz", "other.npz cannot be read"),
        ("sha256: ", "sha256: 0", "not the file that this scene was made for"),
        ("center_x_m: ", "center_x_m: 0.05 # ", "reaches out from under the tissue"),
        ("length_x_m: 0.", "length_x_m: 0.3 # 0.", "the anatomy measures"),
        ('- " ', '- ".', "should be blank where there is no tissue"),
    ],
)
def test_faults_of_an_anatomy_are_told_where_they_stand(
    file: Path, old: str, new: str, words: str
) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    message = told(file)
    assert words in message
    assert message.startswith(f"{file}:")


def test_pybullet_is_not_for_anatomy(scene: Scene) -> None:
    with pytest.raises(NotASlab, match="slabs only"):
        scene.for_bullet()
