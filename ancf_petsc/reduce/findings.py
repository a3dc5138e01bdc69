"""What of a model its scene does not need: part 1 of `ancf advise`."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.mesh.kinds import KINDS, edge_lengths
from ancf_petsc.plan.outputs import output_times
from ancf_petsc.plan.plan import Plan, make_plan
from ancf_petsc.reduce.cut import crossing_cells
from ancf_petsc.reduce.half import HALVES, QUARTER
from ancf_petsc.reduce.prism import prism_of
from ancf_petsc.reduce.revolution import ring_of
from ancf_petsc.reduce.section import LINEAR, reduced_to_section
from ancf_petsc.reduce.symmetry import MirrorPlane, SceneModel, mirror_planes, place
from ancf_petsc.results.reader import Results

WITHIN = 0.01
COUNTS = {1: "half", 2: "a quarter", 3: "an eighth"}


@dataclass(frozen=True)
class Finding:
    """One thing a scene allows.

    kind: "mirror", "revolution", "prism", "inertia", "linear", "path" or "outputs". sentence: what, and what it saves. how: a
    command or keys, "" where nothing is to be done. factor: part of the degrees of freedom (or of the solutions, of kinds about
    the path) that is left. elements: of the smaller model, None where it is the same. within: the relative error it brings.
    """

    kind: str
    sentence: str
    how: str
    factor: float
    elements: int | None = None
    within: float = 0.0

    def __str__(self) -> str:
        return f"{self.sentence}: {self.how}" if self.how else self.sentence


def findings(
    case: Case,
    results: Results | None = None,
    *,
    at: Mapping[str, float] | None = None,
    within: float = WITHIN,
) -> list[Finding]:
    """What is found in a case and, of its inertia and strains, in a run of it, such as a cheap one on a coarse mesh.

    at: where the path is asked for, {"stroke": 0.01}, {"pseudo_time": 0.5} or {"time": 0.1}; None: not known. within: the target.
    Raises CaseError for a case that cannot be planned.
    """
    plan = make_plan(case)
    found = list(_of_shape(case, plan)) if plan.element.cell.dimension == 3 else []
    found += _of_path(case, at or {})
    if results is not None:
        found += _of_inertia(case, results, within)
        found += _of_strain(case, results, within)
    return found


def _of_shape(case: Case, plan: Plan) -> Iterator[Finding]:
    scene = SceneModel(case, plan)
    yield from _mirrors(scene)
    yield from _revolution(scene)
    found = prism_of(scene)
    if found:
        axis, length = found
        _, longest = edge_lengths(plan.mesh.points, plan.mesh.cells, KINDS[plan.mesh.kind])
        count = max(1, round(scene.volume / length / (longest.mean() ** 2 / 2)))
        yield Finding(
            "prism",
            f"prismatic along {AXES[axis]} between planes of symmetry: plane strain does, about {count} triangles of the same size",
            f'mesh the section; [section] plane = "strain", thickness = {length:.6g}',
            _part(count, plan.element.components * plan.space.vectors),
            count,
        )


def _mirrors(scene: SceneModel) -> Iterator[Finding]:
    planes = mirror_planes(scene)
    aligned = [plane for plane in planes if plane.axis is not None]
    case, count = _name(scene.case), len(scene.mesh.cells)
    if aligned:
        usable = aligned[:2]
        to = QUARTER if len(usable) == 2 else next(name for name, i in HALVES.items() if i == usable[0].axis)
        crossed = any(crossing_cells(scene.mesh, plane) for plane in usable)
        parts = 2 ** len(usable)
        more = f", and again about {aligned[2].describe()}" if len(aligned) > 2 else ""
        anew = crossed and scene.mesh.kind == "tetra" and len(scene.case.spec.material) == 1
        meshed = "; it is meshed anew, for elements lie across" if anew else ""
        meshed = meshed or ("; it takes a mesh with faces on the planes" if crossed else "")
        yield Finding(
            "mirror",
            f"symmetric about {_joined(usable)}{more}: {COUNTS[len(usable)]} does, {count // parts} of {count} elements{meshed}",
            f"ancf reduce {case} --to {to}" if anew or not crossed else "",
            1.0 / parts,
            count // parts,
        )
    for plane in planes[:1]:
        if not aligned:
            yield Finding(
                "mirror",
                f"symmetric about the plane {plane.describe()}, which is normal to no axis: half does once the mesh is rotated",
                "",
                0.5,
                count // 2,
            )


def _joined(planes: list[MirrorPlane]) -> str:
    return " and ".join(plane.describe() for plane in planes)


def _revolution(scene: SceneModel) -> Iterator[Finding]:
    ring, _ = ring_of(scene)
    if ring is None:
        return
    try:
        smaller = reduced_to_section(scene, None)
    except CaseError:  # a section that cannot be meshed is no smaller model
        return
    cells = smaller.mesh.cells
    middles = 0 if smaller.data["mesh"]["element"] == LINEAR else 3 * len(cells) // 2
    dof = 2 * (len(smaller.mesh.points) + middles)
    what = (
        "a body of revolution"
        if ring.is_whole
        else f"a sector of {np.degrees(ring.angle):.4g} degrees of a body of revolution"
    )
    yield Finding(
        "revolution",
        f"{what} about the axis through {place(ring.point)} along {place(ring.axis)}, supports and loads with it: a section of "
        f"{len(cells)} triangles gives the same force",
        f"ancf reduce {_name(scene.case)} --to section",
        _part(dof, scene.plan.element.components * scene.plan.space.vectors),
        len(cells),
    )


def _part(dof: float, of: float) -> float:
    return float(dof) / float(of)


def _name(case: Case) -> str:
    path = Path(case.name) if case.file is None else case.file
    return shlex.quote(str(path.parent if path.name == "case.toml" else path))


def _of_path(case: Case, at: Mapping[str, float]) -> Iterator[Finding]:
    """Outputs, and a path beyond what is asked for."""
    if case.spec.statics is None or not at:
        return
    times = output_times(case.spec, case.file)
    (what, value), curve = next(iter(at.items())), case.spec.output.curve
    if what == "stroke" and curve:
        row = next(
            (
                c
                for c in case.spec.constraint
                if c.group == curve.stroke.group and curve.stroke.axis in c.move
            ),
            None,
        )
        largest = abs(row.move[curve.stroke.axis]) if row else 0.0  # type: ignore[index]
        if row and abs(value) < largest * (1 - 1e-9):
            sign = np.sign(row.move[curve.stroke.axis])  # type: ignore[index]
            yield Finding(
                "path",
                f"the path goes on to a stroke of {largest:.6g}, and {abs(value):.6g} is asked for",
                f"--set constraint.{row.group}.move.{curve.stroke.axis}={sign * abs(value):.9g}",
                abs(value) / largest,
            )
    if len(times) > 2 and (what != "stroke" or curve):
        yield Finding(
            "outputs",
            f"{len(times)} outputs, each of them solved for and written, where one is asked for",
            "--set statics.steps= statics.times= statics.strokes= statics.times=[1.0]"
            if what != "stroke"
            else f"--set statics.steps= statics.strokes=[{abs(value):.9g}]",
            1.0 / len(times),
        )


def _of_inertia(case: Case, results: Results, within: float) -> Iterator[Finding]:
    """Whether a motion is a sequence of equilibria: from kinetic energy and the rate of momentum."""
    curve = results.curve
    if case.spec.dynamics is None or "kinetic_energy" not in curve:
        return
    scale = max(float(np.abs(curve["strain_energy"]).max()), float(np.abs(curve["external_work"]).max()))
    energy = float(np.abs(curve["kinetic_energy"]).max()) / scale if scale else np.inf
    momenta = np.stack([curve[f"momentum.{axis}"] for axis in AXES], axis=1)
    inertial = float(np.linalg.norm(np.gradient(momenta, curve["time"], axis=0), axis=1).max())
    forces = [
        np.abs(values).max()
        for name, values in curve.items()
        if name.rpartition(".")[2] in ("rx", "ry", "rz")
    ]
    force = inertial / max(forces) if forces and max(forces) else np.inf
    worst = max(energy, force)
    measured = f"kinetic energy reaches {energy:.2g} of the strain energy and work, inertial forces {force:.2g} of the reactions"
    if worst <= within:
        steps = case.spec.dynamics.outputs
        sentence = f"inertia does not matter: {measured}; statics does"
        yield Finding(
            "inertia", sentence, f"--set dynamics= 'statics={{ steps = {min(steps, 25)} }}'", 0.0, None, worst
        )
    else:
        yield Finding(
            "inertia",
            f"inertia matters: {measured}; statics would be off by about as much",
            "",
            1.0,
            None,
            worst,
        )


def _of_strain(case: Case, results: Results, within: float) -> Iterator[Finding]:
    """Whether one linear step does: from strains and displacement gradients of the last state, and how straight the curve is."""
    if case.spec.statics is None or "displacement" not in results.fields:
        return
    gradient = largest_gradient(results)
    straight = _departure_from_a_line(results)
    worst = max(gradient, straight)
    if worst > within:
        return
    sentence = (
        f"strains and rotations stay below {gradient:.2g}, and force follows stroke in a straight line within {straight:.1g}: "
        "one step does"
    )
    count = len(output_times(case.spec, case.file))
    if count > 1:
        yield Finding(
            "linear",
            sentence,
            "--set statics.times= statics.strokes= statics.steps=1",
            1.0 / count,
            None,
            worst,
        )


def largest_gradient(results: Results) -> float:
    """The largest entry of F - 1 in any cell at the end, from the displacements of its corners."""
    kind = KINDS[results.kind]
    corners = results.cells[:, : kind.corners]
    frames = np.array(kind.frames)
    points, moved = results.points[corners], results.field("displacement")[corners]
    edges = points[:, frames][:, :, 1:] - points[:, frames][:, :, :1]
    change = moved[:, frames][:, :, 1:] - moved[:, frames][:, :, :1]
    # Edges of plane cells span two directions: the pseudo-inverse takes the gradient along these.
    return float(np.abs(np.linalg.pinv(edges) @ change).max())


def _departure_from_a_line(results: Results) -> float:
    """How far the curve's force lies off the straight line from start to end, over the largest force; 0 without a curve."""
    curve = results.curve
    if "force" not in curve or "stroke" not in curve:
        return 0.0
    stroke, force = curve["stroke"], curve["force"]
    if len(stroke) < 3 or not stroke[-1] or not np.abs(force).max():
        return 0.0
    return float(np.abs(force - force[-1] * stroke / stroke[-1]).max() / np.abs(force).max())
