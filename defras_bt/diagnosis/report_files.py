"""Everything that a diagnosis leaves in its folder."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.exhibits import Exhibits
from defras_bt.diagnosis.extended_scene import write_extended_scene
from defras_bt.diagnosis.report import report_html
from defras_bt.diagnosis.report_words import verdict_sentence
from defras_bt.diagnosis.timeline import write_timeline
from defras_bt.diagnosis.verdict_file import Origin, verdict_file, write_verdict
from defras_bt.recording.whole_file import write_whole
from defras_sim.effects.effect import Effect
from defras_sim.scene import Scene, load_scene

VERDICT, SCENE, REPORT, TIMELINE = (
    "verdict.json",
    "extended_scene.yaml",
    "report.html",
    "diagnosis.rrd",
)


def write_diagnosis(
    folder: Path,
    diagnosis: Diagnosis,
    origin: Origin,
    effects: Iterable[Effect],
    *,
    scene_file: Path | None = None,
    exhibits: Exhibits | None = None,
) -> tuple[Path, ...]:
    """Write ``folder``, the verdict first; return the files written.

    ``effects`` are those that were looked for. Without ``scene_file`` (the arm, a specimen) nothing
    is drawn on tissue and no scene is extended.

    Raises:
        InvalidFile: ``scene_file`` is no scene.
        OSError: something cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    known = {effect.name: effect for effect in effects}
    sentence = verdict_sentence(diagnosis.verdict, known)
    written = [folder / VERDICT]
    file = verdict_file(diagnosis.verdict, sentence, origin, complete=diagnosis.complete)
    write_verdict(file, written[0])
    scene: Scene | None = None
    if scene_file is not None:
        scene = load_scene(scene_file)
        written.append(folder / SCENE)
        write_extended_scene(scene_file, diagnosis.verdict, written[-1])
    written.append(folder / REPORT)
    page = report_html(diagnosis, origin, known, scene=scene, exhibits=exhibits)
    write_whole(written[-1], page)
    written.append(folder / TIMELINE)
    write_timeline(diagnosis, origin, sentence, written[-1], scene=scene, exhibits=exhibits)
    return tuple(written)
