"""The state lanes of a timeline, and the drawing of the tree whose nodes take their colours."""

from __future__ import annotations

from collections.abc import Mapping

import rerun as rr

from defras_bt.recording import palette
from defras_bt.recording.record import RunInfo, TickRecord
from defras_bt.recording.timeline_changes import Changes, packed
from defras_bt.recording.tree_layout import parent_of, tree_layout, tree_order

_IDLE: palette.Rgb = (224, 228, 233)
_NODE_LANE = {state: (state.lower(), colour) for state, colour in palette.NODE_STATES.items()}
_WARNING_LANE = {
    str(state): (label, colour)
    for state, (label, colour) in enumerate(
        zip(
            ("0 agrees", "1 slow down, learn", "2 stop, re-plan", "3 ask a human"),
            palette.WARNING_STATES,
            strict=True,
        )
    )
}

_OPERATOR_LANE = {
    mode: (mode.replace("_", " "), colour) for mode, colour in palette.OPERATOR_MODES.items()
}


class Lanes:
    """Operator, warning state, action, and one lane per node, each written when it changes."""

    def __init__(self, stream: rr.RecordingStream, info: RunInfo) -> None:
        self._stream = stream
        self._info = info
        self._changes = Changes()
        self._kinds = dict(info.tree_paths)
        self._status: dict[str, str] = {}
        self._log_lane("monitor/warning_state", _WARNING_LANE)
        self._log_lane("operator/mode", _OPERATOR_LANE)
        self._log_lane("plan/action", {name: (name, c) for name, c in palette.ACTIONS.items()})
        for path in self._kinds:
            self._log_lane(_lane_of(path), _NODE_LANE)
        self._log_tree({})

    def tick(self, record: TickRecord) -> None:
        state = self._info.warning_state(record.reading)
        if self._changes.new("warning_state", state):
            said = "" if state is None else str(state)
            self._stream.log("monitor/warning_state", rr.StateChange(state=said))
        if self._changes.new("operator", record.operator.mode):
            self._stream.log("operator/mode", rr.StateChange(state=record.operator.mode.value))
        action = record.action
        if self._changes.new("action", action):
            self._stream.log(
                "plan/action", rr.StateChange(state="" if action is None else action.name)
            )
        self._log_nodes(record.node_status)

    def _log_nodes(self, status: Mapping[str, str]) -> None:
        fresh = [path for path in status if path not in self._kinds]
        for path in fresh:
            # Leaves made from a plan join the tree while it runs.
            self._kinds[path] = "Action"
            self._log_lane(_lane_of(path), _NODE_LANE)
        now = {path: status.get(path, "") for path in self._kinds}
        changed = {path: s for path, s in now.items() if s != self._status.get(path, "")}
        for path, state in changed.items():
            self._stream.log(_lane_of(path), rr.StateChange(state=state))
        self._status = now
        if fresh:
            self._log_tree(now)
        elif changed:
            colours = packed([palette.NODE_STATES.get(s, _IDLE) for s in now.values()])
            self._stream.log("tree/graph", rr.GraphNodes.from_fields(colors=colours))

    def _log_tree(self, status: Mapping[str, str]) -> None:
        paths = list(self._kinds)
        places = tree_layout(tree_order(paths))
        edges = [(p, path) for path in paths if (p := parent_of(path)) is not None]
        self._stream.log(
            "tree/graph",
            rr.GraphNodes(
                paths,
                positions=[places[path] for path in paths],
                labels=[path.rpartition("/")[2] for path in paths],
                colors=packed([palette.NODE_STATES.get(status.get(p, ""), _IDLE) for p in paths]),
            ),
            rr.GraphEdges(edges, graph_type="directed"),
        )

    def _log_lane(
        self, path: str | list[str], states: Mapping[str, tuple[str, palette.Rgb]]
    ) -> None:
        configuration = rr.StateConfiguration(
            values=list(states),
            labels=[label for label, _ in states.values()],
            colors=packed([colour for _, colour in states.values()]),
        )
        self._stream.log(path, configuration, static=True)


def _lane_of(path: str) -> list[str]:
    return ["executive", *path.split("/")]
