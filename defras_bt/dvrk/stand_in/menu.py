"""The faults of a stand-in over time: which begin, which are there, which end."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from threading import Lock
from typing import TypeVar

from defras_bt.dvrk.stand_in.faults import StandInFault

AnyKind = TypeVar("AnyKind", bound=StandInFault)


@dataclass(frozen=True)
class Turn:
    """A fault that begins or ends now."""

    fault: StandInFault
    begins: bool


class Menu:
    """Faults in order of time; more can be ordered from any thread."""

    def __init__(self, faults: Iterable[StandInFault] = ()) -> None:
        self._lock = Lock()
        self._faults = list(faults)
        self._there: list[StandInFault] = []

    def order(self, fault: StandInFault, now_s: float) -> None:
        """Add a fault whose start counts from ``now_s``."""
        later = fault.model_copy(update={"start_s": now_s + fault.start_s})
        with self._lock:
            self._faults.append(later)

    def turns(self, now_s: float) -> list[Turn]:
        """What begins and what ends since the last call."""
        with self._lock:
            there = [fault for fault in self._faults if fault.active(now_s)]
        ended = [Turn(fault, False) for fault in self._there if fault not in there]
        begun = [Turn(fault, True) for fault in there if fault not in self._there]
        self._there = there
        return ended + begun

    def there(self, kind: type[AnyKind]) -> list[AnyKind]:
        """The faults of one kind that are there, as of the last :meth:`turns`."""
        return [fault for fault in self._there if isinstance(fault, kind)]
