"""Operating state of an arm: DISABLED, ENABLED, PAUSED, FAULT; homed; busy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from defras_bt.dvrk.stand_in.refusal import Refused

DISABLED, ENABLED, PAUSED, FAULT = "DISABLED", "ENABLED", "PAUSED", "FAULT"

_TRANSITIONS: Mapping[str, Mapping[str, str]] = {
    "enable": {DISABLED: ENABLED, FAULT: ENABLED, ENABLED: ENABLED},
    "disable": {DISABLED: DISABLED, ENABLED: DISABLED, PAUSED: DISABLED, FAULT: DISABLED},
    "pause": {ENABLED: PAUSED, PAUSED: PAUSED},
    "resume": {PAUSED: ENABLED, ENABLED: ENABLED},
    "home": {ENABLED: ENABLED, DISABLED: ENABLED},
    "unhome": {DISABLED: DISABLED, ENABLED: ENABLED, PAUSED: PAUSED, FAULT: FAULT},
}
"""Where each ``state_command`` leads from each state."""


@dataclass(frozen=True)
class Operating:
    """What ``operating_state`` tells, but for the stamp."""

    state: str = ENABLED
    is_homed: bool = True
    is_busy: bool = False

    @property
    def may_move(self) -> bool:
        return self.state == ENABLED and self.is_homed

    def require_motion(self, command: str) -> None:
        """See that the arm may move.

        Raises:
            Refused: it may not.
        """
        if not self.may_move:
            homed = "homed" if self.is_homed else "not homed"
            raise Refused(f"{command} refused: the arm is {self.state} and {homed}")

    def after(self, command: str) -> Operating:
        """The state after a ``state_command``.

        Raises:
            Refused: there is no such command, or it leads nowhere from here.
        """
        if command not in _TRANSITIONS:
            raise Refused(
                f"state_command {command!r} is unknown; valid are {', '.join(_TRANSITIONS)}"
            )
        following = _TRANSITIONS[command].get(self.state)
        if following is None:
            raise Refused(f"state_command {command!r} is refused while {self.state}")
        homed = {"home": True, "unhome": False}.get(command, self.is_homed)
        return replace(self, state=following, is_homed=homed)
