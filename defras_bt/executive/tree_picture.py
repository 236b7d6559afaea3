"""A tree as a picture: an SVG drawing that browsers open and papers print."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.sax.saxutils import escape

from defras_bt.executive.registry import snake_case
from defras_bt.executive.tree_show import Outline
from defras_bt.recording import palette

_ROW_PX, _GAP_PX, _MARGIN_PX = 34.0, 44.0, 16.0
_HEIGHT_PX, _CORNER_PX = 26.0, 6.0
# Mean advance of a sans-serif letter per unit of its size; the text need not be exact, the box is
# made to hold it with some room.
_LETTER = 0.58
_NAME_PX, _DETAIL_PX = 12.0, 10.0

_FILLS: Mapping[str, palette.Rgb] = {
    "guard": (255, 236, 196),
    "motion": (206, 224, 250),
    "recovery": (226, 216, 246),
    "task": (238, 241, 244),
    "plan_slot": (206, 224, 250),
}
_INNER: palette.Rgb = (255, 255, 255)
_LEGEND = ("guard", "motion", "recovery", "task")


@dataclass(frozen=True)
class _Box:
    """Where one node stands. ``x``, ``y``: left edge and middle of the box [px]."""

    node: Outline
    x: float
    y: float
    width: float

    @property
    def right(self) -> float:
        return self.x + self.width


def show_svg(outline: Outline) -> str:
    """The tree from left to right: children right of their parent, in the order they are ticked."""
    boxes = list(_boxes(outline))
    by_path = {box.node.path: box for box in boxes}
    width = max(box.right for box in boxes) + _MARGIN_PX
    height = max(box.y for box in boxes) + _HEIGHT_PX / 2 + _ROW_PX + _MARGIN_PX
    body = [
        *(
            _edge(by_path[box.node.path], by_path[c.path])
            for box in boxes
            for c in box.node.children
        ),
        *(line for box in boxes for line in _drawn(box)),
        *_legend(height - _MARGIN_PX - 8),
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}" role="img" '
        f'font-family="Inter, Helvetica, Arial, sans-serif" fill="{palette.css(palette.INK)}">\n'
        f"<title>Behaviour tree {escape(outline.name)}</title>\n"
        '<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(body) + "\n</svg>\n"
    )


def _boxes(root: Outline) -> Iterator[_Box]:
    """A column for each depth, as wide as its widest box; a row for each leaf."""
    widths: dict[int, float] = {}

    def measure(node: Outline, depth: int) -> None:
        widths[depth] = max(widths.get(depth, 0.0), _width(node))
        for child in node.children:
            measure(child, depth + 1)

    measure(root, 0)
    lefts = [_MARGIN_PX]
    for depth in range(len(widths)):
        lefts.append(lefts[-1] + widths[depth] + _GAP_PX)
    placed: list[_Box] = []

    def place(node: Outline, depth: int, row: int) -> tuple[float, int]:
        """The middle of ``node`` and the next free row."""
        if not node.children:
            y = _MARGIN_PX + _HEIGHT_PX / 2 + row * _ROW_PX
            row += 1
        else:
            middles = []
            for child in node.children:
                middle, row = place(child, depth + 1, row)
                middles.append(middle)
            y = (middles[0] + middles[-1]) / 2
        placed.append(_Box(node, lefts[depth], y, _width(node)))
        return y, row

    place(root, 0, 0)
    yield from sorted(placed, key=lambda box: (box.x, box.y))


def _detail(node: Outline) -> str:
    """What the name does not tell: the kind, the parameters."""
    kind = "" if node.name in (node.kind, snake_case(node.kind)) else node.kind
    return f"{kind}{node.detail}".strip()


def _width(node: Outline) -> float:
    letters = len(node.name) * _NAME_PX + (len(_detail(node)) + 1) * _DETAIL_PX
    return letters * _LETTER + 18.0


def _drawn(box: _Box) -> Iterator[str]:
    node = box.node
    fill = palette.css(_FILLS.get(node.role or node.kind, _INNER))
    is_slot = node.kind == "plan_slot"
    dashes = ' stroke-dasharray="5 3"' if is_slot else ""
    corner = _HEIGHT_PX / 2 if node.role == "recovery" else _CORNER_PX
    yield (
        f'<rect x="{box.x:.1f}" y="{box.y - _HEIGHT_PX / 2:.1f}" width="{box.width:.1f}" '
        f'height="{_HEIGHT_PX}" rx="{corner}" fill="{fill}" '
        f'stroke="{palette.css(palette.MUTED)}"{dashes}/>'
    )
    detail = _detail(node)
    shown = (
        f'<tspan font-size="{_DETAIL_PX}" fill="{palette.css(palette.EVENT_LEVELS["info"])}" '
        f'dx="5">{escape(detail)}</tspan>'
        if detail
        else ""
    )
    yield (
        f'<text x="{box.x + 9:.1f}" y="{box.y + 4:.1f}" font-size="{_NAME_PX}">'
        f"{escape(node.name)}{shown}</text>"
    )


def _edge(parent: _Box, child: _Box) -> str:
    middle = (parent.right + child.x) / 2
    return (
        f'<path d="M {parent.right:.1f} {parent.y:.1f} C {middle:.1f} {parent.y:.1f}, '
        f'{middle:.1f} {child.y:.1f}, {child.x:.1f} {child.y:.1f}" fill="none" '
        f'stroke="{palette.css(palette.MUTED)}"/>'
    )


def _legend(y: float) -> Iterator[str]:
    x = _MARGIN_PX
    for role in _LEGEND:
        yield (
            f'<rect x="{x:.0f}" y="{y - 9:.0f}" width="14" height="12" rx="3" '
            f'fill="{palette.css(_FILLS[role])}" stroke="{palette.css(palette.MUTED)}"/>'
            f'<text x="{x + 20:.0f}" y="{y + 1:.0f}" font-size="{_DETAIL_PX}">{role}</text>'
        )
        x += 90
