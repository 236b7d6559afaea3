"""What can go wrong with the stand-in on demand: one class a fault, from a file or by ROS topic.

::

    faults:
      - {fault: paused, arm: psm1, start_s: 4.0, duration_s: 2.0}
      - {fault: delayed, what: psm1, delay_s: 0.25, start_s: 3.0}
      - {fault: millimetres, start_s: 5.0}
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from defras_sim.scene_parts import ArmName, Part
from defras_sim.yaml_source import Fault as FileFault
from defras_sim.yaml_source import InvalidFile, YamlSource, read_yaml

Source = Literal["psm1", "psm2", "cloud", "endoscope"]


class StandInFault(Part):
    """One fault. ``start_s``: world time at which it begins; without ``duration_s`` it stays."""

    start_s: Annotated[float, Field(ge=0)] = 0.0
    duration_s: Annotated[float, Field(gt=0)] | None = None

    def active(self, time_s: float) -> bool:
        ended = self.duration_s is not None and time_s >= self.start_s + self.duration_s
        return time_s >= self.start_s and not ended


class ArmStops(StandInFault):
    """Somebody or something stops an arm: its operating state says so."""

    fault: Literal["paused", "fault", "unhomed"]
    arm: ArmName


class SecondClient(StandInFault):
    """Somebody else commands an arm too, away from where it is."""

    fault: Literal["second_client"]
    arm: ArmName
    speed_m_s: Annotated[float, Field(gt=0, le=0.05)] = 0.01


class Stamps(StandInFault):
    """Stamps stay at what they were, or run backwards; messages keep coming."""

    fault: Literal["stale_stamps", "backward_stamps"]
    what: Source


class Delayed(StandInFault):
    """Messages come late, their stamps being right."""

    fault: Literal["delayed"]
    what: Source
    delay_s: Annotated[float, Field(gt=0, le=10)] = 0.25


class Lost(StandInFault):
    """Messages get lost."""

    fault: Literal["lost"]
    what: Source
    probability: Annotated[float, Field(gt=0, le=1)] = 0.5


class Duplicated(StandInFault):
    """Every message comes twice."""

    fault: Literal["duplicated"]
    what: Source


class CameraFault(StandInFault):
    """The depth camera's driver gives millimetres, another frame, or one picture for ever."""

    fault: Literal["millimetres", "wrong_frame", "frozen"]


AnyFault = Annotated[
    ArmStops | SecondClient | Stamps | Delayed | Lost | Duplicated | CameraFault,
    Field(discriminator="fault"),
]

KINDS: Mapping[str, type[StandInFault]] = {
    **dict.fromkeys(("paused", "fault", "unhomed"), ArmStops),
    "second_client": SecondClient,
    **dict.fromkeys(("stale_stamps", "backward_stamps"), Stamps),
    "delayed": Delayed,
    "lost": Lost,
    "duplicated": Duplicated,
    **dict.fromkeys(("millimetres", "wrong_frame", "frozen"), CameraFault),
}
"""Every fault by its name in files."""

_ADAPTER: TypeAdapter[StandInFault] = TypeAdapter(AnyFault)


def fault_of(entry: Any) -> StandInFault:
    """The fault that ``entry`` (a mapping) describes.

    Raises:
        ValueError: it describes none; the message says what would be valid.
    """
    name = entry.get("fault") if isinstance(entry, dict) else None
    if name not in KINDS:
        near = get_close_matches(str(name), KINDS, n=1)
        hint = f", did you mean {near[0]}?" if near else ""
        raise ValueError(f"there is no fault {name!r}{hint}; there are: {', '.join(KINDS)}")
    try:
        return _ADAPTER.validate_python(entry)
    except ValidationError as error:
        told = "; ".join(f"{'.'.join(map(str, e['loc'][1:]))}: {e['msg']}" for e in error.errors())
        raise ValueError(f"fault {name}: {told}") from error


def read_faults(file: Path) -> tuple[StandInFault, ...]:
    """Read a fault file.

    Raises:
        InvalidFile: with everything that is wrong with it.
    """
    source = read_yaml(file)
    entries = source.data.get("faults")
    if set(source.data) != {"faults"} or not isinstance(entries, list) or not entries:
        message = "should hold faults: and under it at least one, as {fault: frozen, start_s: 4}"
        raise InvalidFile([source.fault((), message)])
    faults: list[StandInFault] = []
    wrong: list[FileFault] = []
    for index, entry in enumerate(entries):
        _read(source, index, entry, faults, wrong)
    if wrong:
        raise InvalidFile(wrong)
    return tuple(faults)


def _read(
    source: YamlSource,
    index: int,
    entry: Any,
    faults: list[StandInFault],
    wrong: list[FileFault],
) -> None:
    try:
        faults.append(fault_of(entry))
    except ValueError as error:
        wrong.append(source.fault(("faults", index), f"faults.{index}: {error}"))
