"""Which effects on tissue PyBullet can imitate: those that are another slab, and no more."""

from __future__ import annotations

from defras_sim.effects import library
from defras_sim.effects.layers import Layers
from defras_sim.effects.tissue_effect import TissueEffect
from defras_sim.scene import Scene
from defras_sim.worlds.error import CannotImitate

_ANOTHER_SLAB = frozenset({"gravity", "stiffness", "thickness"})


def in_bullet(scene: Scene, layers: Layers) -> Scene:
    """The scene whose plain tissue behaves as that of ``scene`` with its effects.

    Raises:
        CannotImitate: one of the effects needs more than another slab; it is named.
    """
    for name, values in layers.tissue.items():
        effect = library.effect(name)
        if name not in _ANOTHER_SLAB or not isinstance(effect, TissueEffect):
            raise CannotImitate(
                f"PyBullet's tissue cannot have the effect {name} (of effects on the tissue it "
                f"imitates {', '.join(sorted(_ANOTHER_SLAB))}); run the scene in the model world "
                "(--world model)"
            )
        scene = effect.scene(values, scene)
    return scene
