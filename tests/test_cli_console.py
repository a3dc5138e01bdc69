"""Tables on the terminal."""

import subprocess
import sys

from ancf_petsc.cli.console import show_facts, show_table
from ancf_petsc.launcher import environment


def test_tables_show_numbers_in_six_digits_on_the_right(capsys):
    show_table(["stroke", "name"], [[0.0250000001, "top [x]"], [1, None]], title="forces")
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert lines[0] == "forces"
    assert lines[-2].split() == ["0.025", "top", "[x]"]
    assert lines[-1].index("1") + 1 == lines[-2].index("0.025") + len("0.025")


def test_facts_are_a_line_each(capsys):
    show_facts([("ranks", 2), ("mumps", True)], title="machine")
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert lines == ["machine", "ranks  2", "mumps  yes"]


def test_a_file_behind_mpiexec_gets_no_codes_for_terminals(tmp_path):
    """Open MPI's ranks write to a terminal, whatever its own output is."""
    program = "from ancf_petsc.cli.console import show_facts; show_facts([('ranks', 2)], title='machine')"
    with (tmp_path / "out").open("wb") as out:
        command = ["mpiexec", "-n", "1", sys.executable, "-c", program]
        subprocess.run(command, stdout=out, env=environment() | {"TERM": "xterm"}, check=True, timeout=120)
    assert (tmp_path / "out").read_text().split() == ["machine", "ranks", "2"]
