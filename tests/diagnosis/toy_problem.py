"""An analytic problem for the diagnosis engine: joints that follow set-points, wrongly.

Its twin costs microseconds, so that error rates can be measured over hundreds of data sets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Channel, Samples, Tangent
from defras_sim.effects.effect import Effect, EffectParameter, Extension
from defras_sim.geometry import Floats


def _effect(name: str, *parameters: EffectParameter) -> Effect:
    kind = type(
        name,
        (Effect,),
        {
            "name": name,
            "layer": "arm",
            "twins": ("arm",),
            "sentence": f"{name} in a toy",
            "parameters": parameters,
            "falsified_by": "-",
            "excited_by": "-",
            "source": "-",
        },
    )
    return kind()


def play(setpoint: Floats, width: float) -> Floats:
    """Backlash operator on each row's past: the output rests until the slack is used up."""
    found = np.empty_like(setpoint)
    state = setpoint[0]
    for row, value in enumerate(setpoint):
        state = min(max(state, value - width / 2.0), value + width / 2.0)
        found[row] = state
    return found


def coloured(rng: np.random.Generator, length: int, ar: Sequence[float]) -> Floats:
    """Autoregressive noise of variance 1."""
    burn = 500
    white = rng.standard_normal(length + burn)
    found = np.zeros(length + burn)
    for t in range(len(found)):
        for lag, a in enumerate(ar, start=1):
            if t >= lag:
                found[t] += a * found[t - lag]
        found[t] += white[t]
    # Variance from the impulse response.
    response = np.zeros(4000)
    response[0] = 1.0
    for t in range(1, len(response)):
        response[t] = sum(a * response[t - lag] for lag, a in enumerate(ar, 1) if t >= lag)
    return found[burn:] / np.sqrt((response**2).sum())


def wander(rng: np.random.Generator, length: int, channels: int, smooth: int = 40) -> Floats:
    """Set-points (length, channels): smooth random motion of standard deviation 1."""
    kernel = np.hanning(2 * smooth + 1)
    raw = rng.standard_normal((length + 2 * smooth, channels))
    found = np.stack([np.convolve(raw[:, c], kernel, "valid") for c in range(channels)], axis=1)
    return found / found.std(axis=0)


@dataclass
class ToyProblem:
    """Joints q1..qC in several trajectories. Effects: ``offset``, ``scale``, ``coupling``,
    ``play``, ``bend`` (q squared), ``ghost`` (changes nothing)."""

    setpoints: Sequence[Floats]
    measured: Sequence[Floats]
    noise_sd: float = 1.0
    floor: float = 0.05
    dt: float = 0.1
    blocks: int = 8
    leave_out: Sequence[str] = ()
    nuisance: Sequence[str] = ()
    special_cases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    calls: int = field(default=0)

    def __post_init__(self) -> None:
        channels = self.setpoints[0].shape[1]
        names = [f"q{c + 1}" for c in range(channels)]

        def parameters(kind: str, lower: float, upper: float, step: float) -> list[EffectParameter]:
            return [
                EffectParameter(f"{n}_{kind}", "deg", 0.0, lower, upper, step, kind) for n in names
            ]

        self.effects = {
            "offset": _effect("offset", *parameters("offset", -50.0, 50.0, 0.5)),
            "scale": _effect("scale", *parameters("scale", -5.0, 5.0, 0.1)),
            "play": _effect("play", *parameters("play", 0.0, 8.0, 0.3)),
            "bend": _effect("bend", *parameters("bend", -5.0, 5.0, 0.1)),
            "ghost": _effect("ghost", EffectParameter("g", "N", 0.0, -1.0, 1.0, 0.1, "nothing")),
            "coupling": _effect(
                "coupling",
                *[
                    EffectParameter(f"{n}_from_{m}", "", 0.0, -5.0, 5.0, 0.1, "coupling")
                    for n in names
                    for m in names
                    if n != m
                ],
            ),
        }
        for name, special in self.special_cases.items():
            type(self.effects[name]).special_cases = special
        found = []
        for effect in self.effects.values():
            for p in effect.parameters:
                site = "" if effect.name == "ghost" else p.name.replace(f"_{effect.name}", "")
                candidate = Candidate(effect, (p,), site, nuisance=effect.name in self.nuisance)
                if candidate.key not in self.leave_out and effect.name not in self.leave_out:
                    found.append(candidate)
        self._candidates = tuple(found)
        time, channel, trajectory, fold = [], [], [], []
        for t, setpoint in enumerate(self.setpoints):
            length = len(setpoint)
            for c in range(channels):
                time.append(self.dt * np.arange(length))
                channel.append(np.full(length, c))
                trajectory.append(np.full(length, t))
                block = np.arange(length) * self.blocks // length
                fold.append(block + (t * self.blocks))
        self._samples = Samples(
            tuple(Channel(n, "joints", "deg", self.noise_sd, self.floor) for n in names),
            tuple(f"run {t}" for t in range(len(self.setpoints))),
            ("move",),
            np.concatenate(time),
            np.concatenate(channel),
            np.concatenate(trajectory),
            np.zeros(sum(map(len, channel)), dtype=np.int64),
            np.concatenate(fold),
        )

    @property
    def samples(self) -> Samples:
        return self._samples

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        return self._candidates

    def predicted(self, setpoint: Floats, model: Extension) -> Floats:
        found = setpoint.copy()
        channels = setpoint.shape[1]
        for c in range(channels):
            n = f"q{c + 1}"
            width = model.get("play", {}).get(f"{n}_play", 0.0)
            if width > 0.0:
                found[:, c] = play(found[:, c], width)
            found[:, c] += model.get("offset", {}).get(f"{n}_offset", 0.0)
            found[:, c] += model.get("scale", {}).get(f"{n}_scale", 0.0) * setpoint[:, c]
            found[:, c] += model.get("bend", {}).get(f"{n}_bend", 0.0) * setpoint[:, c] ** 2
            for d in range(channels):
                found[:, c] += (
                    model.get("coupling", {}).get(f"{n}_from_q{d + 1}", 0.0) * setpoint[:, d]
                )
        return found

    def prediction(self, model: Extension) -> Floats:
        return np.concatenate([self.predicted(s, model).T.ravel() for s in self.setpoints])

    def residual(self, model: Extension) -> Floats:
        self.calls += 1
        return np.concatenate([m.T.ravel() for m in self.measured]) - self.prediction(model)

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        now = self.prediction(model)
        (p,) = candidate.free
        name = candidate.effect.name
        value = model.get(name, {}).get(p.name, p.null)

        def column(change: float) -> Floats:
            inner = {**model, name: {**model.get(name, {}), p.name: value + change}}
            return (self.prediction(inner) - now)[:, None]

        if name == "play" and value == 0.0:
            widths = (0.3, 0.6, 1.2, 2.4, 4.8)
            return [Tangent({p.name: 0.0}, ({p.name: w},), column(w)) for w in widths]
        return [Tangent({p.name: value}, ({p.name: p.step},), column(p.step))]


def toy(
    rng: np.random.Generator,
    hidden: Mapping[str, Mapping[str, float]],
    *,
    channels: int = 3,
    length: int = 1000,
    trajectories: int = 1,
    ar: Sequence[float] = (0.97,),
    sd: float = 1.0,
    gaps: float = 0.0,
    correlation: float = 0.0,
    **options: object,
) -> ToyProblem:
    """Data with ``hidden`` effects and autocorrelated noise of standard deviation ``sd``."""
    setpoints = [3.0 * wander(rng, length, channels) for _ in range(trajectories)]
    empty = ToyProblem(setpoints, setpoints)
    measured = []
    for setpoint in setpoints:
        noise = np.stack([coloured(rng, length, ar) for _ in range(channels)], axis=1)
        common = coloured(rng, length, ar)[:, None]
        noise = np.sqrt(1.0 - correlation) * noise + np.sqrt(correlation) * common
        data = empty.predicted(setpoint, hidden) + sd * noise
        if gaps > 0.0:
            for c in range(channels):
                at = rng.random(length) < gaps / 20.0
                lost = np.convolve(at, np.ones(20), "full")[:length] > 0
                data[lost, c] = np.nan
        measured.append(data)
    return ToyProblem(setpoints, measured, noise_sd=sd, **options)
