"""Which versions of which packages a run was made with."""

from __future__ import annotations

import platform
from importlib.metadata import version

PACKAGES = ("defras", "py-trees", "clingo", "numpy", "scipy", "numba", "pybullet", "rerun-sdk")


def versions() -> dict[str, str]:
    """Package to version, and ``python``, for ``run.json``."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}
