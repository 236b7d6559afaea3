"""Testing aids for nodes and trees, this project's and your own.

A :class:`NodeBench` ticks one node by hand, in a world of perfect tools whose services (twin,
monitoring, planner, estimator, rehearsal) say what the test wants::

    >>> from py_trees.common import Status
    >>> from defras_bt.acting.jaw import Grasp
    >>> from defras_bt.executive.testing import NodeBench
    >>> bench = NodeBench()
    >>> bench.put("psm1", (*bench.scene.grasp_xy_m(2, 4), 0.0), jaw_rad=0.8)
    >>> bench.board.at["psm1"] = (2, 4)
    >>> grasp = bench.node(Grasp, arm="psm1", point=(2, 4))
    >>> bench.tick(grasp), grasp.code.value, bench.commanded_jaw_rad()
    (<Status.RUNNING: 'RUNNING'>, 'closing', 0.0)
    >>> bench.run(grasp) == Status.SUCCESS, bench.told("action")
    (True, ['PSM1 has grasped the tissue at (2, 4).'])

What a node is told can be changed between two ticks::

    >>> from defras_bt.monitoring.guards import ForceAccepted
    >>> guard = bench.node(ForceAccepted)
    >>> bench.says["force_n"] = float("nan")
    >>> bench.tick(guard), guard.code.value
    (<Status.FAILURE: 'FAILURE'>, 'force_unknown')

Scripted leaves stand in for nodes that are not the matter of a test::

    >>> from py_trees.composites import Sequence
    >>> first = bench.scripted("first", "SUCCESS", "FAILURE")
    >>> talk = Sequence("talk", memory=False, children=[first, guard])
    >>> bench.says.clear()
    >>> bench.ticks(talk, 2)
    ['SUCCESS', 'FAILURE']

With ``pytest_plugins = ["defras_bt.executive.testing.pytest_plugin"]`` in a conftest.py, tests have
the fixture ``node_bench``, and ``pytest --tree-coverage FILE`` notes which nodes were ticked.
"""

from defras_bt.executive.scripted import Script, ScriptedLeaf, ScriptStep
from defras_bt.executive.testing.bench import EPSILON_N, NodeBench
from defras_bt.executive.testing.services import (
    MU_M,
    BenchEstimator,
    BenchMonitor,
    BenchPlanner,
    BenchRehearsal,
    BenchTwin,
    flat_state,
    plan_of,
)
from defras_bt.executive.testing.world import BenchWorld, bench_scene, flat_cloud_m

__all__ = [
    "EPSILON_N",
    "MU_M",
    "BenchEstimator",
    "BenchMonitor",
    "BenchPlanner",
    "BenchRehearsal",
    "BenchTwin",
    "BenchWorld",
    "NodeBench",
    "Script",
    "ScriptStep",
    "ScriptedLeaf",
    "bench_scene",
    "flat_cloud_m",
    "flat_state",
    "plan_of",
]
