"""``defras explain PLAN``: why each action is there, and why not another."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene
from defras_bt.cli.plan import tell
from defras_bt.planning.explanation import why_not_rehearsed
from defras_bt.planning.plan_file import InvalidPlanFile, StalePlanFile, load_plan, read_plan
from defras_bt.planning.preoperative import PreoperativeResult
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.advice import matter_of
from defras_sim.scene import Scene


def explain_plan(file: Path, scene: str | None, why_not: str | None, console: Console) -> None:
    """Print the plan in ``file`` with its reasons, or the answer to ``why_not``.

    Raises:
        UserError: no plan file, another scene, or a question that cannot be read.
    """
    try:
        result = read_plan(file)
        if why_not is None:
            tell(result, console)
            return
        asked = matter_of(why_not)
        believed = _scene_of(result, scene)
        load_plan(file, believed)
    except (InvalidPlanFile, StalePlanFile) as error:
        raise UserError(str(error)) from error
    except ValueError as error:
        raise UserError(f"--why-not {error}") from error
    console.print(why_not_rehearsed(believed, result, asked), markup=False)


def _scene_of(result: PreoperativeResult, named: str | None) -> Scene:
    """The scene the plan was made for, in the model world or in PyBullet."""
    _, believed = find_scene(named or result.scene)
    if believed.tissue.anatomy is not None:
        return believed
    bullet = believed.for_bullet()
    return bullet if scene_hash(bullet) == result.scene_hash else believed
