"""Which causes may be named for a recording of tissue, and with which of their numbers free."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from defras_bt.diagnosis.problem import Candidate
from defras_sim.effects.effect import Effect
from defras_sim.effects.library import effects

SHAFT = ("q1", "q2", "q3")
WRIST = ("q4", "q5", "q6")

# What a single retraction cannot tell from the effect's strength keeps its usual value.
_KEPT = {"attachment_tear": ("force_n",), "softening": ("width",)}


def tissue_candidates(without: Collection[str] = ()) -> tuple[Candidate, ...]:
    """One per effect of the library that shows in a retraction, more where an effect has sites.

    Args:
        without: names of effects to leave out.

    Raises:
        ValueError: there is no such effect.
    """
    known = effects("tissue")
    unknown = set(without) - {effect.name for effect in known}
    if unknown:
        raise ValueError(
            f"there is no effect {', '.join(sorted(unknown))} to leave out; there are: "
            f"{', '.join(effect.name for effect in known)}"
        )
    return tuple(
        candidate for effect in known if effect.name not in without for candidate in _of(effect)
    )


def _of(effect: Effect) -> Iterator[Candidate]:
    """The wrist hardly turns in a retraction and moves the tip by millimetres; of the shaft's
    joints an offset, a scale or a lag shows jointly, slack one by one, as each joint turns back at
    its own time."""
    sites: dict[str, tuple[str, ...]]
    if effect.name == "joint_offset":
        sites = {"shaft": SHAFT, "wrist": WRIST}
    elif effect.name == "joint_play":
        sites = {joint: (f"{joint}_rad", f"{joint}_m") for joint in (*SHAFT, *WRIST)}
    elif effect.name == "joint_coupling":
        sites = {"shaft": tuple(f"{joint}_from_{joint}" for joint in SHAFT)}
    elif effect.name == "servo_lag":
        sites = {"shaft": SHAFT}
    elif effect.name == "arm_compliance":
        sites = {axis: (f"{axis}_m_per_n",) for axis in "xyz"}
    else:
        kept = _KEPT.get(effect.name, ())
        free = tuple(p for p in effect.parameters if p.name not in kept)
        yield Candidate(effect, free)
        return
    for site, starts in sites.items():
        free = tuple(p for p in effect.parameters if p.strength and p.name.startswith(starts))
        if free:
            yield Candidate(effect, free, site=site)
