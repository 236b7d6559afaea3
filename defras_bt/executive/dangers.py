"""What leaves may promise to notice: the dangers that claims about trees speak of."""

from __future__ import annotations

WORLD: dict[str, tuple[str, ...]] = {
    "readings": ("fresh", "missing"),
    "operator": ("permits", "pauses", "drives", "stops"),
    "force": ("tolerable", "dangerous"),
    "warning": ("0", "1", "2", "3", "unknown"),
}
"""What leaves may ask about in a tick, and what it may be. It is the same for all leaves of a tick.

The operator drives after having taken over the arms. The force is dangerous where it is unknown, or
was over its threshold for ``LONGEST_PATIENCE_S``.
"""

LONGEST_PATIENCE_S = 1.0
"""From then on a force over its threshold is dangerous, and no guard may be patient any more."""
