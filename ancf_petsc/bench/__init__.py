"""Benchmarks: timed configurations with known answers, each in processes of its own.

`catalog` lists them, `suite` runs them, `worker` is what a process does; `measure`, `kernels` and
`messages` hold the stopwatch.
"""
