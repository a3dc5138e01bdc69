"""Pictures of a run: the deformed body, coloured by a field, at one step or as a time series."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyvista
from numpy.typing import NDArray

from ancf_petsc.errors import CaseError, did_you_mean
from ancf_petsc.post.panels import GREY
from ancf_petsc.post.scene import DARK, frame, make_plotter, matt, outline, surface, write_texts
from ancf_petsc.post.units import Units, read_units, with_unit
from ancf_petsc.results.reader import Results

WORDS = {
    "displacement": "displacement",
    "velocity": "velocity",
    "green_lagrange": "Green-Lagrange strain",
    "cauchy": "Cauchy stress",
    "von_mises": "von Mises stress",
    "det_F": "det F",
}
VECTOR = ("magnitude", "x", "y", "z")
TENSOR = ("max", "min", "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz")
PRINCIPAL = {"max": "largest principal", "min": "smallest principal"}


@dataclass(frozen=True)
class Look:
    """What to show: a field and its component, displacements times `scale`, the undeformed outline."""

    field: str = "displacement"
    component: str = ""
    scale: float = 1.0
    undeformed: bool = True


def scalars(results: Results, look: Look, step: int) -> NDArray[np.float64]:
    """One number a node or cell: the component of the field."""
    values = results.field(look.field, step)
    if values.ndim == 1:
        if look.component:
            raise CaseError(
                "this field has no components", file=results.path, key="--component", got=look.component
            )
        return values
    names = _components(values)
    component = look.component or names[0]
    if component not in names:
        cure = did_you_mean(component, names)
        raise CaseError("no such component", file=results.path, key="--component", got=component, cure=cure)
    if component == "magnitude":
        return np.linalg.norm(values, axis=1)
    if component in PRINCIPAL:
        return np.linalg.eigvalsh(values.reshape(-1, 3, 3))[:, -1 if component == "max" else 0]
    return values[:, names.index(component) - (len(names) - values.shape[1])]


def _components(values: NDArray[np.float64]) -> tuple[str, ...]:
    known = {3: VECTOR, 9: TENSOR}
    return known.get(values.shape[1], tuple(map(str, range(values.shape[1]))))


def label(results: Results, look: Look) -> str:
    """Name, component and unit of what the colours mean."""
    units = read_units(results.units)
    known = {
        "displacement": units.length,
        "velocity": units.speed,
        "cauchy": units.stress,
        "von_mises": units.stress,
    }
    component = look.component
    if not component and results.field(look.field, 0).ndim > 1:
        component = _components(results.field(look.field, 0))[0]
    words = WORDS.get(look.field, look.field.replace("_", " "))
    if results.holds_modes:  # of any size
        words, known = f"{words}, scaled", {}
    if component and component != "magnitude":
        words = f"{words}, {PRINCIPAL.get(component, component)}"
    return with_unit(words, known.get(look.field, ""))


class Scene:
    """The body in a plotter; `show` moves it to a step."""

    def __init__(
        self, results: Results, look: Look, steps: range, *, off_screen: bool, smooth: bool = True
    ) -> None:
        """steps: those the colours and the frame have to hold for."""
        self.results = results
        self.look = look
        self.title = label(results, look)
        self.limits, self.clipped = _limits([scalars(results, look, step) for step in steps])
        self.colours = "RdBu_r" if self.limits[0] < 0 < self.limits[1] else "viridis"
        self.plotter = make_plotter(off_screen=off_screen, smooth=smooth)
        if look.undeformed:
            shape, paint = outline(surface(results.mesh(0, scale=0.0, fields=())))
            self.plotter.add_mesh(shape, color=GREY, **paint)
        frame(self.plotter, self._positions(steps), right=0.12)

    def _positions(self, steps: range) -> Iterator[NDArray[np.float64]]:
        if self.look.undeformed:
            yield self.results.points
        for step in steps:
            yield self.results.points + self.look.scale * self.results.field("displacement", step)

    def show(self, step: int) -> None:
        """The body, the time and the stroke at a step counted from 0."""
        body = self.results.mesh(step, scale=self.look.scale, fields=())
        data = body.point_data if self.look.field in self.results.node_fields else body.cell_data
        data[self.title] = scalars(self.results, self.look, step)
        skin = surface(body)
        actor = self.plotter.add_mesh(
            skin,
            scalars=self.title,
            cmap=self.colours,
            clim=self.limits,
            show_scalar_bar=False,
            name="body",
            render=False,
            **matt(body.n_cells, lines=skin.GetNumberOfPolys() == 0),
        )
        if not self.plotter.scalar_bars:
            self._add_bar(actor)
        line = describe(self.results, self.look, step)
        write_texts(self.plotter, self.results.title, line, self.results.note)
        self.plotter.render()

    def _add_bar(self, actor: pyvista.Actor) -> None:
        self.plotter.add_scalar_bar(
            title=f"{self.title}\n{self.clipped}\n",
            mapper=actor.mapper,
            vertical=True,
            position_x=0.86,
            position_y=0.22,
            width=0.06,
            height=0.5,
            n_labels=5,
            fmt="%.3g",
            color=DARK,
            title_font_size=20,
            label_font_size=19,
            unconstrained_font_size=True,
            render=False,
        )


def _limits(values: list[NDArray[np.float64]]) -> tuple[tuple[float, float], str]:
    """The range of colours, symmetric about nought where there are both signs, and what it leaves out.

    Where a few values, such as those at a corner, would take more than half of the range, it ends at the
    hundredths that hold all others.
    """
    least = min(float(one.min()) for one in values)
    most = max(float(one.max()) for one in values)
    low = min(float(np.percentile(one, 1)) for one in values)
    high = max(float(np.percentile(one, 99)) for one in values)
    words = ""
    if most - least > 2 * (high - low) > 0:
        words = f"(values {least:.3g} to {most:.3g})"
    else:
        low, high = least, most
    largest = max(abs(low), abs(high))
    if low < -1e-9 * largest and high > 1e-9 * largest:
        low, high = -largest, largest
    if high - low <= 1e-12 * largest or largest == 0:
        low, high = low - 0.5 * (largest or 1.0), high + 0.5 * (largest or 1.0)
    return (low, high), words


def describe(results: Results, look: Look, step: int) -> str:
    """Time, stroke where the case has one, and the scale of displacements where it is not 1; of a mode its
    number and frequency.
    """
    units: Units = read_units(results.units)
    if results.holds_modes:
        growth = float(results.extras[step].get("growth_rate", 0.0))
        if growth:
            return f"mode {results.times[step]:g}   unstable, grows by exp({growth:.4g} t)"
        unit = {"s": "Hz", "": ""}.get(units.time, f"1/{units.time}")
        frequency = f"{float(results.extras[step]['frequency']):.4g} {unit}".rstrip()
        return f"mode {results.times[step]:g}   frequency {frequency}"
    curve = results.curve
    time = results.times[step]
    parts = [f"time {time:.4g} {units.time}".rstrip() if "time" in curve else f"pseudo-time {time:.4g}"]
    if "stroke" in curve:
        clock = curve["time"] if "time" in curve else curve["pseudo_time"]
        row = int(np.argmin(np.abs(clock - time)))
        parts.append(f"stroke {curve['stroke'][row]:.4g} {units.length}".rstrip())
    if look.scale != 1.0:
        parts.append(f"displacements x {look.scale:g}")
    return "   ".join(parts)


def screenshot(results: Results, look: Look, step: int, file: Path) -> None:
    """A picture of one step."""
    step = results.step_number(step)
    scene = Scene(results, look, range(step, step + 1), off_screen=True)
    scene.show(step)
    scene.plotter.screenshot(str(file))
    scene.plotter.close()


def movie(results: Results, look: Look, file: Path, *, seconds: float = 5.0) -> None:
    """An animated GIF of all steps."""
    from PIL import Image

    count = results.step_number(-1) + 1
    scene = Scene(
        results, look, range(count), off_screen=True, smooth=False
    )  # halving the picture smooths it
    frames = []
    for step in range(count):
        scene.show(step)
        picture = Image.fromarray(scene.plotter.screenshot(return_img=True))
        frames.append(picture.resize((picture.width // 2, picture.height // 2)).quantize(256))
    scene.plotter.close()
    milliseconds = [max(20, round(1000 * seconds / count))] * (count - 1) + [1000]
    frames[0].save(file, save_all=True, append_images=frames[1:], duration=milliseconds, loop=0)


def explore(results: Results, look: Look, step: int) -> None:
    """A window with the body to turn around and a slider over the steps."""
    count, step = len(results.times), results.step_number(step)
    scene = Scene(results, look, range(count), off_screen=False)
    scene.show(step)
    if count > 1:
        scene.plotter.add_slider_widget(
            lambda value: scene.show(round(value)),
            (0, count - 1),
            value=step,
            title="step",
            fmt="%.0f",
            pointa=(0.3, 0.07),
            pointb=(0.7, 0.07),
            color=DARK,
            style="modern",
            slider_width=0.02,
            tube_width=0.006,
            title_height=0.02,
        )
    scene.plotter.show(title=results.title)
