"""What is not as it should be with the stand-in's arms and cameras.

A file lists effects as a scene does (``effects``), and noise::

    effects:
      - {effect: servo_lag, q1_s: 0.045}
      - {effect: tool_offset, x_m: 0.001}
    force_noise_sd_n: 2.0
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from defras_sim.effects import library
from defras_sim.effects.layers import Layers
from defras_sim.resources import resource
from defras_sim.scene import Scene
from defras_sim.scene_parts import ModelExtension
from defras_sim.yaml_source import read_yaml

_LAYERS = ("arm", "camera", "clock")


class Imperfections(ModelExtension):
    """Effects of arms, cameras and clocks; the patient's own stand in the actual scene.

    ``force_noise_sd_n``: of ``body/measured_cf`` along each axis; motor currents tell forces only
    roughly. ``encoder_noise_rad``: of the joints, taken in metres for the insertion.
    ``transport_delay_s``: how long pictures take from the camera to the topic, their stamps being
    right.
    """

    force_noise_sd_n: Annotated[float, Field(ge=0, le=20)] = 0.0
    encoder_noise_rad: Annotated[float, Field(ge=0, le=0.01)] = 0.0
    transport_delay_s: Annotated[float, Field(ge=0, le=2)] = 0.0
    depth_noise_sd_m: Annotated[float, Field(ge=0, le=0.05)] | None = None

    def seen_by(self, actual: Scene) -> Scene:
        """``actual`` with the depth camera as noisy as this one is."""
        if self.depth_noise_sd_m is None:
            return actual
        camera = actual.depth_camera.model_copy(update={"noise_sd_m": self.depth_noise_sd_m})
        return actual.model_copy(update={"depth_camera": camera})

    @model_validator(mode="after")
    def _of_the_set_up(self) -> Imperfections:
        Layers.of(self.extension)
        for name in self.extension:
            layer = library.effect(name).layer
            if layer not in _LAYERS:
                raise ValueError(
                    f"{name} belongs to the {layer}, not to arms and cameras: say it in the actual "
                    "scene"
                )
        return self


def read_imperfections(named: str) -> Imperfections:
    """``none``, ``lab`` (what was measured on real arms), or a file.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    if named == "none":
        return Imperfections()
    file = resource("sim/imperfections/lab.yaml") if named == "lab" else Path(named)
    return read_yaml(file).validate(Imperfections)
