"""Damage of HDF5 and netCDF files by their own libraries: what stands in them is wrong, the files are whole."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import numpy as np


def _hdf5_files(folder: Path) -> list[Path]:
    found = [path for path in folder.rglob("*") if path.is_file() and not path.is_symlink()]
    return sorted(path for path in found if path.read_bytes()[:8] == b"\x89HDF\r\n\x1a\n")


def _objects(file: Any) -> tuple[list[str], list[str]]:
    """Names of data sets and of groups."""
    import h5py

    datasets: list[str] = []
    groups: list[str] = []
    file.visititems(
        lambda name, one: (datasets if isinstance(one, h5py.Dataset) else groups).append(name) and None
    )
    return datasets, groups


def _put(file: Any, name: str, data: Any, **options: Any) -> None:
    """Another data set under a name, its attributes kept."""
    attributes = dict(file[name].attrs)
    del file[name]
    _give(file.create_dataset(name, data=data, **options), attributes)


def _give(made: Any, attributes: dict[str, Any]) -> None:
    """Attributes of another data set, but for the lists that HDF5 keeps itself."""
    for key, value in attributes.items():
        if key not in ("DIMENSION_LIST", "REFERENCE_LIST"):
            made.attrs[key] = value


def other_dataset(folder: Path, main: Path, random: Random) -> None:
    """Values, kinds and shapes nobody expects."""
    import h5py

    del main
    for path in _hdf5_files(folder)[:1]:
        with h5py.File(path, "r+") as file:
            datasets, _ = _objects(file)
            if not datasets:
                return
            name = random.choice(datasets)
            old = file[name][()]
            choices = _instead(np.asarray(old), random)
            key = random.choice(sorted(choices))
            _put(file, name, choices[key])


def _instead(old: np.ndarray, random: Random) -> dict[str, Any]:
    numbers = old.astype(float) if old.dtype.kind in "iuf" else np.arange(6.0)
    changed = numbers.copy()
    if changed.size:
        changed.flat[random.randrange(changed.size)] = random.choice(
            (np.nan, np.inf, -1.0, 1e300, 2.0**62, 0.5)
        )
    whole = np.nan_to_num(changed, posinf=2.0**62, neginf=-1.0).clip(-(2.0**62), 2.0**62)
    return {
        "number": changed,
        "whole": whole.astype(np.int64),
        "empty": np.empty(0),
        "scalar": 1.0,
        "text": "abc",
        "texts": np.array([b"ab"] * 5),
        "flat": numbers.ravel(),
        "turned": numbers.T.copy(),
        "higher": numbers[None, ..., None],
        "longer": np.concatenate([numbers.ravel()] * 3),
        "shorter": numbers[: max(len(numbers) - 1, 0)] if numbers.ndim else numbers,
        "records": np.zeros(4, dtype=[("a", "i4"), ("b", "f8", 3)]),
        "complex": numbers + 1j,
        "truth": numbers > 0,
        "narrow": whole.clip(-100, 100).astype(np.int8),
        "unsigned": whole.clip(0).astype(np.uint64),
        "half": np.nan_to_num(numbers).clip(-6e4, 6e4).astype(np.float16),
    }


def other_link(folder: Path, main: Path, random: Random) -> None:
    """Names that lead elsewhere: to another file, to nothing, in a circle, to data kept outside."""
    import h5py

    del main
    for path in _hdf5_files(folder)[:1]:
        with h5py.File(path, "r+") as file:
            datasets, groups = _objects(file)
            name = random.choice(datasets or ["x"])
            way = random.choice(("external", "soft", "circle", "raw", "virtual", "gone", "group"))
            if way == "raw":
                shape, dtype = file[name].shape or (1,), file[name].dtype
                size = int(np.prod(shape)) * 8
                del file[name]
                file.create_dataset(
                    name,
                    shape,
                    dtype=dtype if dtype.kind in "iuf" else "f8",
                    external=[("../../secret.txt", 0, size)],
                )
                return
            if way == "virtual":
                shape = file[name].shape or (1,)
                layout = h5py.VirtualLayout(shape=shape, dtype="f8")
                layout[...] = h5py.VirtualSource("../../secret.h5", "data0", shape=shape)
                del file[name]
                file.create_virtual_dataset(name, layout)
                return
            if way == "group":
                name = random.choice(groups or [name])
            if name in file:
                del file[name]
            link: Any = {
                "external": h5py.ExternalLink("../../secret.h5", random.choice(("/data0", "/"))),
                "soft": h5py.SoftLink(random.choice(("/nowhere", f"/{name}"))),
            }.get(way)
            if link is not None:
                file[name] = link
            elif way == "circle":
                file[name] = file["/"]
            elif way == "group" and random.random() < 0.5:
                file.create_group(name)


def huge_dataset(folder: Path, main: Path, random: Random) -> None:
    """A few bytes on the disk that are announced as terabytes."""
    import h5py

    del main
    for path in _hdf5_files(folder)[:1]:
        with h5py.File(path, "r+") as file:
            datasets, _ = _objects(file)
            if not datasets:
                return
            name = random.choice(datasets)
            old = file[name]
            rows = random.choice((10**8, 10**9, 2**40, 2**62))
            shape = (rows, *old.shape[1:]) if old.ndim and rows < 2**50 else (rows,)
            attributes = dict(old.attrs)
            kind = old.dtype if old.dtype.kind in "iuf" else np.dtype("f8")
            del file[name]
            chunks = (1000, *shape[1:])
            made = file.create_dataset(
                name, shape, dtype=kind, chunks=chunks, compression="gzip" if random.random() < 0.5 else None
            )
            _give(made, attributes)


def other_attribute(folder: Path, main: Path, random: Random) -> None:
    import h5py

    del main
    for path in _hdf5_files(folder)[:1]:
        with h5py.File(path, "r+") as file:
            datasets, groups = _objects(file)
            having = [name for name in ["/", *datasets, *groups] if len(file[name].attrs)]
            if not having:
                return
            one = file[random.choice(having)]
            name = random.choice(sorted(one.attrs))
            if random.random() < 0.3:
                del one.attrs[name]
                return
            values: list[Any] = [
                0,
                -1,
                2**62,
                np.nan,
                np.inf,
                "",
                "x" * 3000,
                np.arange(5),
                [b"a", b"\xff"],
                b"\xe9\xff",
                h5py.Empty("f8"),
                np.zeros(0),
                True,
                "../../x",
            ]
            one.attrs[name] = random.choice(values)


def other_name(folder: Path, main: Path, random: Random) -> None:
    """An object under another name."""
    import h5py

    del main
    for path in _hdf5_files(folder)[:1]:
        with h5py.File(path, "r+") as file:
            datasets, groups = _objects(file)
            names = datasets + groups
            if not names:
                return
            name = random.choice(names)
            new = (
                name.rpartition("/")[0]
                + "/"
                + random.choice(
                    ("x", "1", "-1", "99999999999999999999", "\u00e9", "a b", "%2F", "None", "00000001")
                )
            )
            if new not in file:
                file.move(name, new)


def other_variable(folder: Path, main: Path, random: Random) -> None:
    """A number of a netCDF file, a name, or what is missing."""
    import netCDF4

    del folder
    try:
        data = netCDF4.Dataset(str(main), "r+")
    except (OSError, RuntimeError):
        return
    with data:
        data.set_auto_mask(False)
        name = random.choice(sorted(data.variables))
        variable = data.variables[name]
        way = random.choice(("value", "value", "rename", "attribute", "dimension"))
        if way == "value" and variable.dtype != "S1" and variable.size:
            values = np.asarray(variable[:])
            extreme = (
                (0, -1, 2**31 - 1, -(2**31), 7, 1)
                if values.dtype.kind in "iu"
                else (np.nan, np.inf, 1e300, -1e120, 0.0)
            )
            values.flat[random.randrange(values.size)] = random.choice(extreme)
            variable[:] = values
        elif way == "rename":
            data.renameVariable(
                name,
                random.choice(("coordx", "connect1", "connect2", "node_ns1", "x", "eb_names"))
                + random.choice(("", "_")),
            )
        elif way == "attribute":
            variable.setncattr(
                random.choice(("elem_type", "scale_factor", "add_offset", "_FillValue2", "units")),
                random.choice(("TET4", "HEX8", "", "SPHERE", 3, 1e300, "nsided", "TET" * 500)),
            )
        else:
            data.renameDimension(
                random.choice(sorted(data.dimensions)),
                random.choice(("num_nodes", "num_elem", "x", "num_el_blk")) + random.choice(("", "_")),
            )


def other_variable_or_nothing(folder: Path, main: Path, random: Random) -> None:
    try:
        other_variable(folder, main, random)
    except RuntimeError:  # netCDF refuses a name that is there
        return


HDF5 = (other_dataset, other_dataset, other_link, huge_dataset, other_attribute, other_name)
NETCDF = (other_variable_or_nothing,) * 4
