from __future__ import annotations

from pathlib import Path

import pytest

from defras_bt.recording.timeline import TimelineRecorder
from defras_bt.recording.viewer import ViewerMissing, screenshot, timeline_of
from tests.recording.synthetic_run import SyntheticRun


def test_a_run_is_a_folder_or_its_timeline(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"run\.rrd does not exist; give a folder"):
        timeline_of(tmp_path)
    (tmp_path / "run.rrd").touch()
    assert timeline_of(tmp_path) == timeline_of(tmp_path / "run.rrd") == tmp_path / "run.rrd"


def test_missing_vulkan_says_what_to_install(
    tmp_path: Path, short_run: SyntheticRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = TimelineRecorder(tmp_path / "run.rrd")
    recorder.start(short_run.info)
    recorder.tick(short_run.ticks()[0])
    # No driver at all, whatever this machine has.
    monkeypatch.setenv("VK_DRIVER_FILES", str(tmp_path / "none.json"))
    monkeypatch.setenv("WGPU_BACKEND", "vulkan")
    with pytest.raises(ViewerMissing, match="apt-get install mesa-vulkan-drivers libvulkan1"):
        screenshot(tmp_path, tmp_path / "shot.png")
    assert not (tmp_path / "shot.png").exists()
