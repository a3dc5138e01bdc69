"""A second process loads every kernel from the cache and compiles none."""

from __future__ import annotations

PROGRAM = """
import gc, sys
from numba.core.registry import CPUDispatcher
from ancf_petsc import load_case, run
run(load_case(sys.argv[1], ["statics.steps=1"]), sys.argv[2])
loops = [item for item in gc.get_objects() if isinstance(item, CPUDispatcher)]
hits = sum(sum(loop.stats.cache_hits.values()) for loop in loops)
misses = {loop.__qualname__: dict(loop.stats.cache_misses) for loop in loops if loop.stats.cache_misses}
print(hits, len(misses), misses)
"""


def test_second_process_finds_all_kernels_compiled(mpirun, project, tmp_path):
    for number in (1, 2):
        done = mpirun(1, ["-c", PROGRAM, project / "cases/pvc_block", tmp_path / f"run{number}"])
    hits, misses, *which = done.stdout.split()
    assert int(hits) >= 6
    assert int(misses) == 0, which
