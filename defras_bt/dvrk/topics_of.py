"""Where a set-up's readings stand in a bag of its topics, for ``defras diagnose --topics``."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

from ruamel.yaml import YAML

from defras_bt.diagnosis.topic_map import (
    AngleSource,
    ArmTopics,
    FramePlace,
    LengthSource,
    TopicMap,
)
from defras_bt.dvrk.registering.registration import Registration
from defras_bt.dvrk.settings import ArmSetup, Setup
from defras_bt.recording.inputs import CLOUD_TOPIC
from defras_bt.recording.whole_file import write_whole


def topics_of(setup: Setup, registration: Registration) -> TopicMap:
    """The topic map of a run's bag: arms as they speak, the tissue's cloud as the executive saw it.

    Forces are left out: those of motor currents turn with the tip, and are 2 N off.

    Raises:
        KeyError: an arm is not registered.
    """
    return TopicMap(
        arms={name: _arm(arm) for name, arm in setup.arms.items()},
        cloud=LengthSource(topic=CLOUD_TOPIC),
        frames={
            arm.frame: FramePlace(
                position_m=registration.arms[name].position_m,
                quaternion_xyzw=registration.arms[name].quaternion_xyzw,
            )
            for name, arm in setup.arms.items()
        },
    )


def write_topics(topics: TopicMap, file: Path) -> None:
    """
    Raises:
        OSError: it cannot be written.
    """
    text = StringIO()
    YAML().dump(topics.model_dump(mode="json", exclude_defaults=True), text)
    write_whole(file, text.getvalue())


def _arm(arm: ArmSetup) -> ArmTopics:
    root, beyond_m = f"/{arm.name}", arm.reported_to_tip_m
    return ArmTopics(
        setpoint=LengthSource(topic=f"{root}/setpoint_cp", tip_beyond_m=beyond_m),
        measured=LengthSource(topic=f"{root}/measured_cp", tip_beyond_m=beyond_m),
        joints=AngleSource(topic=f"{root}/measured_js"),
        setpoint_joints=AngleSource(topic=f"{root}/setpoint_js"),
        jaw=AngleSource(topic=f"{root}/jaw/measured_js"),
    )
