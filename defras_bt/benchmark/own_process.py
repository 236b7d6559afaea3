"""A function in a process of its own: a process can join only one ROS master in its life."""

from __future__ import annotations

import multiprocessing
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

Result = TypeVar("Result")


class ProcessFailed(RuntimeError):
    """The process gave no result; the message says why."""


def in_own_process(function: Callable[..., Result], *arguments: Any, within_s: float) -> Result:
    """``function(*arguments)``, computed in a new process that may start others.

    Raises:
        ProcessFailed: it raised, ended without a result, or took longer than ``within_s``.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_call, args=(theirs, function, arguments))
    process.start()
    theirs.close()
    try:
        if not ours.poll(within_s):
            raise ProcessFailed(f"{function.__name__} took longer than {within_s:g} s")
        try:
            failed, result = ours.recv()
        except EOFError as error:
            raise ProcessFailed(f"{function.__name__} ended without a result") from error
    finally:
        process.join(10.0)
        if process.is_alive():
            process.kill()
            process.join()
        ours.close()
    if failed:
        raise ProcessFailed(str(result))
    answer: Result = result
    return answer


def _call(line: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    try:
        result = (False, function(*arguments))
    except Exception:  # noqa: BLE001  (whatever it is, the process that asked shall say it)
        result = (True, traceback.format_exc())
    line.send(result)
    line.close()
