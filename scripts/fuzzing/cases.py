"""Case files: valid ones with other keys, values, types, nesting, made by hypothesis, then damaged as text."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

PROJECT = Path(__file__).resolve().parent.parent.parent
PIECE = 100
"""Cases of one run of hypothesis: any piece can be made again by itself."""

WORDS = st.sampled_from(
    (
        *(
            "x",
            "y",
            "z",
            "min",
            "max",
            "low",
            "high",
            "svk",
            "neo_hooke",
            "cosine",
            "linear",
            "constant",
            "critical",
            "gravity",
            "force",
        ),
        *(
            "",
            " ",
            "nan",
            "../x",
            "/etc/passwd",
            "a.b",
            "top.z",
            "\u00e9",
            "\n",
            "\0",
            "x" * 3000,
            "%s{0}",
            "3413",
            "3843",
            "1222",
            "2432",
        ),
    )
)
EXTREME = st.sampled_from(
    (
        0,
        -1,
        1,
        2,
        3,
        8,
        100,
        10**6,
        10**9,
        2**31,
        2**63,
        10**18,
        10**400,
        0.5,
        -0.0,
        1e-300,
        1e300,
        1e15,
        1e-9,
        math.nan,
        math.inf,
        -math.inf,
    )
)
LEAVES = st.one_of(
    EXTREME, st.integers(), st.floats(), st.booleans(), WORDS, st.text(max_size=20), st.just(date(2020, 1, 1))
)
KEYS = st.one_of(WORDS, st.text(max_size=8))
JUNK = st.recursive(
    LEAVES,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(KEYS, inner, max_size=3)),
    max_leaves=8,
)
SCALES = st.sampled_from((-1.0, 0.0, 1e-3, 1e3, 1e9, 1e-12, 1e150, 2.0))


def bases() -> list[dict[str, Any]]:
    """The project's cases on the cube of the seeds, and one that has many keys."""
    import tomllib

    from fuzzing.seeds import CASE

    found = []
    for path in sorted((PROJECT / "cases").glob("*/*.toml")):
        data = tomllib.loads(path.read_text())
        if "mesh" not in data or data["mesh"]["element"] not in ("3413", "3-10-1-3", "3443", "3443+4"):
            continue
        names = {
            row["group"]
            for key in ("constraint", "load", "probe")
            for row in data.get(key, ())
            if "group" in row
        }
        groups = {
            name: {"plane": "xyz"[k % 3], "at": ("min", "max")[k % 2]} for k, name in enumerate(sorted(names))
        }
        found.append({**data, "mesh": {**data["mesh"], "file": "cube.vtu"}, "groups": groups})
    motion = {key: value for key, value in CASE.items() if key != "statics"}
    motion["material"] = {**CASE["material"], "density": 1000.0}
    motion |= {
        "dynamics": {
            "duration": 0.1,
            "integrator": "generalized_alpha",
            "step": 0.01,
            "damping": 0.5,
            "outputs": 3,
        },
        "initial": {"velocity": [0.0, 0.0, 1.0], "spin": [0.0, 0.0, 1.0]},
        "load": [
            {"type": "gravity", "acceleration": [0.0, 0.0, -9.81]},
            {"type": "force", "group": "high", "total": [1.0, 0.0, 0.0]},
        ],
        "petsc": {"ksp_type": "cg"},
    }
    mesh = {"file": "cube.vtu", "element": "3413"}
    made = {"body": "cube", "element": "3413", "divisions": [1, 1, 1], "refine": 1}
    return [{**CASE, "mesh": mesh}, {**motion, "mesh": mesh}, {**CASE, "mesh": made}, *found]


def _places(data: Any, path: tuple = ()) -> list[tuple]:
    found = [path] if path else []
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        found += _places(value, (*path, key))
    return found


def _changed(data: Any, path: tuple, change: Any) -> Any:
    """A copy in which change(container, key) was applied to what a path leads to."""
    if isinstance(data, dict):
        copy: Any = dict(data)
    else:
        copy = list(data)
    if len(path) == 1:
        change(copy, path[0])
    else:
        copy[path[0]] = _changed(copy[path[0]], path[1:], change)
    return copy


def _remove(container: Any, key: Any) -> None:
    del container[key]


def _nested(value: Any, depth: int) -> Any:
    for _ in range(depth):
        value = [value]
    return value


@st.composite
def changed_cases(draw: Any, known: list[dict[str, Any]]) -> dict[str, Any]:
    """A valid case with up to four changes."""
    data: Any = draw(st.sampled_from(known))
    for _ in range(draw(st.sampled_from((0, 1, 1, 1, 2, 4)))):
        places = _places(data)
        if not places:
            break
        path = draw(st.sampled_from(places))
        way = draw(
            st.sampled_from(
                (
                    "value",
                    "value",
                    "value",
                    "scale",
                    "scale",
                    "remove",
                    "wrap",
                    "rename",
                    "add",
                    "copy",
                    "twice",
                )
            )
        )
        data = _changed(data, path, _change_of(draw, way, data, places))
    return data


def _change_of(draw: Any, way: str, data: Any, places: list[tuple]) -> Any:
    def put(container: Any, key: Any) -> None:
        old = container[key]
        if way == "value":
            container[key] = draw(JUNK)
        elif way == "scale":
            number = isinstance(old, int | float) and not isinstance(old, bool)
            container[key] = old * draw(SCALES) if number else draw(EXTREME)
        elif way == "wrap":
            container[key] = _nested(old, draw(st.sampled_from((1, 2, 30, 300))))
        elif way == "copy":
            container[key] = _at(data, draw(st.sampled_from(places)))
        elif way == "twice":
            container[key] = [old, old] if not isinstance(old, list) else old + old
        elif isinstance(container, dict):
            container[draw(KEYS)] = container.pop(key) if way == "rename" else draw(JUNK)

    return _remove if way == "remove" else put


def _at(data: Any, path: tuple) -> Any:
    for key in path:
        data = data[key]
    return data


def piece_of_cases(number: int) -> list[dict[str, Any]]:
    """The cases of a piece, the same each time."""
    found: list[dict[str, Any]] = []

    @seed(number)
    @settings(
        max_examples=PIECE + 5,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(changed_cases(bases()))
    def collect(data: dict[str, Any]) -> None:
        found.append(data)

    collect()
    return [found[k % len(found)] for k in range(PIECE)]


def write_toml(data: dict[str, Any]) -> str:
    """TOML of anything; what TOML has no word for becomes text."""
    plain = [f"{_key(key)} = {_value(value)}" for key, value in data.items() if not isinstance(value, dict)]
    tables = [
        f"[{_key(key)}]\n" + "\n".join(f"{_key(name)} = {_value(inner)}" for name, inner in value.items())
        for key, value in data.items()
        if isinstance(value, dict)
    ]
    return "\n".join([*plain, *tables]) + "\n"


def _key(name: Any) -> str:
    return _text(str(name))


def _text(value: str) -> str:
    safe = (c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in value)
    return '"' + "".join(safe) + '"'


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return f"{value}" if abs(value) < 10**4000 else "1"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return value.isoformat() if isinstance(value, date) else _text(str(value))
