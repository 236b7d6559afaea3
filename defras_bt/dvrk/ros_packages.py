"""ROS 1 out of the distribution's Python packages, and nothing else from there.

Debian and Ubuntu install ROS 1 into a folder that a virtual environment does not see. Putting the
whole folder on the path would lay the distribution's numpy, yaml and setuptools beside those of the
environment. So a finder at the very end of the search serves the packages of ROS by name; whatever
else they need comes from the environment. They are pure Python.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

DEBIAN_PACKAGES = (
    "python3-rospy",
    "python3-roslaunch",
    "python3-geometry-msgs",
    "python3-sensor-msgs",
    "python3-std-msgs",
)
"""What `make test` installs where it is missing; `roscore` comes with them."""

INSTALL_LINE = f"apt-get install -y --no-install-recommends {' '.join(DEBIAN_PACKAGES)}"

PLACES = (
    Path("/usr/lib/python3/dist-packages"),
    Path("/opt/ros/noetic/lib/python3/dist-packages"),
)
"""Where distributions put ROS 1: Debian and Ubuntu, and ROS Noetic's own packages."""

_OF_ROS = frozenset(
    {
        "catkin",
        "catkin_pkg",
        "genmsg",
        "genpy",
        "geometry_msgs",
        "roscpp",
        "rosgraph",
        "rosgraph_msgs",
        "roslib",
        "rospkg",
        "rospy",
        "sensor_msgs",
        "std_msgs",
    }
)


class RosMissing(RuntimeError):
    """ROS 1 is not installed; the message says how to get it."""


def ros_module(name: str) -> ModuleType:
    """Import a module of ROS 1, such as ``rospy`` or ``sensor_msgs.msg``.

    A sourced ROS environment (``PYTHONPATH``) comes first, then the distribution's packages.

    Raises:
        RosMissing: it is not there.
    """
    if find_spec("rospy") is None:
        place = next((place for place in PLACES if (place / "rospy").is_dir()), None)
        if place is None:
            raise RosMissing(
                "ROS 1 is not installed: no rospy on PYTHONPATH or in "
                f"{' or '.join(map(str, PLACES))}. On Debian 12: {INSTALL_LINE}"
            )
        sys.meta_path.append(_RosFinder(place))
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise RosMissing(
            f"ROS 1 is not installed whole: {error}. On Debian 12: {INSTALL_LINE}"
        ) from error


class _RosFinder(MetaPathFinder):
    """Finds the packages of ROS in one folder, and no others."""

    def __init__(self, place: Path) -> None:
        self._place = [str(place)]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: Any = None
    ) -> ModuleSpec | None:
        if path is not None or fullname not in _OF_ROS:
            return None
        return PathFinder.find_spec(fullname, self._place, target)
