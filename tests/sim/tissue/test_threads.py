"""Tissue can be solved in a thread while the rest of the program goes on."""

import importlib
import pkgutil
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

import defras_sim.tissue
from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.tissue.model import TissueModel

MODULES = [
    f"defras_sim.tissue.{found.name}" for found in pkgutil.iter_modules(defras_sim.tissue.__path__)
]


def compiled(module: str) -> list[CPUDispatcher]:
    """The compiled functions that ``module`` defines."""
    values = vars(importlib.import_module(module)).values()
    return [v for v in values if isinstance(v, CPUDispatcher) and v.py_func.__module__ == module]


@pytest.mark.parametrize("module", MODULES)
def test_compiled_functions_release_the_interpreter(module):
    assert [f.__name__ for f in compiled(module) if not f.targetoptions.get("nogil")] == []


def test_there_are_compiled_functions():
    assert sum(len(compiled(module)) for module in MODULES) > 20


def lifted(seed: int) -> np.ndarray:
    """Surface after a lift and a move that depend on ``seed``."""
    rng = np.random.default_rng(seed)
    scene = Scene(
        name="threads",
        attachments=Attachments(map=("##..........",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
    )
    model = TissueModel(scene, elements_xyz=(5, 5, 1))
    tip = Pose(np.array([0.04, rng.uniform(-0.03, 0.03), 0.0]))
    model.grasp("psm1", tip)
    for way in ([0, 0, 0.02], [-0.01, 0.01, 0.02]):
        state = model.solve({"psm1": tip.moved(np.array(way))})
        assert state.converged
    return state.surface.vertices_m


def test_two_threads_do_not_disturb_each_other():
    alone = [lifted(seed) for seed in range(4)]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(lifted, range(4)))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)
