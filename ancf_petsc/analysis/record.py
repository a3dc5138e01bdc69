"""What a run leaves: one row of each table and one step of the fields per output."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ancf_petsc.analysis.build import Built
from ancf_petsc.analysis.output_points import OutputPoints
from ancf_petsc.axes import AXES
from ancf_petsc.errors import writing
from ancf_petsc.input.schema import CaseSpec
from ancf_petsc.model.assembly import Assembly
from ancf_petsc.model.measures import mean_position, mean_stress, reaction, von_mises
from ancf_petsc.parallel.exchange import ToSlabs, combined, on_root
from ancf_petsc.plan.curve import STROKE
from ancf_petsc.plan.probes import name_of
from ancf_petsc.results.rollback import GoesOn, position_of
from ancf_petsc.results.store import ResultStore
from ancf_petsc.results.tables import CsvTable

COUNTS = ("newton_iterations", "linear_iterations", "steps")
"""Columns of what a run did since its last output."""


class Record:
    """Writes outputs into a folder. Every method is collective."""

    def __init__(
        self,
        folder: Path,
        spec: CaseSpec,
        built: Built,
        assembly: Assembly,
        version: str,
        facts: Mapping[str, str] | None = None,
        goes_on: GoesOn | None = None,
    ) -> None:
        """facts: attributes of results.h5, on the root rank. goes_on: with files that stand at a checkpoint."""
        self._goes_on = goes_on is not None
        self.folder = folder
        self.spec = spec
        self.built = built
        self.assembly = assembly
        self.comm = assembly.comm
        self.row: dict[str, float] = {}
        self._tables: dict[str, CsvTable] = {}
        order, numbering = built.order, assembly.model.numbering
        self._points = OutputPoints(assembly, order)
        own = np.flatnonzero(numbering.own_cells)
        self._cells = ToSlabs(self.comm, numbering.file_cells[own], order.total_cells, of=own)
        self._store = ResultStore(
            folder,
            self.comm,
            spec.title,
            spec.units,
            note=spec.note,
            version=version,
            facts=facts,
            goes_on=goes_on,
        )
        self._store.write_mesh(
            order.points, order.kind, order.cells, order.node_numbers, order.cell_numbers, order.groups
        )

    def close(self) -> None:
        """Close the files."""
        for table in self._tables.values():
            table.close()
        self._store.close()

    def position(self) -> dict[str, Any]:
        """On the root rank what takes the files back to where they stand now; empty on the others. Collective."""
        found = on_root(self.comm, lambda: position_of(self.folder, self._store.numbers))
        return {"steps": self._store.steps, **found} if found else {}

    def write(
        self,
        time: Mapping[str, float],
        x: PETSc.Vec,
        out_of_balance: NDArray,
        more: Mapping[str, float],
        node_fields: Mapping[str, NDArray] | None = None,
    ) -> dict[str, float]:
        """One output at the state x. time: the one column of time; more: columns the solver knows.

        node_fields: further fields (n, 3) on owned nodal vectors. Returns the row of the curve.
        """
        strain, cauchy, det = self.assembly.fields(x)
        row = {**time, **self.curve(x, out_of_balance), **self._stress_force(cauchy)}
        row |= self._energies(x, more) | {"min_det_F": combined(self.comm, det.min(initial=np.inf), MPI.MIN)}
        row |= {name: value for name, value in more.items() if name not in row} | self._reactions(
            out_of_balance
        )
        rows = {"curve.csv": row}
        if self.spec.probe:
            rows["probes.csv"] = {**time, **self._probes(x)}
        positions, model = self.assembly.along_axes(x.array_r.reshape(-1, 3)), self.assembly.model
        nodes = {"displacement": positions - model.reference[: model.owned], **(node_fields or {})}
        points = {name: self._points(rows) for name, rows in nodes.items()}
        if model.element.has_slopes:
            points["slopes"] = self._points.slopes(positions)
        cells = {"det_F": det, "von_mises": von_mises(cauchy), "cauchy": cauchy, "green_lagrange": strain}
        del strain, cauchy
        (now,) = time.values()
        self._store.prepare_step(_widths(points), _widths(cells))
        on_root(self.comm, lambda: self._append(rows))
        self._store.write_step(now, points, self._cell_fields(cells))
        self.row = row
        return row

    def _cell_fields(self, cells: dict[str, NDArray]) -> Iterator[tuple[str, NDArray]]:
        """Fields of this rank's cells on its slab of the file's, one after the other for the sake of memory."""
        while cells:
            name, rows = cells.popitem()
            rows = self._cells(rows, np.zeros((len(self.built.order.cells), *rows.shape[1:])))
            yield name, rows

    def curve(self, x: PETSc.Vec, out_of_balance: NDArray) -> dict[str, float]:
        """Stroke and force of the whole body, empty if the case asks for no curve."""
        chosen = self.built.curve
        if chosen is None:
            return {}
        force = reaction(self.assembly, out_of_balance, chosen.force_group)[chosen.force_axis]
        return {
            "stroke": mean_position(self.assembly, x, STROKE)[1][chosen.stroke_axis],
            "force": self.spec.output.symmetry * force,
        }

    def _stress_force(self, cauchy: NDArray) -> dict[str, float]:
        """The paper's force: mean stress times undeformed area."""
        chosen = self.built.curve
        if chosen is None or chosen.area is None:
            return {}
        stress = mean_stress(self.assembly, cauchy, chosen.force_group, chosen.force_axis)
        return {"force_stress_area": self.spec.output.symmetry * stress * chosen.area}

    def _energies(self, x: PETSc.Vec, more: Mapping[str, float]) -> dict[str, float]:
        """Energies and work of the whole body: symmetry counts."""
        symmetry = self.spec.output.symmetry
        given = {name: value for name, value in more.items() if name.endswith(("_energy", "_work", "_drift"))}
        whole = {"strain_energy": self.assembly.strain_energy(x), **given}
        return {name: symmetry * value for name, value in whole.items()}

    def _reactions(self, out_of_balance: NDArray) -> dict[str, float]:
        columns: dict[str, float] = {}
        for group in dict.fromkeys(spec.group for spec in self.spec.constraint):
            total = self.spec.output.symmetry * reaction(self.assembly, out_of_balance, group)
            columns |= {f"{group}.r{axis}": total[i] for i, axis in enumerate(AXES)}
        return columns

    def _probes(self, x: PETSc.Vec) -> dict[str, float]:
        columns: dict[str, float] = {}
        for probe in self.spec.probe:
            position, displacement = mean_position(self.assembly, x, name_of(probe))
            columns |= {f"{probe.name}.{axis}": position[i] for i, axis in enumerate(AXES)}
            columns |= {f"{probe.name}.u{axis}": displacement[i] for i, axis in enumerate(AXES)}
        return columns

    def _append(self, rows: Mapping[str, Mapping[str, float]]) -> None:
        """Add a row to each table. On the root rank."""
        for file, row in rows.items():
            path = self.folder / file
            with writing(path):
                if file not in self._tables:
                    self._tables[file] = CsvTable(path, list(row), goes_on=self._goes_on)
                self._tables[file].append(row)


def _widths(fields: Mapping[str, NDArray]) -> dict[str, int]:
    """Numbers a row of each field."""
    return {name: math.prod(rows.shape[1:]) for name, rows in fields.items()}
