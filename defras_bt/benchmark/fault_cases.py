"""The fault campaign's patient, and one fault of each kind drawn at random."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from defras_bt.faults.fault import Fault
from defras_bt.faults.faults import KINDS, Faults
from defras_sim.scene import Attachments, Camera, Roi, Scene, Simulation, Tissue

BELIEVED = tuple("........####" if 2 <= row <= 9 else "............" for row in range(12))
# In truth two more stitches hold the far corner: runs in which there is something to learn, too.
MORE = ("...####.....", "...####.....", *BELIEVED[2:])
_COARSE = (4, 4, 1)
_CAMERA = {"target_m": (0.0, 0.0, 0.0), "width_px": 80, "height_px": 60}


def patient(rows: tuple[str, ...] = BELIEVED) -> Scene:
    """A slab on a coarse mesh, seen by small cameras: a run takes seconds.

    Twin and world share the mesh, so that what monitoring sees is the fault and nothing else.
    """
    return Scene(
        name="fault_campaign",
        tissue=Tissue(elements_xyz=_COARSE),
        attachments=Attachments(map=rows),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        simulation=Simulation(elements_xyz=_COARSE),
        endoscope=Camera.model_validate({**_CAMERA, "position_m": (-0.17, 0.0, 0.12)}),
        depth_camera=Camera.model_validate(
            {**_CAMERA, "position_m": (0.17, 0.0, 0.20), "noise_sd_m": 0.0005}
        ),
    )


# A run without faults takes 8 s; before 0.6 s monitoring calibrates.
_EARLIEST_S, _LATEST_S = 0.6, 6.5
_SHORTEST_S, _LONGEST_S = 0.2, 3.0
_FOR_GOOD = 0.3
"""Share of the faults that last to the end."""

_READINGS = ("cloud", "visibility", "camera", "psm1", "psm2")
Draw = Callable[[np.random.Generator], dict[str, Any]]


def _reading(rng: np.random.Generator) -> dict[str, Any]:
    return {"reading": str(rng.choice(_READINGS))}


def _likely_reading(rng: np.random.Generator) -> dict[str, Any]:
    return {**_reading(rng), "probability": float(rng.uniform(0.2, 1.0))}


def _delay(rng: np.random.Generator) -> dict[str, Any]:
    return {**_reading(rng), "delay_s": float(rng.uniform(0.05, 1.0))}


def _direction(length_m: float) -> Draw:
    def draw(rng: np.random.Generator) -> dict[str, Any]:
        way = rng.standard_normal(3)
        return {"offset_m": tuple((length_m * way / np.linalg.norm(way)).tolist())}

    return draw


def _up_or_down(rng: np.random.Generator) -> dict[str, Any]:
    return {"offset_m": (0.0, 0.0, float(rng.choice((-0.015, 0.015))))}


def _arm(rng: np.random.Generator) -> dict[str, Any]:
    return {"arm": str(rng.choice(("psm1", "psm2")))}


def _jumped(rng: np.random.Generator) -> dict[str, Any]:
    return {**_direction(0.02)(rng), **_arm(rng)}


def _node(rng: np.random.Generator) -> dict[str, Any]:
    return {"node": str(rng.choice(("**/act/*", "**/force_accepted", "**/sensors_fresh")))}


def _late(rng: np.random.Generator) -> dict[str, Any]:
    return {"seconds": float(rng.uniform(0.1, 2.0)), "probability": 0.3}


def _recorder(rng: np.random.Generator) -> dict[str, Any]:
    return {"recorder": str(rng.choice(("timeline", "recording", "all")))}


_DRAWS: Mapping[str, Draw] = {
    "frozen": _reading,
    "dropped": _likely_reading,
    "delayed": _delay,
    "duplicated": _likely_reading,
    "out_of_order": _likely_reading,
    "missing": _reading,
    "not_a_number": _reading,
    "displaced": _up_or_down,
    "jumped": _jumped,
    "not_following": _arm,
    "commands_lost": _arm,
    "republished": _arm,
    "jaw_stuck": _arm,
    "grasp_lost": _arm,
    "late_tree": _late,
    "node_raises": _node,
    "node_hangs": _node,
    "disk_full": _recorder,
}


def drawn_fault(kind: str, seed: int) -> Faults:
    """One fault of ``kind``; equal seeds give equal faults.

    Raises:
        KeyError: there is no such kind.
    """
    rng = np.random.default_rng([seed, *kind.encode()])
    values: dict[str, Any] = {"start_s": float(rng.uniform(_EARLIEST_S, _LATEST_S))}
    if rng.random() > _FOR_GOOD:
        values["duration_s"] = float(rng.uniform(_SHORTEST_S, _LONGEST_S))
    if kind in _DRAWS:
        values |= _DRAWS[kind](rng)
    fault: Fault = KINDS[kind].model_validate(values)
    return Faults((fault,), seed)
