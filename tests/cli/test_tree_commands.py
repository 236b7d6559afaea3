"""``defras tree``: what it prints, and its exit codes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from defras_bt.executive.proof.as_json import ProofJson
from defras_sim.resources import resource

Defras = Callable[..., tuple[int, str, str]]

UNSAFE = """\
name: unsafe
tree:
  sequence:
    children:
      - SensorsFresh
      - OperatorPermits
      - ForceAccepted
      - plan_slot: {name: act}
"""


@pytest.fixture
def unsafe(tmp_path: Path) -> str:
    file = tmp_path / "unsafe.yaml"
    file.write_text(UNSAFE)
    return str(file)


def test_show_draws_into_the_terminal_or_a_file(defras: Defras, tmp_path: Path) -> None:
    code, out, _ = defras("tree", "show", "let_go")
    assert code == 0
    assert out.splitlines()[:2] == ["⇉ let_go (reactive)", "├─ ◆ sensors_fresh"]
    file = tmp_path / "new" / "let_go.svg"
    code, out, _ = defras("tree", "show", "let_go", "--picture", str(file))
    assert code == 0
    assert file.read_text().startswith("<svg")
    code, _, err = defras("tree", "show", "let_go", "--picture", str(tmp_path / "tree.png"))
    assert (code, "give a file that ends with .svg" in err) == (2, True)


def test_check_refuses_what_prove_refutes_with_ticks(defras: Defras, unsafe: str) -> None:
    code, _, err = defras("tree", "check", unsafe)
    assert code == 2
    assert f"{unsafe}:8:9: plan_slot 'act' moves an arm and no guard stands before it" in err
    code, out, _ = defras("tree", "prove", unsafe)
    assert code == 2
    assert f"at fault: unsafe (sequence, {unsafe}:3:3): it does not look at unsafe/se" in out
    assert "These 2 ticks break it" in out
    assert "unsafe is not safe" in out


def test_prove_says_what_was_proved(defras: Defras) -> None:
    code, out, _ = defras("tree", "prove", "fras")
    assert code == 0
    assert "✓ guards_first: no motion leaf is ticked unless" in out
    assert "fras is safe: proved from every state, for plans of any length" in out
    code, out, _ = defras("tree", "prove", "fras", "--actions", "20")
    assert (code, "for a plan of 20 actions" in out) == (0, True)


def test_prove_answers_in_json(defras: Defras, unsafe: str) -> None:
    code, out, _ = defras("tree", "prove", unsafe, "--json")
    answer = ProofJson.model_validate_json(out)
    assert (code, answer.holds, answer.plan_length) == (2, False, None)
    refuted = {refutation.claim: refutation for refutation in answer.refuted}
    assert {claim.name for claim in answer.claims if not claim.holds} == set(refuted)
    at_fault = refuted["guards_first"].at_fault
    assert (at_fault.kind, at_fault.file, at_fault.line) == ("sequence", unsafe, 3)
    first, second = refuted["guards_first"].ticks
    assert first.nodes["unsafe/sensors_fresh"].shows == "SUCCESS"
    assert second.nodes["unsafe/sensors_fresh"].shows is None
    code, out, _ = defras("tree", "prove", "let_go", "--json", "--actions", "2")
    assert code == 0
    assert ProofJson.model_validate_json(out).plan_length == 2


def test_diff_calls_out_lost_guards(defras: Defras, tmp_path: Path) -> None:
    text = (resource("trees") / "let_go.yaml").read_text()
    other = tmp_path / "let_go.yaml"
    other.write_text(text)
    assert defras("tree", "diff", "let_go", str(other))[:2] == (
        0,
        f"let_go and {other} mean the same\n",
    )
    code, out, _ = defras("tree", "diff", "defras", "fras")
    assert code == 0
    assert out.startswith("! fras/operate/act: is no longer stopped in the same tick by")
    assert "3 guard(s) lost: see `defras tree prove fras`" in out
