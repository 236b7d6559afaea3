"""The error of missing weights, apart from torch: whoever catches it need not load that."""

from __future__ import annotations


class NoWeights(RuntimeError):
    """There are no weights of a network, or they are not what their card says."""
