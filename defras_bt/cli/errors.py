"""Errors in words and exit codes. A traceback is never what a user sees."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of every command."""

    GOAL = 0
    INTERNAL = 1
    INVALID = 2
    NOT_REACHED = 3
    HUMAN = 4


OUTCOME_CODES = {
    "goal": ExitCode.GOAL,
    "not_reached": ExitCode.NOT_REACHED,
    "human": ExitCode.HUMAN,
    "error": ExitCode.INTERNAL,
}


class UserError(Exception):
    """Something the user can mend; the message says what would be valid."""
