"""What loses its stability in a state: the material, a free surface, the body as a whole; or an element at a singular edge.

The mode of the lowest eigenvalue says where: its core are the cells that hold half of its squared gradient. There the state is
compared with what `material/limits` computes for the law, so that any law, mesh and kind of element is judged by the same rules.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.material.limits import critical_surface_stretch, ellipticity, uniaxial_limit
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.body import Region
from ancf_petsc.model.gradients import deformation_gradients, gradients, tangents
from ancf_petsc.model.surface import BodySurface, is_planar, surface_of
from ancf_petsc.parallel.exchange import combined
from ancf_petsc.solve.weakest import stretches

MARGIN = 1.01
"""Of a critical stretch: what lies between states of a path and mean strains of cells is not resolved."""
MOST_POINTS = 24
"""The most compressed cells of a rank that are looked at for ellipticity."""
COMPRESSED = 0.98
"""Surfaces stretched more are no candidates for folds."""
TABLE = 0.02
"""Of transverse stretches, between which critical ones are interpolated."""


@dataclass(frozen=True)
class Cause:
    """kind: material_limit, surface_fold or lost_definiteness. element: number in the file. place (3,): undeformed.

    stretch: found there; critical: the one it is below, None where the law is not elliptic any more or nothing is known. law: its
    name. at_edge: whether the element is at a singular edge.
    """

    kind: str
    element: int = -1
    place: tuple[float, ...] = ()
    stretch: float = 1.0
    critical: float | None = None
    law: str = ""
    at_edge: bool = False
    more: dict[str, Any] = field(default_factory=dict)

    def facts(self) -> dict[str, Any]:
        """For the summary."""
        if self.element < 0:
            return dict(self.more)
        found = {
            "critical_stretch": self.critical,
            "law": self.law,
            "at_singular_edge": self.at_edge,
            **self.more,
        }
        return {"element": self.element, "place": list(self.place), **found}

    def words(self) -> str:
        """The event; nothing where all that is known of it is the tangent."""
        if self.element < 0:
            return ""
        place = f"element {self.element} at ({', '.join(f'{c:.6g}' for c in self.place)})"
        edge = " at a singular edge (it turns inwards, or a bonded face ends there)" if self.at_edge else ""
        if self.kind == "surface_fold":
            return (
                f"the free surface folds: it is pressed to a stretch of {self.stretch:.3f} at {place}{edge}, and one of "
                f"{self.law} folds below {self.critical:.3f} in this state (Biot)"
            )
        if self.kind == "inverted_element":
            return f"{place} is pressed flat{edge}, det F {self.more['det_F']:.3g}"
        if self.critical is not None:
            what = f"has a stretch of {self.stretch:.3f}, and {self.law} carries no more force below {self.critical:.3f}"
        else:
            what = f"has a stretch of {self.stretch:.3f} where {self.law} is not elliptic any more: it shears off by itself"
        return f"the material is at its limit: {place}{edge} {what}"


def cause_of(assembly: Assembly, x: PETSc.Vec, mode: NDArray | None) -> Cause:
    """Of a state x that loses its stability in a mode (n, 3). None: of one that is stable as far as is known, so that only its
    material can be to blame, anywhere. Collective.
    """
    if assembly.model.element.is_beam:
        return Cause("lost_definiteness")
    body = _Body(assembly, x)
    core = body.core(mode)
    found = body.beyond_law(core)
    if found is None and mode is not None:
        found = body.folded(core)
    return found or Cause("lost_definiteness")


def flattened(assembly: Assembly, x: PETSc.Vec, least: float) -> Cause | None:
    """The cell of smallest det F at its quadrature points, where that is below `least`. Collective."""
    if assembly.model.element.is_beam:
        return None
    body = _Body(assembly, x)
    rule, cells = assembly.model.element.tables("default"), np.arange(len(assembly.model.cells))
    dets = [np.linalg.det(deformation_gradients(assembly.model, body.now, p, cells)) for p in rule.points]
    det = np.min(dets, axis=0) if len(cells) else np.empty(0)
    smallest = combined(assembly.comm, float(det.min(initial=np.inf)), MPI.MIN)
    if not smallest < least:
        return None
    return body.pick(
        "inverted_element", np.flatnonzero(det <= smallest + 1e-6), body.stretch, None, det_F=smallest
    )


class _Body:
    """A state with what is asked of it. now (v, 3): positions, owned ones and ghosts."""

    def __init__(self, assembly: Assembly, x: PETSc.Vec) -> None:
        self.assembly, self.model = assembly, assembly.model
        self.stretch, _ = stretches(assembly, x)
        self.now = assembly.local(x).copy()
        self.strain = assembly.fields(x)[0].reshape(-1, 3, 3)
        self.surface: BodySurface = surface_of(assembly)
        self.at_edge = self.surface.singular[self.model.position_cells()].any(axis=1)

    def core(self, mode: NDArray | None) -> NDArray[np.bool_]:
        """(e,) the cells of largest gradient that hold half of what all cells do."""
        model, comm = self.model, self.assembly.comm
        if mode is None:
            return np.ones(len(model.cells), bool)
        field_ = self.assembly.with_ghosts(mode, np.zeros_like(model.reference))
        rule, cells = model.element.tables("default"), np.arange(len(model.cells))
        density = np.zeros(len(cells))
        for weight, point in zip(rule.weights, rule.points, strict=True):
            density += weight * (gradients(model, field_, point, cells) ** 2).sum(axis=(1, 2))
        held = np.where(model.numbering.own_cells, density * model.volumes, 0.0)
        total = combined(comm, float(held.sum()))
        largest = combined(comm, float(density.max(initial=0.0)), MPI.MAX)
        low, high = 0.0, 1.0
        for _ in range(40):
            middle = (low + high) / 2
            enough = combined(comm, float(held[density >= middle * largest].sum())) >= total / 2
            low, high = (middle, high) if enough else (low, middle)
        return density >= low * largest * (1.0 - 1e-9)

    def beyond_law(self, core: NDArray[np.bool_]) -> Cause | None:
        """Cells of the core where the law carries no more, or is not elliptic."""
        model, weak = self.model, np.zeros(len(core), bool)
        limits: NDArray = np.full(len(core), np.nan)
        for region in model.regions:
            limit = uniaxial_limit(region.law, region.parameters)
            if limit is not None:
                limits[region.first : region.last] = limit
        weak |= core & (self.stretch <= MARGIN * limits)
        if not self._any(weak):
            limits[:] = np.nan
            weak = self._not_elliptic(core)
        if not self._any(weak):
            return None
        least = combined(self.assembly.comm, float(self.stretch[weak].min(initial=np.inf)), MPI.MIN)
        chosen = np.flatnonzero(weak & (self.stretch <= least * (1 + 1e-6)))
        return self.pick("material_limit", chosen, self.stretch, limits)

    def _not_elliptic(self, core: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(e,) of the most compressed cells of the core: at the point of smallest stretch of each."""
        model, weak = self.model, np.zeros(len(core), bool)
        cells = np.flatnonzero(core)
        cells = cells[np.argsort(self.stretch[cells], kind="stable")[:MOST_POINTS]]
        if not len(cells):
            return weak
        F = np.stack(
            [deformation_gradients(model, self.now, p, cells) for p in model.element.tables("default").points]
        )
        worst = np.linalg.svd(F, compute_uv=False)[..., -1].argmin(axis=0)
        for k, e in enumerate(cells):
            region = self._region(e)
            weak[e] = ellipticity(region.law, region.parameters, F[worst[k], k]) <= 0.0
        return weak

    def folded(self, core: NDArray[np.bool_]) -> Cause | None:
        """Free faces of the core that are shortened below what a surface of the law bears."""
        surface = self.surface
        rows = np.flatnonzero(surface.free & core[surface.cell])
        along, transverse = self._in_surface(rows)
        planar = is_planar(self.assembly)
        critical = np.full(len(rows), np.nan)
        for region in self.model.regions:
            cell = surface.cell[rows]
            mine = np.flatnonzero((cell >= region.first) & (cell < region.last) & (along < COMPRESSED))
            critical[mine] = _critical(region, transverse[mine], in_plane=planar)
        beyond = along <= MARGIN * critical
        if not self._any(beyond):
            return None
        excess = np.where(beyond, along / critical, np.inf)
        least = combined(self.assembly.comm, float(excess.min(initial=np.inf)), MPI.MIN)
        chosen = np.flatnonzero(excess <= least * (1 + 1e-6))
        cells = surface.cell[rows[chosen]]
        by_cell, limits = np.ones(len(core)), np.full(len(core), np.nan)
        by_cell[cells], limits[cells] = along[chosen], critical[chosen]
        return self.pick("surface_fold", cells, by_cell, limits)

    def _in_surface(self, rows: NDArray) -> tuple[NDArray, NDArray]:
        """Smaller and larger principal stretch (f,) in boundary faces, at the point where the smaller one is smallest; in the plane
        the larger one is the cell's across the plane.
        """
        model, surface = self.model, self.surface
        row = model.element
        along, transverse = np.full(len(rows), np.inf), np.ones(len(rows))
        for number, facet in enumerate(row.cell.facets):
            mine = np.flatnonzero(surface.facet[rows] == number)
            cells = surface.cell[rows[mine]]
            ends = np.array([row.cell.corners[c] for c in facet], float)
            ways = (ends[[1, -1]] if len(facet) > 2 else ends[[1]]) - ends[0]
            for point in row.part_tables(facet, 2 if row.is_curved else 1).points:
                before = tangents(model, model.reference, point, ways, cells)
                after = tangents(model, self.now, point, ways, cells)
                squares = _principal(before, after)
                smaller = np.sqrt(squares[:, 0])
                larger = np.sqrt(squares[:, 1]) if len(facet) > 2 else self._across(before, cells)
                better = smaller < along[mine]
                along[mine[better]], transverse[mine[better]] = smaller[better], larger[better]
        return along, transverse

    def _across(self, edges: NDArray, cells: NDArray) -> NDArray:
        """Stretch across the plane (m,) of plane cells."""
        drive = self.model.drive[: self.model.owned] >= 0
        axis = np.eye(3)[int(combined(self.assembly.comm, drive.sum(axis=0)).argmax())]
        squares = 1.0 + 2.0 * np.einsum("eij,i,j->e", self.strain[cells], axis, axis)
        return np.sqrt(np.maximum(squares, 0.0))

    def pick(self, kind: str, cells: NDArray, stretch: NDArray, limits: NDArray | None, **more: Any) -> Cause:
        """Of equal cells the one with the lowest number. Collective."""
        model = self.model
        best: tuple[int, Cause | None] = (np.iinfo(np.int64).max, None)
        if len(cells):
            e = int(cells[np.argmin(model.cell_numbers[cells])])
            place = model.origin + model.reference[model.position_cells()[e]].mean(axis=0)
            limit = None if limits is None or np.isnan(limits[e]) else float(limits[e])
            cause = Cause(
                kind,
                int(model.cell_numbers[e]),
                tuple(map(float, place)),
                float(stretch[e]),
                limit,
                self._region(e).law.name,
                bool(self.at_edge[e]),
                more,
            )
            best = (cause.element, cause)
        found = min(self.assembly.comm.allgather(best), key=lambda item: item[0])[1]
        assert found is not None
        return found

    def _region(self, e: int) -> Region:
        return next(region for region in self.model.regions if region.first <= e < region.last)

    def _any(self, marks: NDArray[np.bool_]) -> bool:
        return bool(combined(self.assembly.comm, int(marks.sum())))


def _principal(before: NDArray, after: NDArray) -> NDArray:
    """Squared principal stretches (m, t), ascending, of tangents (m, t, 3) of a surface."""
    one, other = (np.einsum("eti,esi->ets", t, t) for t in (before, after))
    if not len(one):
        return np.ones((0, before.shape[1]))
    inverse = np.linalg.inv(np.linalg.cholesky(one))
    return np.maximum(np.linalg.eigvalsh(inverse @ other @ np.swapaxes(inverse, 1, 2)), 0.0)


def _critical(region: Region, transverse: NDArray, *, in_plane: bool) -> NDArray:
    """Critical stretches (m,) of free surfaces, interpolated between multiples of TABLE; nan where there is none."""
    if not len(transverse):
        return np.empty(0)
    steps = np.unique(np.concatenate((np.floor(transverse / TABLE), np.ceil(transverse / TABLE))))
    found = [
        critical_surface_stretch(region.law, region.parameters, float(k * TABLE), in_plane=in_plane)
        for k in steps
    ]
    values = np.array([np.nan if value is None else value for value in found])
    return np.interp(transverse, steps * TABLE, values)
