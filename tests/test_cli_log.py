"""The log: the same lines on the terminal and in log.txt, from the root rank only."""

import logging
import subprocess
import sys

import pytest

from ancf_petsc import log

LOGGER = logging.getLogger("ancf")


@pytest.fixture(autouse=True)
def quiet_again():
    yield
    log.close()
    LOGGER.propagate = True
    LOGGER.setLevel(logging.NOTSET)


def test_lines_before_the_folder_is_known_are_in_the_file_too(tmp_path, capsys):
    log.configure()
    LOGGER.info("early")
    log.attach_file(tmp_path / "log.txt")
    LOGGER.info("late %d", 3)
    LOGGER.warning("odd")
    expected = "early\nlate 3\nwarning: odd\n"
    assert (tmp_path / "log.txt").read_text() == expected
    assert capsys.readouterr().out == expected


def test_other_ranks_are_silent(tmp_path, capsys):
    log.configure(rank=1)
    LOGGER.error("nobody hears this")
    log.attach_file(tmp_path / "log.txt")
    assert capsys.readouterr() == ("", "")
    assert not (tmp_path / "log.txt").exists()


@pytest.mark.parametrize(("verbosity", "shown"), [(-1, "W"), (0, "IW"), (1, "DIW")])
def test_verbosity_rules_the_terminal_and_the_file_has_the_course(tmp_path, capsys, verbosity, shown):
    log.configure(tmp_path, verbosity=verbosity)
    for level, line in ((logging.DEBUG, "D"), (logging.INFO, "I"), (logging.WARNING, "W")):
        LOGGER.log(level, line)
    told = capsys.readouterr().out.replace("warning: ", "").replace("\n", "")
    assert told == shown
    assert {"I", "warning: W"} <= set((tmp_path / "log.txt").read_text().split("\n"))


def test_without_a_terminal_there_is_no_bar_and_every_step_is_a_line(capsys):
    log.configure()
    with log.progress(2, "s") as bar:
        for k in (1, 2):
            logging.getLogger(log.STEPS).info("step %d", k)
            bar.advance_to(k)
    assert capsys.readouterr().out == "step 1\nstep 2\n"


BAR = """
import logging, sys
from ancf_petsc import log
log.on_terminal = lambda: True
log.configure(sys.argv[1])
with log.progress(2, "s") as bar:
    logging.getLogger("ancf.step").info("a step")
    logging.getLogger("ancf").warning("a warning")
    bar.advance_to(1, "force 3 N")
"""


def test_beside_a_bar_steps_are_in_the_file_only_and_warnings_in_both(tmp_path):
    environment = {"FORCE_COLOR": "1", "TERM": "xterm", "PYTHONPATH": ":".join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", BAR, tmp_path], capture_output=True, text=True, env=environment, check=True
    )
    assert (tmp_path / "log.txt").read_text() == "a step\nwarning: a warning\n"
    assert "warning: a warning" in done.stdout
    assert "a step" not in done.stdout
    assert "%" in done.stdout


def test_a_reader_that_leaves_stops_neither_the_run_nor_its_file(tmp_path):
    code = f"""
import logging
from ancf_petsc import log
log.configure({str(tmp_path)!r})
for k in range(20000):
    logging.getLogger("ancf").info("line %d", k)
"""
    environment = {"PYTHONPATH": ":".join(sys.path)}
    command = ["bash", "-c", f'"{sys.executable}" -c "$1" | true; exit "${{PIPESTATUS[0]}}"', "-", code]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "log.txt").read_text().splitlines()[-1] == "line 19999"
