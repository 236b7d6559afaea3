"""ROS of the distribution reaches an environment by name, and nothing else does."""

import subprocess
import sys

import pytest

from defras_bt.dvrk import ros_packages
from defras_bt.dvrk.ros_packages import PLACES, RosMissing, ros_module

_ASK = """
import sys
from defras_bt.dvrk.ros_packages import ros_module
before = set(sys.modules)
ros_module("rospy"), ros_module("sensor_msgs.msg")
import numpy, yaml
for name in ("apt_pkg", "gi", "catkin_pkg.no_such_module"):
    try:
        __import__(name)
    except ImportError:
        continue
    raise SystemExit(f"{name} came along")
places = [str(p) for p in map(lambda m: getattr(m, "__file__", None) or "", sys.modules.values())]
alien = [p for p in places if "dist-packages" in p and ("numpy" in p or "yaml" in p)]
sys.exit("; ".join(alien) or 0)
"""


def test_only_packages_of_ros_come_from_the_distribution():
    if not any((place / "rospy").is_dir() for place in PLACES):
        pytest.skip("ROS 1 is not installed")
    asked = subprocess.run(
        [sys.executable, "-c", _ASK], capture_output=True, text=True, timeout=60, check=False
    )
    assert (asked.returncode, asked.stderr) == (0, "")


def test_without_ros_the_line_that_installs_it_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(ros_packages, "find_spec", lambda name: None)
    monkeypatch.setattr(ros_packages, "PLACES", (tmp_path,))
    with pytest.raises(RosMissing, match=r"apt-get install .* python3-rospy"):
        ros_module("rospy")
