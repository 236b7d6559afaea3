from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import pytest

from defras_bt.recording.record import Event
from defras_bt.recording.report import ReportRecorder
from defras_bt.recording.run_file import Outcome
from defras_bt.recording.summary import SummaryRecorder
from tests.recording.synthetic_run import SyntheticRun

VOID = {"meta", "img", "br", "link", "input", "hr"}


class Nesting(HTMLParser):
    """Checks that every element is closed where it was opened."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def page(run: SyntheticRun, path: Path, outcome: Outcome = "goal", ticks: int | None = None) -> str:
    numbers, report = SummaryRecorder(), ReportRecorder(path)
    for recorder in (numbers, report):
        recorder.start(run.info)
        for record in run.ticks()[:ticks]:
            recorder.tick(record)
    report.finish(numbers.summary(outcome, wall_s=2.0))
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def rich_page(tmp_path_factory: pytest.TempPathFactory, rich_run: SyntheticRun) -> str:
    return page(rich_run, tmp_path_factory.mktemp("report") / "report.html")


def test_the_story_is_told(rich_page: str, rich_run: SyntheticRun) -> None:
    said = unescape(rich_page)
    assert "<h1>Goal reached</h1>" in said
    assert "94 % of the region is visible after 9 actions." in said
    for record in rich_run.ticks():
        for event in record.events:
            assert event.sentence in said
    assert "PSM1 folds the tissue away from the endoscope, held at (1,4)." in said
    assert "planned anew once" in said


def test_it_stands_on_its_own(rich_page: str) -> None:
    addresses = re.findall(r"""(?:src|href)=["']([^"']*)""", rich_page)
    assert all(address.startswith(("data:", "#")) for address in addresses)
    assert "url(http" not in rich_page
    assert "<script" not in rich_page
    assert len(rich_page) < 2e6


def test_the_page_is_well_formed(rich_page: str) -> None:
    nesting = Nesting()
    nesting.feed(rich_page)
    assert nesting.open == []


def test_plots_and_pictures_are_there(rich_page: str) -> None:
    svgs = re.findall(r"<svg.*?</svg>", rich_page, re.DOTALL)
    assert len(svgs) == 2
    words = ("delta1", "epsilon", "local (the tree acts on it)", "median", "true", "pull", "goal")
    assert all(f">{word}<" in svgs[0] for word in words)
    assert all(word in svgs[1] for word in ("Believed before", "from 5.6 s", "Actual"))
    assert rich_page.count("data:image/png") == 7


def test_a_world_without_truth_or_pictures(tmp_path: Path, short_run: SyntheticRun) -> None:
    run = replace(short_run, with_truth=False, duration_s=6.0)
    said = page(run, tmp_path / "report.html", "not_reached")
    assert "Goal not reached" in said
    assert "as simulated" in said
    assert "from the endoscope (drawn)" in said
    assert "<dt>Actual</dt><dd>unknown</dd>" in said
    assert "believed to hold, but does not" not in said


def test_a_run_that_failed_before_its_first_tick(tmp_path: Path, short_run: SyntheticRun) -> None:
    said = page(short_run, tmp_path / "report.html", "error", ticks=0)
    assert "Stopped by an error" in said
    assert "The run ended before anything happened." in said
    assert "an unknown share of the region is visible after 0 actions." in said


def test_what_events_say_is_text_and_not_markup(tmp_path: Path, short_run: SyntheticRun) -> None:
    event = Event(0.0, "error", "error", "x < 3 & <b>bold</b>")
    record = replace(short_run.ticks()[0], events=(event,), true_surface=None, twin=None)
    numbers, report = SummaryRecorder(), ReportRecorder(tmp_path / "report.html")
    for recorder in (numbers, report):
        recorder.start(short_run.info)
        recorder.tick(record)
    report.finish(numbers.summary("error", wall_s=0.0))
    assert "x &lt; 3 &amp; &lt;b&gt;bold&lt;/b&gt;" in (tmp_path / "report.html").read_text()
