"""The sequence network: what departed from the twin's prediction, frame by frame and hole by hole.

Two forms are kept, because they were tried against each other (docs in the model card): ``grid``
convolves over the grid of holes, ``points`` lets every hole attend to every other. Both work for
any number of holes. Their last layer has several heads, each trained on another random weighting of
the data (bootstrap, Osband et al. 2016): where they disagree, the network has not seen enough.
"""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

from defras_bt.learning.networks.hole_features import FRAME_CHANNELS, HOLE_CHANNELS

Form = Literal["grid", "points"]
HEADS = 4
_INPUTS = len(FRAME_CHANNELS) + len(HOLE_CHANNELS)


class FrameEncoder(nn.Module):
    """One keyframe after the other through the same layers; then the newest, their mean and their
    maximum side by side."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(_INPUTS, width, 1)
        self.second = nn.Conv2d(width, width, 3, padding=1)
        self.merge = nn.Conv2d(3 * width, width, 1)

    def forward(self, frames: Tensor, holes: Tensor, known: Tensor) -> Tensor:
        """``frames`` (b, f, c, rows, columns), of which the last is the newest; ``known`` (b, f)
        is 0 for frames that only fill the batch. Returns (b, width, rows, columns)."""
        batch, count = frames.shape[:2]
        beside = holes[:, None].expand(-1, count, -1, -1, -1)
        each = torch.cat([frames, beside], dim=2).flatten(0, 1)
        each = nn.functional.gelu(self.first(each))
        each = nn.functional.gelu(self.second(each)).unflatten(0, (batch, count))
        real = known[:, :, None, None, None]
        mean = (each * real).sum(dim=1) / real.sum(dim=1)
        most = each.masked_fill(real == 0, -1e4).amax(dim=1)
        return self.merge(torch.cat([each[:, -1], mean, most], dim=1))


class GridBlock(nn.Module):
    """Two convolutions, a dilated one first, and what all holes together say."""

    def __init__(self, width: int, dilation: int) -> None:
        super().__init__()
        self.norm = nn.GroupNorm(4, width)
        self.wide = nn.Conv2d(width, width, 3, padding=dilation, dilation=dilation)
        self.near = nn.Conv2d(width, width, 3, padding=1)
        self.overall = nn.Linear(2 * width, width)

    def forward(self, x: Tensor, is_hole: Tensor) -> Tensor:
        inner = nn.functional.gelu(self.wide(self.norm(x)))
        mean = (inner * is_hole).sum(dim=(2, 3)) / is_hole.sum(dim=(2, 3))
        most = inner.masked_fill(is_hole == 0, -1e4).amax(dim=(2, 3))
        overall = self.overall(torch.cat([mean, most], dim=1))
        out: Tensor = x + self.near(inner + overall[:, :, None, None]) * is_hole
        return out


class PointsBlock(nn.Module):
    """Attention among holes; who attends to whom depends on where they lie to each other, too."""

    def __init__(self, width: int, attention_heads: int = 4) -> None:
        super().__init__()
        self.attention_heads = attention_heads
        self.norm, self.norm_after = nn.LayerNorm(width), nn.LayerNorm(width)
        self.query_key_value = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)
        self.position = nn.Sequential(nn.Linear(3, 16), nn.GELU(), nn.Linear(16, attention_heads))
        self.own = nn.Sequential(
            nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width)
        )

    def forward(self, x: Tensor, apart: Tensor, is_hole: Tensor) -> Tensor:
        """``x`` (b, n, width), ``apart`` (n, n, 3), ``is_hole`` (b, n)."""
        batch, count, width = x.shape
        split = (batch, count, self.attention_heads, width // self.attention_heads)
        query, key, value = (
            part.reshape(split).transpose(1, 2)
            for part in self.query_key_value(self.norm(x)).chunk(3, dim=2)
        )
        bias = self.position(apart).permute(2, 0, 1)[None]
        bias = bias + (is_hole[:, None, None, :] - 1.0) * 1e4
        mixed = nn.functional.scaled_dot_product_attention(query, key, value, attn_mask=bias)
        x = x + self.out(mixed.transpose(1, 2).reshape(batch, count, width))
        out: Tensor = x + self.own(self.norm_after(x))
        return out


class SequenceNetwork(nn.Module):
    """Logits (b, heads, rows, columns) that each hole holds."""

    def __init__(self, form: Form = "grid", width: int = 40) -> None:
        super().__init__()
        self.form = form
        self.encoder = FrameEncoder(width)
        if form == "grid":
            self.blocks = nn.ModuleList([GridBlock(width, dilation) for dilation in (1, 2, 4)])
        else:
            self.blocks = nn.ModuleList([PointsBlock(width) for _ in range(3)])
        self.heads = nn.Conv2d(width, HEADS, 1)
        nn.init.zeros_(self.heads.weight)
        # An untrained network says about what the belief says: it learns what speaks against it.
        self.belief = nn.Parameter(torch.tensor([-3.0, 2.0]))

    def forward(self, frames: Tensor, holes: Tensor, known: Tensor) -> Tensor:
        """See :class:`FrameEncoder`; ``holes`` (b, c, rows, columns)."""
        is_hole = holes[:, HOLE_CHANNELS.index("is_hole")][:, None]
        x = self.encoder(frames, holes, known)
        if self.form == "grid":
            for block in self.blocks:
                x = block(x, is_hole)
        else:
            rows, columns = x.shape[2:]
            apart = _apart(rows, columns).to(x)
            tokens = x.flatten(2).transpose(1, 2)
            for block in self.blocks:
                tokens = block(tokens, apart, is_hole.flatten(1))
            x = tokens.transpose(1, 2).unflatten(2, (rows, columns))
        believed = holes[:, HOLE_CHANNELS.index("believed")][:, None]
        free, held = self.belief
        logits: Tensor = self.heads(nn.functional.gelu(x)) + free + believed * (held - free)
        return logits


def _apart(rows: int, columns: int) -> Tensor:
    """Where holes (n, n, 3) lie to each other, in fives of their pitch: along x, y, and how far."""
    y, x = torch.meshgrid(torch.arange(rows), torch.arange(columns), indexing="ij")
    place = torch.stack([x.flatten(), y.flatten()], dim=1).float() / 5.0
    between = place[:, None] - place[None]
    return torch.cat([between, between.norm(dim=2, keepdim=True)], dim=2)
