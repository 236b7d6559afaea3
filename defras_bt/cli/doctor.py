"""``defras doctor``: what is installed, what is missing, and how to get it."""

from __future__ import annotations

import ctypes.util
import importlib
import importlib.metadata
import os
import re
import shutil
import sys
from dataclasses import dataclass

import typer
from rich.console import Console
from rich.table import Table

from defras_bt.cli.errors import ExitCode
from defras_bt.dvrk.ros_packages import INSTALL_LINE, RosMissing, ros_module
from defras_sim.resources import resource
from defras_sim.worlds.native_output import STDERR, without_native_output


@dataclass(frozen=True)
class Finding:
    """One thing that was looked for. ``remedy`` says how to get it; needed or merely useful."""

    what: str
    found: str | None
    needed: bool
    remedy: str


IMPORT_NAMES = {
    "pillow": "PIL",
    "py-trees": "py_trees",
    "rerun-sdk": "rerun",
    "ruamel-yaml": "ruamel.yaml",
}


def doctor() -> None:
    """Say what is installed, what is missing, and how to get it. Example: defras doctor"""
    findings = [*_python(), *_packages(), *_data(), *_viewer(), _ros()]
    table = Table("", "what", "found", "how to get it", title="defras doctor")
    for finding in findings:
        mark = "ok" if finding.found else ("MISSING" if finding.needed else "absent")
        colour = "green" if finding.found else ("red" if finding.needed else "yellow")
        remedy = "" if finding.found else finding.remedy
        table.add_row(f"[{colour}]{mark}[/]", finding.what, finding.found or "-", remedy)
    Console().print(table)
    missing = [finding.what for finding in findings if finding.needed and not finding.found]
    if missing:
        typer.echo(f"Missing and needed: {', '.join(missing)}", err=True)
        raise typer.Exit(ExitCode.INVALID)
    typer.echo("Everything that is needed is here.")


def _python() -> list[Finding]:
    version = ".".join(map(str, sys.version_info[:3]))
    fits = sys.version_info[:2] >= (3, 11)
    cores = f"{len(os.sched_getaffinity(0))} cores"
    return [
        Finding("Python 3.11 or newer", version if fits else None, True, "install Python 3.11"),
        Finding("processor", cores, True, ""),
    ]


def _packages() -> list[Finding]:
    findings = []
    for requirement in importlib.metadata.requires("defras") or []:
        if "extra ==" in requirement:
            continue
        name = re.split(r"[<>=!~;\[ ]", requirement, maxsplit=1)[0]
        name = re.sub(r"[-_.]+", "-", name).lower()  # installers may write it either way
        remedy = f"pip install -c constraints.txt '{requirement}'"
        findings.append(Finding(f"package {name}", _importable(name), True, remedy))
    return findings


def _importable(name: str) -> str | None:
    """Version of a package that can really be imported, not only found."""
    try:
        with without_native_output(STDERR):
            importlib.import_module(IMPORT_NAMES.get(name, name.replace("-", "_")))
        return importlib.metadata.version(name)
    except (ImportError, OSError):
        return None


def _data() -> list[Finding]:
    findings = []
    for folder in ("trees", "asp", "sim/scenes", "sim/robots", "sim/faults"):
        try:
            count = sum(1 for _ in resource(folder).iterdir())
            found: str | None = f"{count} files"
        except FileNotFoundError:
            found = None
        findings.append(Finding(folder, found, True, "install defras again"))
    return findings


def _ros() -> Finding:
    try:
        place = ros_module("rospy").__file__
    except RosMissing:
        place = None
    return Finding("ROS 1 (--world dvrk and its stand-in)", place, False, INSTALL_LINE)


def _viewer() -> list[Finding]:
    apt = "apt-get install"
    return [
        Finding("rerun viewer", _importable("rerun-sdk"), False, "pip install rerun-sdk"),
        Finding(
            "Vulkan (pictures of timelines without a screen)",
            ctypes.util.find_library("vulkan"),
            False,
            f"{apt} libvulkan1 mesa-vulkan-drivers",
        ),
        Finding(
            "Chromium (pictures of reports)", shutil.which("chromium"), False, f"{apt} chromium"
        ),
    ]
