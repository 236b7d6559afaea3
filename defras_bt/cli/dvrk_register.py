"""``defras dvrk register``: find out where arms and cameras stand."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from time import sleep
from typing import Annotated, get_args

import numpy as np
import typer
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene
from defras_bt.diagnosis.extended_scene import extended_name
from defras_bt.dvrk.crtk.arm import CrtkArm, NotFresh
from defras_bt.dvrk.registering.adoption import NothingToAdopt, adopted, without_adopted
from defras_bt.dvrk.registering.landmarks import (
    Landmark,
    read_landmarks,
    usual_landmarks,
    write_landmarks,
)
from defras_bt.dvrk.registering.registration import (
    CameraName,
    Placed,
    Registration,
    read_registration,
    write_registration,
)
from defras_bt.dvrk.registering.rigid_fit import NotRegistered, RigidFit, rigid_fit
from defras_bt.dvrk.registering.touching import NotStill, touched_m
from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.settings import Setup, load_setup
from defras_bt.dvrk.transport.connect import connect
from defras_bt.dvrk.transport.transport import ConnectionFailed
from defras_bt.recording.whole_file import write_whole
from defras_sim.scene import Scene
from defras_sim.scene_file import write_scene
from defras_sim.scene_parts import ArmName

_ARMS: tuple[ArmName, ...] = get_args(ArmName)
_CAMERAS: tuple[CameraName, ...] = get_args(CameraName)
_CONNECT_S = 2.0


def register(
    what: Annotated[
        str, typer.Argument(help="psm1, psm2, depth or endoscope; or adopt, with --found.")
    ],
    scene: Annotated[str, typer.Argument(help="Scene as believed: a file, or a shipped name.")],
    setup: Annotated[Path, typer.Option(help="Set-up file of the laboratory.")],
    points: Annotated[
        Path | None,
        typer.Option(help="CSV of landmarks that were touched or seen; default: touch them now."),
    ] = None,
    found: Annotated[
        Path | None,
        typer.Option(
            help="Scene extended by a diagnosis, whose tool_offset and "
            "camera_registration become part of the registration."
        ),
    ] = None,
) -> None:
    """Register an arm or a camera to the tissue by landmarks, or adopt what a diagnosis found.

    Without --points an arm is registered by hand: bring its closed jaw to each landmark that is
    named and press Enter. With --points the file has the columns name, tissue_x_m, tissue_y_m,
    tissue_z_m, x_m, y_m, z_m, the last three of the tip in the arm's frame or of the landmark in
    the camera's. The registration file (registration: in the set-up) is rewritten with residuals
    and date. Exit code: 0 written, 2 invalid input.

    Example: defras dvrk register psm1 demo --setup lab/dvrk.yaml
    """
    console = Console(soft_wrap=True, highlight=False)
    believed = find_scene(scene)[1]
    laboratory = load_setup(setup)
    now = datetime.now(UTC).replace(microsecond=0)
    if what == "adopt":
        _adopt(console, laboratory, believed, found, now)
        return
    if what not in (*_ARMS, *_CAMERAS):
        raise UserError(f"{what}: valid are {', '.join((*_ARMS, *_CAMERAS, 'adopt'))}")
    if points is not None:
        landmarks = read_landmarks(points)
    elif what in _ARMS:
        landmarks = _touched(console, laboratory, believed, what)
        kept = laboratory.registration.with_name(f"landmarks_{what}.csv")
        write_landmarks(landmarks, kept)
        console.print(f"Landmarks kept in {kept}", markup=False)
    else:
        raise UserError(
            f"register {what}: give --points with the landmarks as the camera saw them (defras "
            "dvrk cameras shows pictures to read them from)"
        )
    try:
        fit = rigid_fit(
            np.array([one.tissue_m for one in landmarks]).reshape(-1, 3),
            np.array([one.found_m for one in landmarks]).reshape(-1, 3),
        )
    except NotRegistered as error:
        raise UserError(f"register {what}: {error}") from error
    _tell(console, laboratory, landmarks, fit)
    placed = Placed.of(fit.parent_from_child, fit)
    registration = _known(console, laboratory, believed, now)
    for arm in (name for name in _ARMS if name == what):
        registration = registration.with_arm(arm, placed, now)
    for camera in (name for name in _CAMERAS if name == what):
        registration = registration.with_camera(camera, placed, now)
    write_registration(registration, laboratory.registration)
    console.print(
        f"Written to {laboratory.registration}; check again before you run.", markup=False
    )


def _known(console: Console, setup: Setup, scene: Scene, now: datetime) -> Registration:
    """What is registered already, if that was for this scene; otherwise it is kept aside."""
    file = setup.registration
    if not file.is_file():
        return Registration(measured=now, scene=scene.name)
    known = read_registration(file)
    if known.scene == scene.name:
        return known
    # Cameras may have stayed where they are, but the tissue has not: nothing of it holds.
    kept = file.with_name(f"{file.stem}_{known.measured:%Y%m%dT%H%M%S}{file.suffix}")
    write_whole(kept, file.read_text(encoding="utf-8"))
    gone = ", ".join((*known.arms, *known.cameras)) or "nothing"
    console.print(
        f"{file} was measured for the scene {known.scene!r}: what it says ({gone}) does not hold "
        f"for {scene.name!r}, and has to be registered anew. It is kept in {kept}",
        style="bold yellow",
        markup=False,
    )
    return Registration(measured=now, scene=scene.name)


def _touched(console: Console, setup: Setup, scene: Scene, arm_key: str) -> list[Landmark]:
    """Have every landmark touched by hand."""
    if not sys.stdin.isatty():
        raise UserError(f"register {arm_key}: nobody can be asked here; give --points")
    arms = {str(name): arm for name, arm in setup.arms.items()}
    if arm_key not in arms:
        raise UserError(f"register {arm_key}: the set-up has only {', '.join(arms)}")
    try:
        transport = connect(setup, "defras_register")
    except (RosMissing, ConnectionFailed) as error:
        raise UserError(str(error)) from error
    try:
        arm = CrtkArm(arms[arm_key], transport)
        sleep(_CONNECT_S)
        landmarks = []
        for name, tissue_m in usual_landmarks(scene).items():
            while True:
                place = ", ".join(f"{value * 1e3:.0f}" for value in tissue_m)
                typer.prompt(
                    f"Touch {name} at ({place}) mm with {arm.name}'s closed jaw, and press Enter",
                    default="",
                    show_default=False,
                )
                try:
                    landmarks.append(Landmark(name, tissue_m, touched_m(arm)))
                    break
                except (NotStill, NotFresh) as again:
                    console.print(f"{again}. Once more.", style="yellow", markup=False)
        return landmarks
    finally:
        transport.close()


def _tell(console: Console, setup: Setup, landmarks: list[Landmark], fit: RigidFit) -> None:
    """Every residual, and a warning where they are too large."""
    for one, missed_m, new_m in zip(landmarks, fit.residuals_m, fit.left_out_m, strict=True):
        console.print(
            f"{one.name}: {missed_m * 1e3:.2f} mm off; {new_m * 1e3:.2f} mm if it had not been "
            "used",
            markup=False,
        )
    limit_m = setup.limits.residual_m
    console.print(
        f"{len(landmarks)} landmarks, {fit.rms_m * 1e3:.2f} mm off on average, a new one "
        f"{fit.worst_left_out_m * 1e3:.2f} mm at worst.",
        markup=False,
    )
    if fit.rms_m > limit_m or fit.worst_left_out_m > 2.0 * limit_m:
        console.print(
            f"This is too much: above {limit_m * 1e3:g} mm on average the check fails, above "
            f"{2e3 * limit_m:g} mm for a new one it warns. Touch or see the worst ones again.",
            style="bold yellow",
        )


def _adopt(console: Console, setup: Setup, scene: Scene, found: Path | None, now: datetime) -> None:
    if found is None:
        raise UserError("register adopt: give --found with the scene that a diagnosis extended")
    extended = find_scene(str(found))[1]
    if not setup.registration.is_file():
        raise UserError(f"{setup.registration} does not exist: register arms and cameras first")
    known = read_registration(setup.registration)
    if known.scene != scene.name:
        raise UserError(
            f"register adopt: {setup.registration} was measured for the scene {known.scene!r}, not "
            f"for {scene.name!r}; nothing was changed"
        )
    if extended.name not in (scene.name, extended_name(scene)):
        raise UserError(
            f"register adopt: {found} is the scene {extended.name!r}, not {extended_name(scene)!r} "
            "as a diagnosis of it writes; nothing was changed"
        )
    try:
        registration = adopted(known, extended, now)
    except NothingToAdopt as error:
        raise UserError(f"--found {found}: {error}") from error
    rest = found.with_name(f"{found.stem}_registered.yaml")
    # Registrations are of a patient by name, and this is the one that was registered.
    write_scene(without_adopted(extended).model_copy(update={"name": scene.name}), rest)
    write_registration(registration, setup.registration)
    console.print(
        f"Written to {setup.registration}; go on with {rest}, which has the rest of what was "
        "found. Check again before you run.",
        markup=False,
    )
