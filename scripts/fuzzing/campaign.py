"""A campaign: which inputs are tried, by which processes, what is counted and kept."""

from __future__ import annotations

import json
import os
import selectors
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty, Queue
from typing import Any

from fuzzing.seeds import PROJECT
from fuzzing.tally import SHARES, outcome, shown, tally

RESULTS = PROJECT / "docs" / "verification" / "fuzz.json"
LONGEST = 10.0
"""Seconds of processor time that an input may take."""
PATIENCE = 60.0
"""Seconds in which none of a worker's processes has had anything to do: it waits for something that never comes."""
LOOK = 5.0
STARTING = 900.0


class Worker:
    """A process of fuzzing.worker, started when it is needed and again when it died."""

    def __init__(self, seeds: Path, room: Path) -> None:
        self.seeds, self.room = seeds, room
        self.process: subprocess.Popen | None = None

    def _start(self) -> subprocess.Popen:
        self.room.mkdir(parents=True, exist_ok=True)
        program = Path(__file__).with_name("worker.py")
        log = (self.room / "worker.log").open("a")
        environment = dict(os.environ) | {
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
            "PYVISTA_OFF_SCREEN": "true",
        }
        environment.setdefault("ANCF_CACHE_DIR", str(Path.home() / ".cache"))
        process = subprocess.Popen(
            [sys.executable, str(program), str(self.seeds), str(self.room)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True, cwd=self.room, env=environment,
            start_new_session=True,
        )  # fmt: skip
        log.close()
        if _line(process, STARTING) is None:
            raise SystemExit(f"a worker does not start: see {self.room / 'worker.log'}")
        return process

    def attempt(self, kind: str, seed: int, number: int, longest: float = LONGEST) -> dict[str, Any]:
        if self.process is None:
            self.process = self._start()
        assert self.process.stdin
        begun = time.perf_counter()
        try:
            self.process.stdin.write(json.dumps([kind, seed, number]) + "\n")
            self.process.stdin.flush()
            line = self._answer(self.process, longest)
        except BrokenPipeError:
            line = ""
        if line:
            answer = json.loads(line)
            if answer["busy"] > longest:
                answer["wrong"].append(f"takes {answer['busy']:.1f} s")
            return answer
        what = "hangs" if line is None else "crash"
        code = self.stop(dying=line == "")
        seconds = time.perf_counter() - begun
        wrong = [f"{what} (exit {code}) after {seconds:.1f} s"]
        unknown = {"grown": 0, "said": "", "second": "", "damage": ["unknown"], "words": []}
        return {"code": what, "seconds": seconds, "busy": seconds, "wrong": wrong, **unknown}

    def _answer(self, process: subprocess.Popen, longest: float) -> str | None:
        """A line of the worker, empty where it has ended, None where it takes too long or waits for ever."""
        begun, still = session_load(process.pid)[0], 0.0
        while (line := _line(process, LOOK)) is None:
            busy, running = session_load(process.pid)
            still = 0.0 if running else still + LOOK
            # Making the input, and the second reader, take time too.
            if busy - begun > 2 * longest + 10.0 or still > PATIENCE:
                return None
        return line

    def stop(self, *, dying: bool = False) -> int | None:
        if self.process is None:
            return None
        process, self.process = self.process, None
        with process:
            if dying:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(5.0)
            process.kill()
        return process.returncode


def session_load(session: int) -> tuple[float, bool]:
    """Seconds of processor time of the processes of a session, and whether one of them has something to do."""
    busy, running = 0, False
    for place in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, IndexError, ValueError):
            words = place.read_text().rpartition(")")[2].split()
            if int(words[3]) == session:
                busy += sum(int(word) for word in words[11:15])
                running |= words[0] in "RD"
    return busy / os.sysconf("SC_CLK_TCK"), running


def _line(process: subprocess.Popen, seconds: float) -> str | None:
    """A line of the process, empty where it has ended, None where none comes in time."""
    assert process.stdout
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        if not selector.select(seconds):
            return None
    return process.stdout.readline()


class Campaign:
    """Counts of what was tried with a seed, kept in a folder after every hundred inputs."""

    def __init__(self, folder: Path, seed: int, *, keep: bool, again: bool, retry: bool = False) -> None:
        self.place = folder / f"seed{seed}" if keep else Path(tempfile.mkdtemp(prefix="ancf-fuzz-"))
        self.seed, self.keep = seed, keep
        if again and keep:
            shutil.rmtree(self.place, ignore_errors=True)
        self.seeds = self.place / "seeds"
        if not (self.seeds / "seeds.json").is_file():
            shutil.rmtree(self.seeds, ignore_errors=True)
            self.seeds.mkdir(parents=True)
            write_apart(self.seeds)
        self.done = self.place / "done.jsonl"
        self.findings = self.place / "findings.jsonl"
        if retry:
            kept = [row for row in self._rows() if row["outcome"] != "finding"]
            self.done.write_text("".join(json.dumps(row) + "\n" for row in kept))
            self.findings.unlink(missing_ok=True)

    def run(self, count: int, only: list[str], jobs: int) -> int:
        """Try what is left of `count` inputs; the number of findings."""
        kinds = only or list(SHARES)
        total = sum(SHARES[kind] for kind in kinds)
        counts = {kind: max(1, round(count * SHARES[kind] / total)) for kind in kinds}
        tried = {(row["kind"], row["number"]) for row in self._rows()}
        left: Queue = Queue()
        for kind in kinds:  # one after the other: a process then needs the libraries of few
            for number in range(counts[kind]):
                if (kind, number) not in tried:
                    left.put((kind, number))
        print(
            f"{len(tried)} inputs were tried before, {left.qsize()} are left; findings go to {self.findings}",
            flush=True,
        )
        lock = threading.Lock()
        threads = [threading.Thread(target=self._work, args=(job, left, lock)) for job in range(jobs)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        table = tally(
            [row for row in self._rows() if row["kind"] in counts and row["number"] < counts[row["kind"]]]
        )
        if self.keep and not only:
            RESULTS.write_text(json.dumps({"seed": self.seed, **table}, indent=1) + "\n")
        print(shown(table))
        if not self.keep:
            shutil.rmtree(self.place, ignore_errors=True)
        return table["findings"]

    def _rows(self) -> list[dict[str, Any]]:
        if not self.done.is_file():
            return []
        return [json.loads(line) for line in self.done.read_text().splitlines() if line.endswith("}")]

    def _work(self, job: int, left: Queue, lock: threading.Lock) -> None:
        worker = Worker(self.seeds, self.place / f"room{job}")
        try:
            while True:
                kind, number = left.get_nowait()
                answer = worker.attempt(kind, self.seed, number)
                if any(
                    "takes" in word or "hangs" in word for word in answer["wrong"]
                ):  # the machine may have been busy
                    answer = worker.attempt(kind, self.seed, number)
                with lock:
                    self._keep(kind, number, answer, left.qsize())
        except Empty:
            pass
        finally:
            worker.stop()

    def _keep(self, kind: str, number: int, answer: dict[str, Any], left: int) -> None:
        row = {"kind": kind, "number": number, "outcome": outcome(answer), "damage": answer["damage"], "second": answer["second"],
               "seconds": round(answer["busy"], 3), "grown": answer["grown"]}  # fmt: skip
        with self.done.open("a") as file:
            file.write(json.dumps(row) + "\n")
        if answer["wrong"]:
            with self.findings.open("a") as file:
                file.write(json.dumps({"kind": kind, "number": number, **answer}) + "\n")
            print(
                f"{kind} {number}: {' '.join(answer['damage'])}: {answer['wrong'][0].strip().splitlines()[-1][:180]}",
                flush=True,
            )
        if left % 1000 == 0:
            print(f"{left} left", flush=True)


def write_apart(folder: Path) -> None:
    """Make the seeds in a process of its own: Gmsh and MPI stay out of this one."""
    code = (
        "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); "
        "from fuzzing.seeds import write_seeds; write_seeds(Path(sys.argv[2]))"
    )
    command = [sys.executable, "-c", code, str(Path(__file__).resolve().parent.parent), str(folder)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def show_one(folder: Path, kind: str, seed: int, number: int) -> int:
    campaign = Campaign(folder, seed, keep=True, again=False)
    worker = Worker(campaign.seeds, campaign.place / "room-one")
    answer = worker.attempt(kind, seed, number, 60.0)
    worker.stop()
    print(f"input in {campaign.place / 'room-one' / 'outer/inner/box'}")
    for name in ("damage", "words", "code", "seconds", "grown", "second", "said"):
        print(f"{name}: {answer[name]}")
    print("\n".join(answer["wrong"]))
    return int(bool(answer["wrong"]))
