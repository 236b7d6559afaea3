"""The calibration of cameras: data of every kind, and colours found from a few places."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML
from scipy import ndimage
from typer.testing import CliRunner

from defras_bt.cli.dvrk_cameras import app
from defras_bt.dvrk.camera_settings import Colours
from defras_bt.dvrk.cameras.calibration_data import NoCameraData, read_views, spread
from defras_bt.dvrk.cameras.colour_fit import AROUND_PX, OutsidePicture, fitted
from defras_bt.dvrk.cameras.tissue_cloud import taken_points
from defras_bt.dvrk.stand_in.ray_pictures import RayPictures
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.resources import resource
from defras_sim.scene import load_scene
from defras_sim.surface import Surface

ROS1 = get_typestore(Stores.ROS1_NOETIC)
SCENE = load_scene(resource("sim/scenes/demo.yaml"))


def seen():
    """Half the region under tissue, as the depth camera sees it."""
    low_x_m = float(SCENE.roi_center_m[0])
    corners = [(low_x_m, -0.06), (0.06, -0.06), (0.06, 0.06), (low_x_m, 0.06)]
    points = np.array([(x, y, -0.0055) for x, y in corners])
    square = np.array([[0, 1, 2], [0, 2, 3]])
    surface = Surface(points, square, np.ones(4, bool), np.array(corners))
    eye = RayPictures(SCENE, SCENE.depth_camera)
    return eye.take(RayCaster(surface), 0.0, np.random.default_rng(0))


def camera_bag(file: Path, pictures: int = 3, colours: str = "rgb8") -> Path:
    """A ROS 1 bag of depth and colour pictures with their info."""
    image = seen()
    height, width = image.rgb.shape[:2]
    kinds = {name: ROS1.types[f"sensor_msgs/msg/{name}"] for name in ("Image", "CameraInfo")}
    header, time = ROS1.types["std_msgs/msg/Header"], ROS1.types["builtin_interfaces/msg/Time"]
    region = ROS1.types["sensor_msgs/msg/RegionOfInterest"]
    raw_depth = np.round(1e3 * np.nan_to_num(image.depth_m)).astype("<u2")
    with Writer(file) as bag:
        told = {
            topic: bag.add_connection(f"/d/{topic}", f"sensor_msgs/msg/{kind}", typestore=ROS1)
            for topic, kind in (("depth", "Image"), ("colour", "Image"), ("info", "CameraInfo"))
        }
        for number in range(pictures):
            at = header(seq=number, stamp=time(sec=10 + number, nanosec=0), frame_id="d")
            messages = {
                "depth": kinds["Image"](
                    header=at, height=height, width=width, encoding="16UC1", is_bigendian=0,
                    step=2 * width, data=np.frombuffer(raw_depth.tobytes(), np.uint8),
                ),
                "colour": kinds["Image"](
                    header=at, height=height, width=width, encoding=colours, is_bigendian=0,
                    step=3 * width, data=image.rgb.reshape(-1),
                ),
                "info": kinds["CameraInfo"](
                    header=at, height=height, width=width, distortion_model="plumb_bob",
                    D=np.zeros(5), K=image.intrinsics.ravel(), R=np.eye(3).ravel(),
                    P=np.zeros(12), binning_x=0, binning_y=0,
                    roi=region(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
                ),
            }  # fmt: skip
            for topic, message in messages.items():
                kind = type(message).__msgtype__
                raw = ROS1.serialize_ros1(message, kind)
                bag.write(told[topic], int((10 + number) * 1e9), raw)
    return file


def test_a_bag_of_depth_pictures_makes_coloured_clouds(tmp_path):
    views = read_views(camera_bag(tmp_path / "camera.bag"), 2)
    clouds = [view for view in views if view.cloud is not None]
    assert [view.source for view in clouds] == ["/d/depth, message 0", "/d/depth, message 2"]
    image, cloud = seen(), clouds[0].cloud
    assert np.array_equal(cloud.rgb, image.rgb)
    assert np.nanmax(np.abs(cloud.points[..., 2] - image.depth_m)) < 0.00051
    taken = taken_points(cloud, Colours().calibration)
    assert taken.any()
    assert (image.rgb[taken] == image.rgb[taken][0]).all()
    assert len([view for view in views if view.rgb is not None]) == 2


def test_colours_are_found_from_a_few_places_under_another_light():
    rgb = seen().rgb.repeat(4, axis=0).repeat(4, axis=1)
    truth = Colours().calibration
    tissue, roi = truth.tissue.mask(rgb), truth.roi.mask(rgb)
    assert tissue.any()
    assert roi.any()
    # A bluish, weaker lamp, unevenly over the picture: the usual ranges miss some of it.
    lamp = np.linspace(0.45, 0.65, rgb.shape[1])[None, :, None] * np.array([0.75, 0.9, 1.3])
    lit = np.clip(rgb * lamp, 0, 255).astype(np.uint8)

    def places(mask):
        rows, columns = np.nonzero(mask)
        order = np.argsort(columns)
        chosen = order[(np.linspace(0.05, 0.95, 5) * (len(order) - 1)).astype(int)]
        return [(int(columns[i]), int(rows[i])) for i in chosen]

    def well_inside(mask):
        return ndimage.binary_erosion(mask, np.ones((3, 3), bool), iterations=AROUND_PX + 1)

    for mask, other in ((tissue, roi), (roi, tissue)):
        found = fitted(lit, places(well_inside(mask))).range.mask(lit)
        assert found[mask].mean() > 0.9
        assert found[other].mean() < 0.1


def test_a_red_hue_runs_through_zero():
    rgb = np.zeros((20, 40, 3), np.uint8)
    rgb[:, :20], rgb[:, 20:] = (200, 20, 30), (200, 30, 20)
    found = fitted(rgb, [(10, 10), (30, 10)])
    assert found.hue[0] > found.hue[1]
    assert found.range.mask(rgb).all()
    with pytest.raises(OutsidePicture, match="column 40"):
        fitted(rgb, [(40, 0)])


def test_clouds_in_arrays_are_read_frame_by_frame(tmp_path):
    file = tmp_path / "clouds.npz"
    rng = np.random.default_rng(0)
    np.savez(file, sheet=rng.random((5, 30, 3)), names=np.array(["a"]), one=rng.random((7, 3)))
    sources = [view.source for view in read_views(file, 2)]
    assert sources == ["sheet, frame 0", "sheet, frame 4", "one, frame 0"]
    assert spread(1, 4) == [0]
    np.savez(file, nothing=np.zeros(3))
    with pytest.raises(NoCameraData, match="neither clouds nor pictures"):
        read_views(file)
    with pytest.raises(NoCameraData, match="does not exist"):
        read_views(tmp_path / "nowhere.bag")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("junk.bag", b"junk"),
        ("junk.npz", b"junk"),
        ("empty.npz", b""),
        ("cut.npz", b"PK\x03\x04junk"),
        ("pickled.npz", pickle.dumps([1])),
        ("folder", None),
        ("folder.npz", None),
    ],
)
def test_data_that_is_none_is_refused_in_one_line(tmp_path, name, content):
    file = tmp_path / name
    if content is None:
        file.mkdir()
    else:
        file.write_bytes(content)
    with pytest.raises(NoCameraData, match=rf"{name} is no (bag|\.npz)"):
        read_views(file)


def test_clouds_without_a_point_are_none(tmp_path):
    file, told = tmp_path / "clouds.npz", []
    np.savez(file, blind=np.full((2, 30, 3), np.nan))
    with pytest.raises(NoCameraData, match="blind is left out: it holds no measured point"):
        read_views(file)
    np.savez(file, blind=np.full((2, 30, 3), np.nan), sheet=np.ones((1, 30, 3)))
    assert [view.source for view in read_views(file, tell=told.append)] == ["sheet, frame 0"]
    assert told == ["blind is left out: it holds no measured point"]


def test_one_topic_that_cannot_be_used_leaves_the_others(tmp_path):
    told = []
    views = read_views(camera_bag(tmp_path / "c.bag", 2, "yuv422_yuy2"), 2, told.append)
    assert {view.source.split(",")[0] for view in views} == {"/d/depth"}
    assert len(told) == 1
    assert "/d/colour is left out: a colour picture of encoding 'yuv422_yuy2'" in told[0]


def test_the_command_leaves_pictures_and_settings(tmp_path):
    picture, out = tmp_path / "seen.png", tmp_path / "out"
    rgb = seen().rgb
    Image.fromarray(rgb).save(picture)
    rows, columns = np.nonzero(Colours().calibration.roi.mask(rgb))
    place = f"{columns[len(columns) // 2]},{rows[len(rows) // 2]}"
    told = CliRunner().invoke(app, ["calibrate", str(picture), "--roi", place, "-o", str(out)])
    assert told.exit_code == 0, told.output
    assert "region" in told.output
    assert (out / "view_01.png").stat().st_size > 1000
    settings = YAML(typ="safe").load((out / "colours.yaml").read_text())
    found = Colours.model_validate(settings["cameras"]["colours"])
    assert found.tissue == Colours().tissue
    assert found.roi != Colours().roi
