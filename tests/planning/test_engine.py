"""Where rehearsals run, up to a real Dask cluster of two workers."""

from __future__ import annotations

import pytest

from defras_bt.planning.engine import Engine, EngineUnavailable, UnknownEngine, engine_named
from defras_bt.planning.rehearsals import rehearse_all
from tests.planning.conftest import make_scene, same_outcomes


@pytest.mark.parametrize(
    ("text", "engine"),
    [
        ("local", Engine("local", None, 3)),
        ("dask", Engine("dask", None, 3)),
        ("dask://10.0.0.1:8786", Engine("dask", "tcp://10.0.0.1:8786", 3)),
    ],
)
def test_names(text, engine):
    assert engine_named(text, 3) == engine


@pytest.mark.parametrize("text", ["", "ray", "dask:", "dask://host", "dask://:1", "dask://h:x"])
def test_unknown_names_say_what_is_valid(text):
    with pytest.raises(UnknownEngine, match="valid are local, dask"):
        engine_named(text)


def test_two_dask_workers_give_what_one_process_gives():
    distributed = pytest.importorskip("dask.distributed", reason="install defras[dask]")
    small = make_scene(2, 1, 0.01, tissue={"elements_xyz": (4, 4, 1)})
    alone = rehearse_all([small], engine=Engine(jobs=1), step_m=0.01)
    ours = rehearse_all([small], engine=Engine("dask", jobs=2), step_m=0.01)
    assert same_outcomes(ours[0], alone[0])
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        engine = engine_named(cluster.scheduler_address.replace("tcp://", "dask://"))
        theirs = rehearse_all([small], engine=engine, step_m=0.01)
    assert same_outcomes(theirs[0], alone[0])


def test_a_scheduler_that_does_not_answer_is_named():
    pytest.importorskip("dask.distributed", reason="install defras[dask]")
    with (
        pytest.raises(EngineUnavailable, match=r"no Dask scheduler answers at tcp://127.0.0.1:9"),
        engine_named("dask://127.0.0.1:9").running(),
    ):
        pass
