"""Leaves about ports."""

from __future__ import annotations

from typing import ClassVar

from py_trees.common import Status

from defras_bt.executive.node import Node, Role
from defras_bt.executive.ports import Asks
from defras_bt.executive.reasons import ReasonCode
from defras_bt.executive.registry import register_node


class PortCode(ReasonCode):
    """The codes of leaves about ports."""

    HAS_VALUE = "has_value", "something was written under the key"
    NO_VALUE = "no_value", "nothing was written under the key yet", "wait"


@register_node
class HasValue(Node):
    """Succeeds once something was written under the key of its port."""

    role: ClassVar[Role] = "guard"
    port = Asks("Key that is asked about.")

    def update(self) -> Status:
        key = self.keys["port"]
        if self.port:
            return self.succeed(PortCode.HAS_VALUE, f"{key} has a value")
        return self.fail(PortCode.NO_VALUE, f"{key} has no value yet")
