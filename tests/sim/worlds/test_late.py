"""Late readings come whole, in order, and stamped when they come out."""

from __future__ import annotations

import numpy as np

from defras_sim.worlds.late import LateReadings


def stamped(reading: tuple[float, float], stamp_s: float) -> tuple[float, float]:
    return reading[0], stamp_s


def deliver(delay_s: float) -> list[tuple[float, float, float]]:
    """(when it came out, when it was taken, its stamp) of readings taken every 0.1 s."""
    late = LateReadings[tuple[float, float]](delay_s, stamped)
    out = []
    for tick in range(40):
        now_s = tick * 0.05
        if tick % 2 == 0:
            late.add(now_s, (now_s, now_s))
        reading = late.arrived(now_s)
        if reading is not None:
            out.append((now_s, *reading))
    return out


def test_without_delay_everything_comes_at_once_untouched() -> None:
    assert all(now == taken == stamp for now, taken, stamp in deliver(0.0))


def test_a_stamp_tells_nothing_of_the_delay() -> None:
    first, *others = deliver(0.22)
    assert first == (0.0, 0.0, 0.0), "before it all was at rest"
    now, taken, stamp = np.array(others).T
    assert np.allclose(stamp - taken, 0.22)
    assert np.all(now >= stamp - 1e-9)
    assert np.all(now - stamp < 0.05)
    assert np.allclose(np.diff(taken), 0.1), "none is lost"
