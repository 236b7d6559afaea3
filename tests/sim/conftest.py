from __future__ import annotations

import pytest

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.anatomy.building import built
from defras_sim.anatomy.repair import sound_surface
from defras_sim.anatomy.solid import tissue_of
from tests.sim.anatomy.organs import lumpy_sheet


@pytest.fixture(scope="session")
def flap(tmp_path_factory: pytest.TempPathFactory) -> Anatomy:
    """A lumpy flap, 5 mm thick."""
    file = tmp_path_factory.mktemp("anatomy") / "flap.npz"
    return built(tissue_of(sound_surface(lumpy_sheet()), 0.005), file, lambda text: None)
