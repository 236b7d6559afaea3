from __future__ import annotations

import socket
import subprocess
import time
from pathlib import Path

import pytest

from defras_bt.recording.timeline import TimelineRecorder
from defras_bt.recording.viewer import (
    ViewerMissing,
    screenshot,
    timeline_of,
    viewer_command,
    viewer_process,
)
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


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads the system's table of ports")
def test_only_this_machine_can_reach_the_viewer(tmp_path: Path, short_run: SyntheticRun) -> None:
    TimelineRecorder(tmp_path / "run.rrd").start(short_run.info)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = viewer_command(tmp_path / "run.rrd", "--headless", "--port", str(port))
    with viewer_process(command, subprocess.DEVNULL):
        for _ in range(400):
            if addresses := _listening(port):
                break
            time.sleep(0.05)
        assert addresses == {"127.0.0.1"}
    for _ in range(100):
        if not _listening(port):
            return
        time.sleep(0.05)
    pytest.fail("the viewer outlives its block")


def _listening(port: int) -> set[str]:
    """Addresses on which anything listens at ``port``, as the kernel tells."""
    found = set()
    for table, family in (("tcp", socket.AF_INET), ("tcp6", socket.AF_INET6)):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            _, local, _, state, *_ = line.split()
            address, _, at = local.partition(":")
            if state == "0A" and int(at, 16) == port:
                # Words of four bytes, each in the byte order of the machine.
                packed = b"".join(
                    bytes.fromhex(address[i : i + 8])[::-1] for i in range(0, len(address), 8)
                )
                found.add(socket.inet_ntop(family, packed))
    return found
