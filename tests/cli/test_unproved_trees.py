"""``defras run`` does not run a tree whose guards do not stop every motion in time."""

from __future__ import annotations

from pathlib import Path

from defras_sim.resources import resource


def test_a_tree_that_shrugs_off_a_guard_is_not_run(defras, tmp_path: Path) -> None:
    shipped = resource("trees/defras.yaml").read_text()
    guard = "- WarningBelow: {state: 2}"
    assert guard in shipped
    ignored = "- ignore_failure: {name: shrug, child: {WarningBelow: {state: 2}}}"
    for part in resource("trees").glob("*.yaml"):
        (tmp_path / part.name).write_text(part.read_text())
    tree = tmp_path / "mine.yaml"
    tree.write_text(shipped.replace(guard, ignored))
    code, out, _ = defras("tree", "check", str(tree))
    assert code == 0, "its guards stand where they should"
    said = " ".join(out.split())
    assert "valid" not in said
    assert f"not looked at: see `defras tree prove {tree}`" in said
    code, _, err = defras("run", "demo", "--tree", str(tree), "--out", str(tmp_path / "out"))
    assert code == 2
    assert "not run, because it is not proved that " in err
    assert "under warning state 2 nothing moves" in " ".join(err.split())
    assert not (tmp_path / "out").exists()
