"""Finding the files that a command names."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryFile

from defras_bt.cli.errors import UserError
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene


def find(named: str, folder: str, suffix: str = ".yaml") -> Path:
    """A file as given, or the shipped one of that name in ``folder``: "demo" is enough.

    Raises:
        UserError: there is neither.
    """
    given = Path(named)
    if given.is_file():
        return given
    shipped = resource(folder)
    inside = shipped / (named if named.endswith(suffix) else f"{named}{suffix}")
    if given.name == named and inside.is_file():
        return inside
    names = ", ".join(sorted(p.stem for p in shipped.glob(f"*{suffix}")))
    raise UserError(f"there is no file {named}; shipped with defras are: {names}")


def folder_for(out: Path, option: str = "--out") -> Path:
    """Make the folder ``out`` where it is missing, and see that files can be written there.

    Raises:
        UserError: they cannot.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            return out
    except OSError as error:
        raise UserError(f"{option} {out}: {error}; give a folder that can be written to") from error


def require_folder(file: Path, option: str = "--out") -> None:
    """See that the folder which ``file`` is to be written to is there, and can be written to.

    Raises:
        UserError: it is not; which of the folders above it is missing is said.
    """
    folder = file.absolute().parent
    if not folder.exists():
        missing = next(p for p in (*reversed(folder.parents), folder) if not p.exists())
        raise UserError(f"{option} {file}: there is no folder {missing}; make it first")
    if file.is_dir():
        raise UserError(f"{option} {file}: is a folder; give the name of a file to write")
    folder_for(folder, option)


def find_scene(named: str) -> tuple[Path, Scene]:
    """The scene file called ``named`` and what it says.

    Raises:
        UserError: there is no such file.
        InvalidFile: it is not a scene.
    """
    file = find(named, "sim/scenes")
    return file, load_scene(file)
