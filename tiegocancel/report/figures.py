"""Draw every figure of a run, each with the sentence that says how to read it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tiegocancel.report.images import before_after, scene, time_slices
from tiegocancel.report.motion import motion_figure
from tiegocancel.report.plots import controls, displacement, radial_profile, rate, residual_profile
from tiegocancel.report.style import STYLE
from tiegocancel.study.result import RunResult

__all__ = ["Drawing", "draw_figures"]

DPI = 150
_SCENE = (
    "What an ordinary camera would see, beside what the event camera fires in the same instants. The disc turns before "
    "a fixed camera, which is the same to the sensor as a camera that rolls; the hand moves by itself."
)


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure on disk: file ``path``, ``title``, and the ``caption`` that says how to read it."""

    path: Path
    title: str
    caption: str


_FIGURES: tuple[tuple[str, str, Callable[[RunResult], Figure | None], str], ...] = (
    (
        "controls",
        "Against the controls",
        controls,
        "Share of events suppressed under the motion given, and on the same events under motions that are wrong. "
        "Only the distance between the first bar and the others is the method's merit.",
    ),
    (
        "before_after",
        "Before and after",
        before_after,
        "Signed event counts a pixel over the same stretch of time: ON red, OFF blue. Left everything that the sensor "
        "fired, then what is still sent on. The circle is the disc that the regions refer to.",
    ),
    (
        "time_slices",
        "A slice through time",
        time_slices,
        "The events of a few rows below the centre, against time. Along a row a rotation moves every edge sideways "
        "at one speed: slanted streaks. Left all events, right what remains: streaks that follow the motion thin out, "
        "others stay.",
    ),
    (
        "radial_profile",
        "Along the radius",
        radial_profile,
        "Density of events by distance from the centre, before and after, and the share suppressed. An offset centre "
        "lifts the residual everywhere, a wrong speed lifts it towards the rim.",
    ),
    (
        "displacement",
        "Inside the gates",
        displacement,
        "Where events met their predictions. In space a cloud centred on zero means that the motion is right, a "
        "shifted cloud that it is not, one that fills the gate chance. In time it leans to early: the first event "
        "inside the gate takes the prediction.",
    ),
    (
        "residual_profile",
        "Centre or speed",
        lambda result: residual_profile(result.residuals, result.diagnosis),
        "Where real events lie beside their predictions, ring by ring. A wrong speed turns the outer rings away, a "
        "wrong centre moves all rings alike; a profile along zero means that neither stands out.",
    ),
    (
        "motion",
        "The motion found on the way",
        lambda result: motion_figure(result.estimates) if result.estimates else None,
        "Every estimate uses events before it alone and holds from its own time on. Bands are two standard deviations; "
        "where they are grey the window did not tell the motion.",
    ),
    (
        "rate",
        "Over time",
        rate,
        "Event rate before and after. The grey stretch is the warm-up of horizon and gate, left out of every ratio.",
    ),
)


def draw_figures(result: RunResult, folder: Path, photograph: NDArray[np.float32] | None = None) -> list[Drawing]:
    """Write the figures of ``result`` as PNG files into ``folder``; return them in the order of the report.

    ``photograph`` float32[height, width] is the intensity that a camera would see, where the scene is known.
    """
    drawings = []
    with rc_context(STYLE):
        if photograph is not None:
            path = folder / "scene.png"
            scene(photograph, result).savefig(path, dpi=DPI)
            drawings.append(Drawing(path, "The scene", _SCENE))
        for name, title, draw, caption in _FIGURES:
            drawn = draw(result)
            if drawn is None:
                continue
            path = folder / f"{name}.png"
            drawn.savefig(path, dpi=DPI)
            drawings.append(Drawing(path, title, caption))
    return drawings
