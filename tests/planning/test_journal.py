"""A rehearsal journal: a search that was killed goes on where it was."""

from __future__ import annotations

import pytest

from defras_bt.planning import rehearsals
from defras_bt.planning.engine import Engine
from defras_bt.planning.execution import Execution
from defras_bt.planning.journal import InvalidJournal, Journal, search_key
from defras_bt.planning.rehearsals import rehearse_all
from tests.planning.conftest import make_scene

DONE = (Execution((1, 1), ("pull",), 0.5, 0.1, True),)


@pytest.fixture(scope="module")
def small():
    return make_scene(2, 1, 0.01, tissue={"elements_xyz": (4, 4, 1)})


def test_what_was_added_is_known_again(tmp_path):
    file = tmp_path / "j"
    Journal(file).add("key", (1, 1), DONE)
    again = Journal(file)
    assert again.known("key", (1, 1)) == DONE
    assert again.known("key", (2, 1)) is None
    assert again.known("other", (1, 1)) is None


def test_a_line_cut_short_by_a_kill_is_left_out_and_the_next_is_whole(tmp_path):
    file = tmp_path / "j"
    journal = Journal(file)
    journal.add("key", (1, 1), DONE)
    journal.add("key", (2, 1), DONE)
    file.write_text(file.read_text()[:-20])
    again = Journal(file)
    assert again.known("key", (2, 1)) is None
    again.add("key", (3, 1), DONE)
    last = Journal(file)
    assert last.known("key", (1, 1)) == last.known("key", (3, 1)) == DONE


def test_another_file_is_refused_with_its_line(tmp_path):
    file = tmp_path / "j"
    file.write_text('{"key": "a"}\n')
    with pytest.raises(InvalidJournal, match="j:1: not a line of a rehearsal journal"):
        Journal(file)


def test_finished_points_are_not_rehearsed_again(small, tmp_path, monkeypatch):
    key = search_key(small, 0.01)
    journal = Journal(tmp_path / "j")
    journal.add(key, (1, 1), DONE)
    rehearsed = []
    real = rehearsals._rehearse_point

    def watched(scene, number, point, step_m):
        rehearsed.append(point)
        return real(scene, number, point, step_m)

    monkeypatch.setattr(rehearsals, "_rehearse_point", watched)
    ticks = []
    found = rehearse_all(
        [small],
        engine=Engine(jobs=1),
        journal=journal,
        progress=lambda *tick: ticks.append(tick),
        step_m=0.01,
    )[0]
    assert rehearsed == [(2, 1)]
    assert ticks == [(1, 2), (2, 2)]
    assert found[0] == DONE[0]
    assert Journal(journal.file).known(key, (2, 1)) == found[1:]


def test_a_changed_scene_is_rehearsed_anew(small):
    stiffer = small.model_copy(
        update={"tissue": small.tissue.model_copy(update={"young_modulus_pa": 4000.0})}
    )
    keys = {search_key(small, 0.01), search_key(stiffer, 0.01), search_key(small, 0.02)}
    assert len(keys) == 3
