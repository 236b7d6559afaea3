"""The part of a laboratory's set-up file that speaks of its cameras."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from defras_bt.sensing.colours import DEFAULT_COLOURS, ColourCalibration, HsvRange
from defras_sim.scene_parts import Part

Topic = Annotated[str, Field(pattern=r"^/?[A-Za-z][A-Za-z0-9_/]*$")]
Share = Annotated[float, Field(ge=0, le=1)]
Range = tuple[Share, Share]


class Hsv(Part):
    """A box in hue, saturation and value; a hue range may run through 1 = 0 (red)."""

    hue: Range = (0.0, 1.0)
    saturation: Range = (0.0, 1.0)
    value: Range = (0.0, 1.0)

    @property
    def range(self) -> HsvRange:
        return HsvRange(self.hue, self.saturation, self.value)

    @staticmethod
    def of(colours: HsvRange) -> Hsv:
        return Hsv(hue=colours.hue, saturation=colours.saturation, value=colours.value)


class Colours(Part):
    """What colours tissue and region of interest have under the laboratory's light."""

    tissue: Hsv = Hsv.of(DEFAULT_COLOURS.tissue)
    roi: Hsv = Hsv.of(DEFAULT_COLOURS.roi)

    @property
    def calibration(self) -> ColourCalibration:
        return ColourCalibration(self.tissue.range, self.roi.range)


class DepthCamera(Part):
    """A depth camera: a topic of coloured clouds, or depth and colour images with their info.

    ``frame``: the one its messages must carry, an optical frame: x right, y down, z ahead.
    """

    frame: str
    cloud: Topic | None = None
    depth: Topic | None = None
    colour: Topic | None = None
    info: Topic | None = None

    @model_validator(mode="after")
    def _one_way(self) -> DepthCamera:
        images = (self.depth, self.colour, self.info)
        if (self.cloud is None) == (not any(images)) or (any(images) and not all(images)):
            raise ValueError("give either cloud, or all of depth, colour and info")
        return self


class Endoscope(Part):
    """A colour camera that sees the region of interest; ``frame`` is its optical frame."""

    frame: str
    image: Topic
    info: Topic


class Cameras(Part):
    """The cameras that there are, and what they take for tissue and for the region."""

    depth: DepthCamera | None = None
    endoscope: Endoscope | None = None
    colours: Colours = Colours()
