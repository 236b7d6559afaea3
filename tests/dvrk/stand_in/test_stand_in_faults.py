"""Faults of the stand-in: read, put in order of time, and worked into messages."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.stand_in.delivery import Delivery
from defras_bt.dvrk.stand_in.faults import ArmStops, Delayed, fault_of, read_faults
from defras_bt.dvrk.stand_in.menu import Menu
from defras_sim.yaml_source import InvalidFile


class Outlet:
    def __init__(self) -> None:
        self.sent: list[Any] = []

    def publish(self, message: Any) -> None:
        self.sent.append((message.number, message.header.stamp))


def message(number: int, stamp: float = 1.0) -> Any:
    return SimpleNamespace(number=number, header=SimpleNamespace(stamp=stamp))


def delivered(entry: dict[str, Any], times_s: np.ndarray) -> tuple[list[Any], Delivery, Outlet]:
    """What comes out of messages of psm1 sent at ``times_s``, the fault being there from 0.1 s."""
    menu, out = Menu([fault_of({**entry, "start_s": 0.1})]), Outlet()
    try:
        delivery = Delivery(menu, np.random.default_rng(0), 100.0)
    except RosMissing as error:
        pytest.skip(str(error))
    for number, now_s in enumerate(times_s):
        menu.turns(now_s)
        delivery.deliver("psm1", out, message(number), now_s)
        delivery.flush(now_s)
    return out.sent, delivery, out


TIMES_S = 0.01 * np.arange(100)


def test_late_messages_keep_their_order_and_come_late():
    sent, delivery, out = delivered({"fault": "delayed", "what": "psm1"}, TIMES_S)
    assert [number for number, _ in sent] == [*range(10), *range(10, 75)]
    delivery.flush(2.0)
    assert [number for number, _ in out.sent] == list(range(100))


def test_some_messages_get_lost_and_others_come_twice():
    sent, *_ = delivered({"fault": "lost", "what": "psm1", "probability": 0.5}, TIMES_S)
    assert 40 < len(sent) < 70
    sent, *_ = delivered({"fault": "duplicated", "what": "psm1"}, TIMES_S)
    assert [number for number, _ in sent][:12] == [*range(10), 10, 10]
    assert len(sent) == 190


def test_stamps_stand_still_or_run_backwards():
    sent, *_ = delivered({"fault": "stale_stamps", "what": "psm1"}, TIMES_S)
    told = {stamp.to_sec() for number, stamp in sent if number >= 10}
    assert list(told) == pytest.approx([100.1])
    sent, *_ = delivered({"fault": "backward_stamps", "what": "psm1"}, TIMES_S)
    backwards = np.diff([stamp.to_sec() for number, stamp in sent if number >= 10])
    assert backwards == pytest.approx(-0.01, abs=1e-6)


def test_the_messages_of_others_pass():
    sent, *_ = delivered({"fault": "lost", "what": "cloud", "probability": 1.0}, TIMES_S)
    assert len(sent) == 100
    assert all(stamp == 1.0 for _, stamp in sent)


def test_a_menu_tells_what_begins_and_what_ends():
    menu = Menu([fault_of({"fault": "paused", "arm": "psm1", "start_s": 1, "duration_s": 2})])
    assert menu.turns(0.5) == []
    begun = menu.turns(1.0)
    assert [turn.begins for turn in begun] == [True]
    assert len(menu.there(ArmStops)) == 1
    menu.order(fault_of({"fault": "delayed", "what": "cloud"}), 1.5)
    assert [turn.fault for turn in menu.turns(1.5)] == menu.there(Delayed)
    assert [turn.begins for turn in menu.turns(3.0)] == [False]
    assert menu.there(ArmStops) == []


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"fault": "pausd", "arm": "psm1"}, "paused"),
        ({"fault": "paused"}, "arm"),
        ({"fault": "delayed", "what": "psm1", "delay_s": -1}, "greater than 0"),
        ({"fault": "frozen", "start": 1}, "start"),
        ("frozen", "there is no fault"),
    ],
)
def test_what_is_no_fault_is_refused_with_what_would_be(entry, said):
    with pytest.raises(ValueError, match=said):
        fault_of(entry)


def test_faults_of_a_file_are_found_by_line(tmp_path):
    file = tmp_path / "faults.yaml"
    file.write_text("faults:\n  - {fault: frozen, start_s: 1}\n  - {fault: thawed}\n")
    with pytest.raises(InvalidFile, match=r"faults.yaml:3:\d+: .*thawed"):
        read_faults(file)
    file.write_text("faults:\n  - {fault: frozen, start_s: 1}\n")
    assert read_faults(file)[0].start_s == 1.0
