"""What a figure has written where: asked of the renderer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


def boxes(made: Any) -> list[tuple[str, np.ndarray]]:
    """Everything written in a figure, with the corners of the rectangle that it fills, rotated as it is."""
    from matplotlib.text import Text

    drawn: list[Text] = []
    plain = Text.draw
    with pytest.MonkeyPatch.context() as patch:
        # Of the texts that there are, those that the renderer is asked to draw.
        patch.setattr(Text, "draw", lambda self, renderer: (drawn.append(self), plain(self, renderer))[1])
        made.canvas.draw()
    found = []
    for text in dict.fromkeys(drawn):
        if not text.get_visible() or not text.get_text().strip() or not text.get_window_extent().width:
            continue
        outer, angle = text.get_window_extent(), text.get_rotation()
        text.set_rotation(0.0)
        inner = text.get_window_extent()
        text.set_rotation(angle)
        turn = np.deg2rad(angle)
        along, up = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        middle = np.array([0.5 * (outer.x0 + outer.x1), 0.5 * (outer.y0 + outer.y1)])
        wide, high = 0.5 * inner.width, 0.5 * inner.height * 0.8
        corners = [middle + a * wide * along + b * high * up for a in (-1, 1) for b in (-1, 1)]
        found.append((text.get_text(), np.array(corners)))
    return found


def overlap(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rectangles overlap: no side of either parts them."""
    for corners in (a, b):
        for side in (corners[1] - corners[0], corners[2] - corners[0]):
            axis = side / (np.linalg.norm(side) or 1.0)
            first, second = a @ axis, b @ axis
            if first.max() <= second.min() + 0.3 or second.max() <= first.min() + 0.3:
                return False
    return True


def touching(found: list[tuple[str, np.ndarray]]) -> list[tuple[str, str]]:
    """Pairs of texts that lie on each other."""
    low = np.array([corners.min(axis=0) for _, corners in found])
    high = np.array([corners.max(axis=0) for _, corners in found])
    near = [
        (i, j)
        for i in range(len(found))
        for j in i + 1 + np.flatnonzero(np.all((low[i + 1 :] < high[i]) & (high[i + 1 :] > low[i]), axis=1))
    ]
    return [(found[i][0], found[j][0]) for i, j in near if overlap(found[i][1], found[j][1])]


def outside(made: Any, found: list[tuple[str, np.ndarray]]) -> list[str]:
    """Texts that reach out of the figure."""
    size = np.array(made.canvas.get_width_height())
    return [text for text, c in found if c.min() < -1.0 or np.any(c.max(axis=0) > size + 1.0)]
