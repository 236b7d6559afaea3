"""The operator at the terminal in which a run goes on: keys and questions."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.keyboard import HELP, act_of, listening
from defras_bt.executive.operator_desk import DeskNotice, OperatorDesk
from defras_bt.executive.operator_socket import serve
from defras_bt.recording.operator_state import Act


@contextmanager
def at_the_desk(
    desk: OperatorDesk, console: Console, out: Path | None, asks: bool
) -> Iterator[None]:
    """While the block runs, the operator speaks by keys and over the socket of ``out``.

    Without a terminal lines of the input are read only where plans need approval (``asks``).

    Raises:
        UserError: another run is under way in ``out``.
    """
    elsewhere = f"defras operator {out} approve" if out is not None else ""
    by_keys = sys.stdin is not None and sys.stdin.isatty()
    terminal = _Terminal(desk, console, elsewhere, piped=not by_keys)
    with ExitStack() as stack:
        if out is not None:
            try:
                stack.enter_context(serve(desk, out))
            except ConnectionError as error:
                raise UserError(str(error)) from error
        stack.callback(desk.listen(terminal.show))
        if by_keys:
            console.print(f"Keys: {HELP}.", style="dim", markup=False)
        if by_keys or asks:
            stack.enter_context(listening(terminal.typed, terminal.ended))
        yield


class _Terminal:
    """Shows what waits for the operator, and passes on what is typed.

    ``elsewhere`` says how else a plan can be answered; "" where it cannot. Lines that are ``piped``
    in may come before what they answer. A key may not: one that bounces would approve a plan that
    nobody has read.
    """

    def __init__(
        self, desk: OperatorDesk, console: Console, elsewhere: str, *, piped: bool = False
    ) -> None:
        self._desk = desk
        self._console = console
        self._elsewhere = elsewhere
        self._piped = piped
        self._shown = 0
        self._early: list[Act] = []
        self._ended = False

    def show(self, notice: DeskNotice) -> None:
        """Print the plan that waits for approval, once."""
        if not notice.question or notice.plan_number == self._shown:
            return
        self._shown = notice.plan_number
        self._console.print(notice.question, markup=False)
        self._console.print("Carry out this plan? y approve, n refuse", style="bold")
        if self._early:
            self._answer(self._early.pop(0))
        elif self._ended:
            self._nobody_answers()

    def typed(self, text: str) -> None:
        """A key or a line."""
        act = act_of(text)
        early = act in (Act.APPROVE, Act.REFUSE) and not self._desk.notice().question
        if act is None:
            self._console.print(f"{text.strip()!r} is no key. Keys: {HELP}.", markup=False)
        elif early and self._piped:
            self._early.append(act)
        else:
            self._answer(act)

    def ended(self) -> None:
        """There is no more input."""
        self._ended = True
        if self._desk.notice().question:
            self._nobody_answers()

    def _answer(self, act: Act) -> None:
        read = self._shown if act in (Act.APPROVE, Act.REFUSE) else None
        answer = self._desk.request(act, "keyboard", plan_number=read)
        if not answer.accepted:
            self._console.print(answer.sentence, style="yellow", markup=False)

    def _nobody_answers(self) -> None:
        """No answer is no approval; but somebody elsewhere may give one."""
        if self._elsewhere:
            self._console.print(f"Waiting for: {self._elsewhere}", markup=False)
        else:
            self._desk.request(Act.REFUSE, "end of input", "nobody answered")
