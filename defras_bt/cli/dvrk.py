"""``defras dvrk``: everything about a da Vinci Research Kit but operating on it."""

from __future__ import annotations

import typer

from defras_bt.cli.dvrk_cameras import app as cameras
from defras_bt.cli.dvrk_check import check
from defras_bt.cli.dvrk_record import record, topics
from defras_bt.cli.dvrk_register import register
from defras_bt.cli.dvrk_simulate import simulate

app = typer.Typer(
    no_args_is_help=True,
    help="The da Vinci Research Kit: set-up, registration, check, and a stand-in for it.",
)
app.command("register")(register)
app.command("check")(check)
app.command("simulate")(simulate)
app.command("record")(record)
app.command("topics")(topics)
app.add_typer(cameras, name="cameras")
