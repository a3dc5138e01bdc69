"""The end of a run: what its summary says, whether it came to its end or not."""

from __future__ import annotations

import logging
import resource
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ancf_petsc.analysis.build import Built
from ancf_petsc.analysis.host.clock import Clock
from ancf_petsc.analysis.provenance import Provenance
from ancf_petsc.errors import AncfError, Interrupted, Stopped, writing
from ancf_petsc.input.load import Case
from ancf_petsc.parallel.exchange import agree
from ancf_petsc.results.folder import write_summary
from ancf_petsc.results.mark import Mark

log = logging.getLogger("ancf")


@dataclass(frozen=True)
class Ending:
    """Where and about what. about, mark: on the root rank, None on the others."""

    folder: Path
    clock: Clock
    about: Provenance | None
    mark: Mark | None

    def write(
        self,
        case: Case,
        built: Built,
        totals: Mapping[str, int],
        final: Mapping[str, float],
        facts: Mapping[str, Any],
        failure: AncfError | None,
    ) -> None:
        """Write summary.json. Collective. Raises EnvironmentProblem, but not over the error that ended the run.

        totals: counts of the whole run; final: the curve's last row; facts: what the solver adds; failure:
        what ended the run early, None where nothing did.
        """
        comm = built.model.comm
        memory = comm.gather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
        dof = built.model.dof
        broken = failure is not None or sys.exc_info()[0] is not None
        status = "interrupted" if isinstance(failure, Interrupted) else "stopped" if broken else "done"

        seconds = self.clock.report()
        log.debug("seconds: %s", ", ".join(f"{part} {spent:.3g}" for part, spent in seconds.items()))
        more: dict[str, Any] = {"note": case.spec.note, "steps": totals["steps"], **facts}
        if failure is not None:
            more["reason"] = str(failure)
        more["end"] = end_of(failure, facts.get("end"))

        def write() -> None:
            if comm.rank or self.about is None or self.mark is None:
                return
            self.mark.make_room()
            about = self.about.summary()
            with writing(self.folder / "summary.json"):
                write_summary(
                    self.folder,
                    title=case.spec.title,
                    status=status,
                    seconds=seconds,
                    memory_peak_bytes=memory,
                    nodes=built.order.total_nodes,
                    elements=built.order.total_cells,
                    dof=dof,
                    ranks=comm.size,
                    iterations={
                        "newton": totals["newton_iterations"],
                        "linear": totals["linear_iterations"],
                    },
                    final=dict(final),
                    versions=about.pop("versions"),
                    **more,
                    **about,
                )

        try:
            agree(comm, write)
        except AncfError as error:
            if not broken:
                raise
            log.warning("%s", error)


def end_of(failure: AncfError | None, known: Mapping[str, Any] | None) -> dict[str, Any]:
    """How the run ended, in a form that programs read: kind, message in one line, and what the solver knows of it."""
    if failure is None:
        kind, message = "reached", "the end was reached"
    elif isinstance(failure, Interrupted):
        kind, message = "interrupted", str(failure)
    else:
        kind, message = ("diverged" if isinstance(failure, Stopped) else "environment"), str(failure)
    more = dict(failure.facts) if isinstance(failure, Stopped) else {}
    return {"kind": kind, "message": message, **(known or {}), **more}
