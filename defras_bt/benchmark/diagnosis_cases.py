"""What the boards of the diagnosis hide, and what is asked of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from defras_bt.benchmark.hidden_draw import EFFECTS, NULL
from defras_sim.effects.effect import Extension, TwinName

Board = Literal["one", "nothing", "lacking", "two"]

_ARM: Mapping[str, Callable[[np.random.Generator], Extension]] = {
    "joint_play@q5": lambda rng: {"joint_play": {"q5_rad": rng.uniform(0.04, 0.1)}},
    "joint_play@q6": lambda rng: {"joint_play": {"q6_rad": rng.uniform(0.04, 0.1)}},
    "servo_lag@q1": lambda rng: {"servo_lag": {"q1_s": rng.uniform(0.03, 0.08)}},
    "servo_lag@q2": lambda rng: {"servo_lag": {"q2_s": rng.uniform(0.03, 0.08)}},
    "joint_offset@q4": lambda rng: {"joint_offset": {"q4_rad": rng.uniform(0.03, 0.1)}},
    "joint_coupling@q6<-q4,q5,q6": lambda rng: {
        "joint_coupling": {
            "q6_from_q4": rng.uniform(0.08, 0.2),
            "q6_from_q5": rng.uniform(0.08, 0.2),
        }
    },
}
_COUPON: Mapping[str, Callable[[np.random.Generator], Extension]] = {
    "strain_stiffening": lambda rng: {"strain_stiffening": {"coefficient": rng.uniform(0.4, 1.2)}},
    "stress_relaxation": lambda rng: {
        "stress_relaxation": {"fraction": rng.uniform(0.2, 0.5), "time_s": rng.uniform(5, 20)}
    },
    "softening": lambda rng: {"softening": {"share": rng.uniform(0.2, 0.5)}},
}
CAUSES: Mapping[TwinName, tuple[str, ...]] = {
    "arm": tuple(_ARM),
    "coupon": tuple(_COUPON),
    "tissue": EFFECTS,
}


@dataclass(frozen=True)
class BoardCase:
    """``causes`` are keys (effect, or effect@site) of what is hidden; those of the board "lacking"
    are taken out of the library before it is asked."""

    board: Board
    twin: TwinName
    causes: tuple[str, ...]
    seed: int

    @property
    def key(self) -> str:
        return f"{self.board} {self.twin} {'+'.join(self.causes) or NULL} {self.seed}"


def hidden_in_table(case: BoardCase, rng: np.random.Generator) -> Extension:
    """The effects that a case of the arm or the coupon hides."""
    drawn: dict[str, dict[str, float]] = {}
    source = _ARM if case.twin == "arm" else _COUPON
    for cause in case.causes:
        for effect, values in source[cause](rng).items():
            drawn.setdefault(effect, {}).update(values)
    return drawn


def board_cases(
    twin: TwinName, *, seeds: int, nulls: int, lacking: int, pairs: int, first_seed: int = 0
) -> list[BoardCase]:
    """``seeds`` of every cause, ``nulls`` without any, ``lacking`` of every cause with the effect
    taken out, and ``pairs`` with two causes of different effects."""
    found = [
        BoardCase("one", twin, (cause,), first_seed + seed)
        for seed in range(seeds)
        for cause in CAUSES[twin]
    ]
    found += [BoardCase("nothing", twin, (), first_seed + seed) for seed in range(nulls)]
    found += [
        BoardCase("lacking", twin, (cause,), first_seed + 500 + seed)
        for seed in range(lacking)
        for cause in CAUSES[twin]
    ]
    rng = np.random.default_rng(first_seed)
    while len([case for case in found if case.board == "two"]) < pairs:
        one, other = (str(cause) for cause in rng.choice(CAUSES[twin], 2, replace=False))
        if one.split("@")[0] != other.split("@")[0]:
            seed = first_seed + 900 + len(found)
            found.append(BoardCase("two", twin, tuple(sorted((one, other))), seed))
    return found
