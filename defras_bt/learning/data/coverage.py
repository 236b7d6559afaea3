"""What training data covers: counts by condition, and histograms of what varies."""

from __future__ import annotations

import base64
import html
import io
import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from defras_bt.learning.data.generate import shard_files
from defras_bt.learning.data.samples import Sample, samples_of
from defras_bt.learning.data.shards import read_shard

_NUMBERS: Mapping[str, Callable[[Sample], float]] = {
    "length along x [mm]": lambda s: 1e3 * s.belief.tissue.length_x_m,
    "width along y [mm]": lambda s: 1e3 * s.belief.tissue.width_y_m,
    "thickness [mm]": lambda s: 1e3 * s.belief.tissue.thickness_m,
    "modulus [kPa]": lambda s: 1e-3 * s.belief.tissue.young_modulus_pa,
    "Poisson's ratio": lambda s: s.belief.tissue.poisson_ratio,
    "true holes": lambda s: float(s.truth.attached.sum()),
    "holes wrongly believed": lambda s: float((s.truth.attached != s.belief.attached).sum()),
    "local discrepancy [mm]": lambda s: 1e3 * s.local_m,
    "travel of the tip [mm]": lambda s: 1e3 * _travel_m(s),
    "points in the newest cloud": lambda s: float(len(s.keyframes[-1].cloud_m)),
    "camera noise [mm]": lambda s: 1e3 * s.belief.depth_camera.noise_sd_m,
    "camera azimuth [deg]": lambda s: _camera_angles_deg(s)[0],
    "camera elevation [deg]": lambda s: _camera_angles_deg(s)[1],
}
_WORDS: Mapping[str, Callable[[Sample], str]] = {
    "what is not as believed": lambda s: s.cause,
    "belief": lambda s: s.kind,
    "tissue": lambda s: _tissue(s),
    "material": lambda s: s.belief.tissue.material,
    "arms that hold": lambda s: str(len(s.keyframes[0].grasp_tips)),
    "keyframes": lambda s: str(len(s.keyframes)),
}


@dataclass
class Coverage:
    """Counts and values over all samples."""

    samples: int = 0
    words: dict[str, Counter[str]] = field(default_factory=lambda: {k: Counter() for k in _WORDS})
    numbers: dict[str, list[float]] = field(default_factory=lambda: {k: [] for k in _NUMBERS})

    def add(self, samples: Iterable[Sample]) -> None:
        for sample in samples:
            self.samples += 1
            for name, word in _WORDS.items():
                self.words[name][word(sample)] += 1
            for name, number in _NUMBERS.items():
                self.numbers[name].append(number(sample))

    @property
    def other_causes(self) -> float:
        """Share of samples with a mismatch that is not due to attachments."""
        counts = self.words["what is not as believed"]
        return 1.0 - (counts["attachments"] + counts["nothing"]) / max(self.samples, 1)


def write_coverage(folder: Path, tell: Callable[[int, int], None]) -> Coverage:
    """Write coverage.json and coverage.html about all shards of ``folder``.

    ``tell`` hears how many of how many shards are counted.
    """
    coverage, files = Coverage(), shard_files(folder)
    for number, file in enumerate(files):
        coverage.add(samples_of(read_shard(file)))
        tell(number + 1, len(files))
    numbers = {
        name: dict(zip(("least", "5%", "median", "95%", "most"), _quantiles(values), strict=True))
        for name, values in coverage.numbers.items()
    }
    content = {
        "shards": len(files),
        "samples": coverage.samples,
        "not_due_to_attachments": round(coverage.other_causes, 4),
        "counts": {name: dict(counts.most_common()) for name, counts in coverage.words.items()},
        "numbers": numbers,
    }
    text = json.dumps(content, indent=2) + "\n"
    (folder / "coverage.json").write_text(text, encoding="utf-8")
    (folder / "coverage.html").write_text(_page(coverage, len(files)), encoding="utf-8")
    return coverage


def _page(coverage: Coverage, shards: int) -> str:
    tables = []
    for name, counts in coverage.words.items():
        rows = "".join(
            f"<tr><td>{html.escape(word)}</td><td>{count}</td>"
            f"<td>{100 * count / coverage.samples:.1f} %</td></tr>"
            for word, count in counts.most_common()
        )
        tables.append(f"<h2>{html.escape(name)}</h2><table>{rows}</table>")
    picture = base64.b64encode(_histograms(coverage)).decode()
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Training data</title>'
        "<style>body{font:15px/1.5 system-ui,sans-serif;max-width:72rem;margin:2rem auto}"
        "td{padding:.1rem 1rem}</style><h1>What the training data covers</h1>"
        f"<p>{coverage.samples} samples in {shards} shards, one tissue each; "
        f"{100 * coverage.other_causes:.1f} % have a mismatch that is not due to attachments.</p>"
        f'<img alt="histograms" src="data:image/png;base64,{picture}">{"".join(tables)}</html>\n'
    )


def _histograms(coverage: Coverage) -> bytes:
    figure = Figure(figsize=(13, 9), dpi=80, layout="constrained")
    FigureCanvasAgg(figure)
    columns = 4
    axes = figure.subplots(-(-len(coverage.numbers) // columns), columns).ravel()
    for axis, (name, values) in zip(axes, coverage.numbers.items(), strict=False):
        axis.hist(np.array(values)[np.isfinite(values)], bins=24, color="#6b8fb5")
        axis.set_xlabel(name)
    for axis in axes[len(coverage.numbers) :]:
        axis.set_axis_off()
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()


def _quantiles(values: list[float]) -> list[float]:
    known = np.array(values)[np.isfinite(values)]
    return [round(float(each), 4) for each in np.quantile(known, (0, 0.05, 0.5, 0.95, 1))]


def _tissue(sample: Sample) -> str:
    anatomy = sample.belief.tissue.anatomy
    return "slab" if anatomy is None else anatomy.file.stem


def _travel_m(sample: Sample) -> float:
    last = sample.keyframes[-1]
    return max(
        float(np.linalg.norm(tip.position_m - last.grasp_tips[arm].position_m))
        for arm, tip in last.tips.items()
    )


def _camera_angles_deg(sample: Sample) -> tuple[float, float]:
    camera = sample.belief.depth_camera
    x, y, z = np.subtract(camera.position_m, camera.target_m)
    return float(np.degrees(np.arctan2(y, x))), float(np.degrees(np.arctan2(z, np.hypot(x, y))))
