"""The page of a diagnosis: everything a person needs to judge it, in one file."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.exhibits import Exhibits
from defras_bt.diagnosis.report import report_html
from defras_bt.diagnosis.verdict import Gain
from defras_sim.effects.library import effects
from tests.diagnosis.synthetic_diagnosis import (
    ORIGIN,
    named_verdict,
    synthetic_curves,
    synthetic_diagnosis,
    synthetic_replay,
    synthetic_scene,
)

EFFECTS = {effect.name: effect for effect in effects()}


class WellFormed(HTMLParser):
    """Checks that every element is closed where it was opened."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in {"meta", "img", "br"}:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def page(diagnosis: Diagnosis, **more: Any) -> str:
    return report_html(diagnosis, ORIGIN, EFFECTS, **more)


@pytest.fixture(scope="module")
def rich_page() -> str:
    exhibits = Exhibits(synthetic_curves().comparisons, synthetic_replay().replay)
    return page(synthetic_diagnosis(), scene=synthetic_scene(), exhibits=exhibits)


def test_it_tells_verdict_causes_gain_and_doubts(rich_page: str) -> None:
    said = " ".join(unescape(rich_page).split())
    for words in (
        "<h1>The cause is named</h1>",
        "stress relaxation: fraction 0.35, time 2 s",
        "0.31 to 0.38",
        EFFECTS["stress_relaxation"].falsified_by,
        "<b>81 %</b>",
        "<b>66 %</b>",
        "these data cannot say",
        "do not trust it there",
        "zeros at 2.00 to 2.40 s; 3 rows left out",
        "grasp slip: distance of more than 1.1 mm",
        "they change nothing that was measured: gravity",
        "The force falls during holds.",
        "Measured</dt><dd>recording.mcap, second.mcap",
    ):
        assert words in said
    assert "Nothing lags." not in said, "it does not stand out"


def test_it_stands_on_its_own_and_is_well_formed(rich_page: str) -> None:
    addresses = re.findall(r"""(?:src|href)=["']([^"']*)""", rich_page)
    assert all(address.startswith(("data:", "#")) for address in addresses)
    assert "<script" not in rich_page
    checker = WellFormed()
    checker.feed(rich_page)
    assert checker.open == []
    assert len(rich_page) < 2e6


def test_pictures_show_every_phase_sensor_and_candidate(rich_page: str) -> None:
    maps, curves, over_time, ranking, confounding = re.findall(
        r"<svg.*?</svg>", rich_page, re.DOTALL
    )
    assert all(f">{phase}<" in maps for phase in ("rest", "pull", "hold", "fold"))
    assert all(f">{row}<" in maps for row in ("as it was", "extended"))
    assert ">pull 2<" in curves
    assert all(f">{name}<" in over_time for name in ("first pull", "second pull", "force x"))
    assert "cloud, rms" in over_time
    for drawn in (ranking, confounding):
        assert all(f">{name}<" in drawn for name in ("stress relaxation", "tool offset"))
    assert rich_page.count('<img src="data:image/png') == 2


def test_a_set_says_what_would_settle_it() -> None:
    verdict = replace(
        named_verdict(),
        verdict="set",
        causes=(),
        ambiguous=("stiffness", "stress_relaxation"),
        proposed_motion="pull psm1 at (1,4) by 30 mm and hold for 5 s",
    )
    said = unescape(page(synthetic_diagnosis(verdict)))
    assert "<h1>The cause is one of a few</h1>" in said
    assert "stiffness or stress relaxation" in said
    assert "stiffness and stress relaxation" in said
    assert "Proposed motion: pull psm1 at (1,4) by 30 mm and hold for 5 s" in said
    assert "What was found" not in said
    assert ">extended<" not in said, "nothing was extended"


def test_nothing_and_outside_have_their_own_pages() -> None:
    nothing = replace(
        named_verdict(), verdict="nothing", causes=(), gain=Gain(), unexplained_share=None
    )
    said = page(synthetic_diagnosis(nothing))
    assert "<h1>The simulation agrees</h1>" in said
    assert "What it is not" in said
    outside = replace(named_verdict(), verdict="outside", causes=(), unexplained_share=0.9)
    said = page(synthetic_diagnosis(outside))
    assert "<h1>No known cause explains it</h1>" in said
    assert "90 % of the error stays unexplained" in said


def test_what_explains_a_part_is_drawn_but_not_adopted() -> None:
    outside = replace(named_verdict(), verdict="outside", causes=(), unexplained_share=0.5)
    model = {"grasp_slip": {"distance_m": 0.01}}
    partly = replace(synthetic_diagnosis(outside), model=model, partial=("grasp_slip",))
    said = page(partly)
    assert "has in it what explains a part: grasp slip. Nothing of it is adopted." in said
    assert "extended simulation" in said


def test_a_loss_is_shown_as_one() -> None:
    lost = replace(named_verdict(), gain=Gain(in_range=0.4, beyond_range=-0.25))
    assert re.search(
        r'class="tile bad"><span>Beyond.*?<b>-25 %</b>', page(synthetic_diagnosis(lost))
    )


def test_what_was_interrupted_says_so_and_has_what_was_found() -> None:
    whole = synthetic_diagnosis()
    nan = np.full_like(whole.residual_before, np.nan)
    broken = replace(
        whole,
        complete=False,
        held_out_before=nan,
        held_out_after=nan,
        ranking=(),
        rounds=(),
        portrait=(),
    )
    said = page(broken, scene=synthetic_scene())
    assert "was interrupted" in said
    assert "Over time" not in said
