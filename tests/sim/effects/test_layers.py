"""Effects find their layer; those of no strength find none."""

from __future__ import annotations

import pytest

from defras_sim.effects.layers import Layers
from defras_sim.effects.library import effects


def test_every_effect_of_the_tissue_twin_has_a_layer() -> None:
    for effect in effects("tissue"):
        strength = next(p for p in effect.parameters if p.strength)
        value = strength.null + strength.step
        value = value if value <= strength.upper else strength.null - strength.step
        layers = Layers.of({effect.name: {strength.name: value}})
        found = [e.name for part in (layers.arm, layers.grasp, layers.camera) for e, _ in part]
        found += [e.name for e, _ in layers.clock] + list(layers.tissue)
        assert found == [effect.name]
        assert Layers.of({effect.name: {}}) == Layers()


def test_only_strengths_make_an_effect() -> None:
    assert Layers.of({"grasp_slip": {"time_s": 3.0}}) == Layers()
    assert Layers.of({"camera_latency": {"delay_s": 0.2}}).delay_s == 0.2


def test_unknown_effects_and_values_are_refused() -> None:
    with pytest.raises(ValueError, match="there is no effect 'slip'"):
        Layers.of({"slip": {}})
    with pytest.raises(ValueError, match="should be between 0 and"):
        Layers.of({"grasp_slip": {"distance_m": -1.0}})
