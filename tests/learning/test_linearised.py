"""Predicted flips are exact where the tissue is linear."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.learning.linearised import LinearisedFrame

HOLES, EACH, CELLS = 6, 3, 10
SIZE = HOLES * EACH


class LinearTissue:
    """A random linear body: stiffness matrix, a load, springs at its first unknowns."""

    def __init__(self, springs: np.ndarray) -> None:
        rng = np.random.default_rng(4)
        root = rng.normal(size=(30, 30))
        self.stiffness = root @ root.T + np.eye(30)
        self.load = rng.normal(size=30)
        self.looks = rng.normal(size=(CELLS, 30))
        self.springs = springs

    def frame(self) -> LinearisedFrame:
        tangent = self.stiffness.copy()
        tangent[:SIZE, :SIZE] += np.diag(np.repeat(self.springs, EACH))
        compliance = np.linalg.inv(tangent)
        x = compliance @ self.load
        return LinearisedFrame(
            self.looks @ x,
            (self.looks @ compliance[:, :SIZE]).reshape(CELLS, HOLES, EACH),
            compliance[:SIZE, :SIZE].reshape(HOLES, EACH, HOLES, EACH),
            x[:SIZE].reshape(HOLES, EACH),
        )


SPRINGS = np.array([50.0, 50.0, 0.0, 0.0, 50.0, 0.0])


def changed(flipped: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Springs after flipping holes, and what each of them gained."""
    after = SPRINGS.copy()
    after[flipped] = 50.0 - after[flipped]
    return after, (after - SPRINGS)[flipped]


@pytest.mark.parametrize("flipped", [[0], [2], [0, 2], [1, 3, 5], [0, 1, 2, 3, 4, 5]])
def test_a_predicted_flip_equals_a_new_solve(flipped: list[int]) -> None:
    springs, gained = changed(flipped)
    frame, expected = LinearTissue(SPRINGS).frame(), LinearTissue(springs).frame()
    predicted = frame.predict(np.array([flipped]), gained[None])
    np.testing.assert_allclose(predicted[0], expected.residual_m, atol=1e-9)
    after = frame.changed(np.array(flipped), gained)
    for name in ("residual_m", "jacobian", "compliance", "stretch_m"):
        np.testing.assert_allclose(getattr(after, name), getattr(expected, name), atol=1e-9)


def test_holes_of_a_block_that_do_not_change_do_not_matter() -> None:
    _, gained = changed([2])
    frame = LinearTissue(SPRINGS).frame()
    alone = frame.predict(np.array([[2]]), gained[None])
    among = frame.predict(np.array([[0, 2, 3]]), np.array([[0.0, gained[0], 0.0]]))
    np.testing.assert_allclose(among, alone, atol=1e-9)


def test_one_flip_after_another_equals_both_at_once() -> None:
    _, gained = changed([1, 3])
    frame = LinearTissue(SPRINGS).frame()
    first = frame.changed(np.array([1]), gained[:1])
    np.testing.assert_allclose(
        first.predict(np.array([[3]]), gained[None, 1:]),
        frame.predict(np.array([[1, 3]]), gained[None]),
        atol=1e-9,
    )
