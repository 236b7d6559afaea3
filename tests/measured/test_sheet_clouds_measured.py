"""The calibration of cameras looks at clouds of real sheets, in their own scaled frame."""

from pathlib import Path

import numpy as np

from defras_bt.dvrk.camera_settings import Colours
from defras_bt.dvrk.cameras.calibration_data import read_views
from defras_bt.dvrk.cameras.calibration_pictures import draw_view
from defras_bt.sensing.cloud import decimate_m


def test_every_sheet_is_read_and_drawn(measured_data: Path, tmp_path):
    views = read_views(measured_data / "sheet_clouds" / "lift.npz", 2)
    assert {view.source.split(",")[0] for view in views} == {"navy", "tan", "paper", "polka"}
    for view in views:
        points = view.cloud.points[0]
        assert points.shape == (1200, 3)
        assert np.isfinite(points).all()
        kept = decimate_m(points, 0.02)
        # No point of the cloud is farther from what is left of it than a cube is large.
        away = np.linalg.norm(points[:, None] - kept[None], axis=-1).min(axis=1)
        assert away.max() < 0.02 * np.sqrt(3)
        assert 30 < len(kept) < len(points)
    told = draw_view(views[0], Colours(), 0.02, tmp_path / "sheet.png")
    assert "1200 points, 1200 of them tissue" in told
    assert (tmp_path / "sheet.png").is_file()
