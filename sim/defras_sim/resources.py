"""Where trees, ASP programs, scenes and robots lie: in the installed package or in a checkout."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def resource(relative: str) -> Path:
    """Path of a shipped file or folder, for example ``resource("sim/scenes/demo.yaml")``.

    Raises:
        FileNotFoundError: neither the installed data nor the checkout holds it.
    """
    for root in (_PACKAGE / "_data", _PACKAGE.parent.parent):
        if (root / relative).exists():
            return root / relative
    raise FileNotFoundError(f"{relative} is shipped with defras but was not found; reinstall it")
