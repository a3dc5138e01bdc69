"""What a run will need of memory: bounds above the peaks of cubes of 9,670, 73,606 and 478,059 elements 3413.

`ancf bench memory_480k` measures the largest again; every run's summary.json has its own peaks.
"""

PER_RUN = 0.25e9
PER_ELEMENT = 1.2e3
PER_FREEDOM = 2.4e3


def memory_estimate(cells: int, dof: int) -> float:
    """Bytes of a static run on one rank with the default solver; every further rank adds PER_RUN."""
    return PER_RUN + PER_ELEMENT * cells + PER_FREEDOM * dof
