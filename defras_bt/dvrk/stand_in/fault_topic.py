"""Faults on order: a topic on which each of the stand-in's nodes takes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.faults import fault_of
from defras_bt.dvrk.stand_in.menu import Menu

FAULT_TOPIC = "/defras_stand_in/fault"
"""std_msgs/String with one entry of a fault file, as ``{fault: paused, arm: psm1}``; ``start_s``
counts from its arrival."""


def take_orders(
    rospy: Any, menu: Menu, now_s: Callable[[], float], refuse: Callable[[str], None]
) -> Any:
    """Order on ``menu`` what comes in; ``refuse`` is told of what is no fault."""

    def order(message: Any) -> None:
        try:
            menu.order(fault_of(YAML(typ="safe", pure=True).load(message.data)), now_s())
        except (ValueError, YAMLError) as error:
            refuse(f"on {FAULT_TOPIC}: {error}")

    return rospy.Subscriber(FAULT_TOPIC, ros_module("std_msgs.msg").String, order)
