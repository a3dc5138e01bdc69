"""Starting programs on several ranks: mpiexec, and the environment it needs on any machine."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from ancf_petsc.errors import EnvironmentProblem

OF_A_LAUNCHER = ("OMPI_COMM_", "OMPI_UNIVERSE", "OMPI_FIRST", "PMIX_", "PMI_")


FOR_ONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_osc": "^ucx",
}
"""What keeps Open MPI from a daemon and from looking for networks; other MPIs do not read it."""


@contextmanager
def quick_if_alone() -> Iterator[None]:
    """Around the import of mpi4py, which starts MPI: a process that no launcher started needs no way to others.

    The environment is afterwards what it was, for processes started from this one. What is set already stays.
    """
    launched = any(name.startswith(OF_A_LAUNCHER) for name in os.environ)
    added = [] if launched else [name for name in FOR_ONE if name not in os.environ]
    os.environ.update((name, FOR_ONE[name]) for name in added)
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


def environment() -> dict[str, str]:
    """This process's environment for ranks of their own: containers run as root and may have one core."""
    own = {name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)}
    allowed = {
        "OMP_NUM_THREADS": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    }
    if os.geteuid() == 0:
        allowed |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return own | allowed


def on_ranks(count: int, command: Sequence[str]) -> list[str]:
    """The command on `count` ranks; one rank needs no launcher. Raises EnvironmentProblem without mpiexec."""
    if count == 1:
        return list(command)
    launcher = shutil.which("mpiexec")
    if launcher is None:
        raise EnvironmentProblem("mpiexec was not found: install Open MPI or MPICH")
    return [launcher, "-n", str(count), *command]


# fmt: off
GENERAL_OPTIONS = frozenset(
    {
        "blas_num_threads", "blas_view", "check_pointer_intensity",
        "checkfunctionlist", "checkstack", "citations", "cuda_device",
        "debug_terminal", "debugger_nodes", "debugger_pause", "debugger_ranks",
        "default_device_type", "device_context_device_type",
        "device_context_stream_type", "device_enable", "device_select", "device_view",
        "display", "error_output_none", "error_output_stdout", "fp_trap",
        "get_total_flops", "help", "hip_device", "history", "info", "info_exclude",
        "log_all", "log_exclude", "log_exclude_actions", "log_include",
        "log_include_actions", "log_mpe", "log_nvtx", "log_perfstubs", "log_roctx",
        "log_summary", "log_sync", "log_threadsafe", "log_trace", "log_view",
        "log_view_gpu_energy", "log_view_gpu_energy_meter", "log_view_gpu_time",
        "log_view_memory", "malloc", "malloc_coalesce", "malloc_debug", "malloc_dump",
        "malloc_hbw", "malloc_info", "malloc_log", "malloc_log_threshold",
        "malloc_requested_size", "malloc_test", "malloc_view",
        "malloc_view_threshold", "memory_info", "memory_view", "mpi_return_on_error",
        "mpidump", "mpiuni-allow-multiprocess-launch", "no_signal_handler",
        "not_shared_tmp", "nox", "nox_warning", "objects_dump", "omp_num_threads",
        "omp_view", "on_error_abort", "on_error_attach_debugger", "on_error_emacs",
        "on_error_mpiabort", "options_file", "options_file_yaml", "options_left",
        "options_monitor", "options_monitor_cancel", "options_string_yaml",
        "options_suppress_deprecated_warnings", "options_table", "options_view",
        "petsc_ci", "petsc_ci_portable_error_output", "prefix_pop", "prefix_push",
        "process_view", "python", "root_device_context_device_type",
        "root_device_context_stream_type", "saws_options", "shared_tmp",
        "skip_petscrc", "splitreduction_async", "stack_view", "start_in_debugger",
        "stop_for_debugger", "sycl_device", "tmp", "use_gpu_aware_mpi", "version",
        "viewfromoptions", "x_virtual",
    }
)
# fmt: on
"""What PETSc itself reads, whatever a program does: at its start, at its end, and of its log, memory and errors
(PetscInitialize and PetscFinalize, releases 3.18 to 3.26). Without the leading dash.
"""


def is_general_option(name: str) -> bool:
    """Whether an option is one of PETSc's own, which no solver asks for and which changes no number."""
    return name.lower() in GENERAL_OPTIONS


def start_petsc(options: Mapping[str, object]) -> None:
    """Start PETSc with those of the options that it reads at its start. Without effect where it runs already."""
    words = [
        word
        for name, value in options.items()
        if is_general_option(name) and value is not False
        for word in (f"-{name}", *([] if value is True or value is None else [str(value)]))
    ]
    if words:
        import petsc4py

        petsc4py.init(["ancf", *words])
