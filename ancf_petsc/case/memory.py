"""What a run will need of memory, from measured figures (scripts/measure_memory.py prints them again)."""

PER_RUN = 0.25e9
PER_ELEMENT = 1.5e3
PER_FREEDOM = 0.6e3


def memory_estimate(cells: int, dof: int) -> float:
    """Bytes over all ranks for a static run with the default solver."""
    return PER_RUN + PER_ELEMENT * cells + PER_FREEDOM * dof
