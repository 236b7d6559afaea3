"""The voxel network: after BANet (Tagliabue et al., MICCAI 2021), which maps the geometry before
the operation and the partial surface seen now to where the tissue is attached.

A 3D U-Net (Cicek et al. 2016), small enough for two cores. It knows neither the belief nor the
motion nor the forces; that is what the sequence network adds.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from defras_bt.learning.networks.voxels import CHANNELS


class Level(nn.Module):
    """Two convolutions with normalisation."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv3d(inputs, outputs, 3, padding=1),
            nn.GroupNorm(4, outputs),
            nn.GELU(),
            nn.Conv3d(outputs, outputs, 3, padding=1),
            nn.GELU(),
        )

    def forward(self, x: Tensor) -> Tensor:
        out: Tensor = self.layers(x)
        return out


class VoxelNetwork(nn.Module):
    """Logits (b, x, y, z) that tissue is held there, from channels (b, 3, x, y, z)."""

    def __init__(self, width: int = 8) -> None:
        super().__init__()
        self.down = nn.ModuleList(
            [Level(len(CHANNELS), width), Level(width, 2 * width), Level(2 * width, 4 * width)]
        )
        self.up = nn.ModuleList([Level(6 * width, 2 * width), Level(3 * width, width)])
        self.head = nn.Conv3d(width, 1, 1)

    def forward(self, channels: Tensor) -> Tensor:
        fine = self.down[0](channels)
        middle = self.down[1](nn.functional.max_pool3d(fine, 2))
        x = self.down[2](nn.functional.max_pool3d(middle, 2))
        x = self.up[0](torch.cat([_doubled(x), middle], dim=1))
        x = self.up[1](torch.cat([_doubled(x), fine], dim=1))
        logits: Tensor = self.head(x)[:, 0]
        return logits

    def at(self, channels: Tensor, corners: Tensor, weights: Tensor) -> Tensor:
        """Logits (b, holes) between voxels: the mean of those at ``corners`` (b, holes, 8), places
        in the flattened volume, weighted with ``weights`` (b, holes, 8)."""
        volume = self.forward(channels).flatten(1)
        count = corners.shape[1]
        values = volume.gather(1, corners.flatten(1)).unflatten(1, (count, 8))
        return (values * weights).sum(dim=2)


def _doubled(x: Tensor) -> Tensor:
    return nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")
