from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_warnings import warning_states, warnings_remark

DELTA_M = (0.002, 0.004, 0.006)
PHASE = np.repeat([PHASES.index("rest"), PHASES.index("pull")], [2, 4])


def test_the_worst_patch_less_its_rest_decides() -> None:
    cloud_m = np.zeros((3, 6))
    cloud_m[0] = 0.001  # a camera a millimetre off at rest, too
    cloud_m[2, 2:] = [0.0025, -0.0045, 0.0061, 0.0075]
    cloud_m[1, 2:] = np.nan
    assert warning_states([cloud_m], [PHASE], DELTA_M).tolist() == [0, 1, 2, 3]


def test_a_frame_in_which_nothing_was_seen_warns_of_nothing() -> None:
    cloud_m = np.full((2, 6), np.nan)
    assert not warning_states([cloud_m], [PHASE], DELTA_M).any()


def test_the_remark_counts_frames_by_state() -> None:
    said = warnings_remark(np.array([0, 1, 3, 3]), np.array([0, 0, 0, 1]))
    assert (
        "75% of the frames after the rest (25% in state 1, 0% in state 2, 50% in state 3)" in said
    )
    assert "25% of the frames after the rest (25% in state 1" in said
