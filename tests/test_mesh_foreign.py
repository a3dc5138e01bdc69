"""Files of other programs are read in a process of their own: limits, links, entities, and what goes between the processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

import h5py
import meshio
import numpy as np
import pytest
from decks import bar
from test_mesh_exodus import write as write_exodus
from test_mesh_other_formats import body

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.foreign import limits, process, wire
from ancf_petsc.mesh.read import read_mesh

pytestmark = pytest.mark.filterwarnings("ignore:.product. is deprecated:DeprecationWarning")


def refused(path, message):
    """The error is one line that has the words, and nothing of another file."""
    with pytest.raises(MeshError, match=message) as error:
        read_mesh(path, ("tetra",))
    assert len(str(error.value).splitlines()) == 1
    assert "424242" not in str(error.value)


# --- between the processes


def test_what_is_sent_comes_back():
    sent = {
        "numbers": np.arange(6, dtype=">i4").reshape(2, 3),
        "none": np.empty((0, 4)),
        "names": np.array([[b"a", b""]], dtype="S1"),
        "turned": np.arange(6.0).reshape(2, 3).T,
        "plain": [1, 2.5, "\u00e9", None, {"x": np.float32(0.5)}],
        "scalar": np.array(3),
    }
    got = wire.decode(b"".join(wire.encode(sent)))
    assert got["plain"] == [1, 2.5, "\u00e9", None, {"x": 0.5}]
    for name in set(sent) - {"plain"}:
        assert np.array_equal(got[name], sent[name])
        assert got[name].shape == sent[name].shape


@pytest.mark.parametrize(
    "thing", [np.array([{}]), np.array(["text"]), np.zeros(2, dtype=[("a", "i4")]), np.array([1j])]
)
def test_only_numbers_are_sent(thing):
    with pytest.raises(ValueError, match="an array of"):
        wire.encode({"x": thing})


def test_objects_are_not_taken():
    head = json.dumps({wire.ARRAY: "|O", "shape": [1]}).encode()
    with pytest.raises(ValueError, match="an array of object"):
        wire.decode(len(head).to_bytes(8, "little") + head + bytes(8))


# --- limits


def test_a_reader_that_does_not_come_to_an_end_is_stopped(tmp_path, monkeypatch):
    path = tmp_path / "m.vtu"
    body().write(path)
    monkeypatch.setattr(process, "PATIENCE", 0.0)
    monkeypatch.setattr(process, "WAITING", 0.0)
    refused(path, "meshio does not come to an end of it in 0 s; write it again")


def test_the_limit_of_time_holds():
    code = "from ancf_petsc.mesh.foreign import limits; limits.limit(2**30, 0.0)\nwhile True: pass"
    assert subprocess.run([sys.executable, "-c", code]).returncode == -signal.SIGXCPU


def test_a_reader_that_asks_for_all_memory_is_refused_it(tmp_path):
    """Announced are 24 GB of points."""
    path = tmp_path / "m.vtk"
    body().write(path, binary=True)
    path.write_bytes(path.read_bytes().replace(b"POINTS 5", b"POINTS 1000000000"))
    refused(path, "meshio needs more memory for it than 0.75 GiB|meshio cannot read it")


def test_memory_grows_with_the_file_and_what_is_packed(tmp_path):
    assert limits.allowed_bytes(tmp_path / "m.vtu", 10**9) > 50 * 10**9
    assert limits.allowed_bytes(tmp_path / "m.vol.gz", 10**6) - limits.MEMORY > 500 * 10**6


def test_the_limit_of_memory_holds():
    """In a process of its own, which cannot raise it again by itself."""
    code = (
        "from ancf_petsc.mesh.foreign import limits; limits.limit(2**28, 5.0); a = bytearray(2**27); "
        "print('taken'); b = bytearray(2**28)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "taken\n"
    assert "MemoryError" in done.stderr


def test_nothing_is_left_in_the_user_s_folder(tmp_path, monkeypatch):
    """Gmsh's library makes one for its settings wherever HOME leads."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    text = "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n"
    (tmp_path / "old.msh").write_text(text)
    assert len(read_mesh(tmp_path / "old.msh", ("tetra",)).cells) == 1
    assert not any(home.iterdir())


# --- XML


def test_entities_are_not_expanded(tmp_path):
    path = tmp_path / "m.vtu"
    body().write(path, binary=False)
    text = path.read_text()
    bomb = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 9))
    at = text.index("<VTKFile")
    path.write_text(
        f'{text[:at]}<!DOCTYPE VTKFile [<!ENTITY e0 "1">{bomb}]>{text[at:]}'.replace("4 5", "&e8; 5")
    )
    refused(path, "it declares the entity 'e0': entities are not expanded")
    secret = tmp_path / "secret.txt"
    secret.write_text("424242.5")
    path.write_text(f'{text[:at]}<!DOCTYPE VTKFile [<!ENTITY x SYSTEM "{secret}">]>{text[at:]}')
    refused(path, "it declares the entity 'x'")


def test_a_document_type_alone_does_no_harm(tmp_path):
    """Many programs write this line into XDMF."""
    path = tmp_path / "m.xdmf"
    body().write(path)
    text = path.read_text()
    path.write_text(text.replace("<Xdmf", '<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>\n<Xdmf', 1))
    assert len(read_mesh(path, ("tetra",)).cells) == 2


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../m.h5:/data0", "~/m.h5:/data0", "", "folder/../../m.h5:/data0"]
)
def test_numbers_of_xdmf_lie_beside_it(tmp_path, name):
    (tmp_path / "inner").mkdir()
    path = tmp_path / "inner" / "m.xdmf"
    body().write(path)
    path.write_text(path.read_text().replace("m.h5:/data0", name))
    refused(path, "it names a data file that is not beside it")


def test_numbers_of_xdmf_may_lie_below_it(tmp_path):
    path = tmp_path / "m.xdmf"
    body().write(path)
    (tmp_path / "data").mkdir()
    (tmp_path / "m.h5").rename(tmp_path / "data" / "m.h5")
    path.write_text(path.read_text().replace("m.h5:", "data/m.h5:"))
    assert len(read_mesh(path, ("tetra",)).cells) == 2
    (tmp_path / "data" / "m.h5").unlink()
    refused(path, "its data file 'data/m.h5' is missing")


# --- HDF5


def with_secret(tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["data"] = np.full((5, 3), 424242.5)
    np.full((5, 3), 424242.5).tofile(tmp_path / "secret.bin")
    path = tmp_path / "inner" / "m.xdmf"
    path.parent.mkdir()
    body().write(path)
    return path


def outside(file):
    file["data0"] = h5py.ExternalLink("../secret.h5", "/data")


def raw(file):
    file.create_dataset("data0", (5, 3), dtype="f8", external=[("../secret.bin", 0, 120)])


def virtual(file):
    layout = h5py.VirtualLayout(shape=(5, 3), dtype="f8")
    layout[...] = h5py.VirtualSource("../secret.h5", "data", shape=(5, 3))
    file.create_virtual_dataset("data0", layout)


def huge(file):
    file.create_dataset("data0", (2**40, 3), dtype="f8", chunks=(1000, 3))


LINKS = {
    "a link": (outside, "data0 is a link to the file '../secret.h5'"),
    "raw numbers": (raw, "data0 has its numbers in another file"),
    "a virtual data set": (virtual, "data0 has its numbers in another file"),
    "nothing": (huge, "data0 is announced with 1099511627776 x 3 numbers, and 0 bytes are there"),
}


@pytest.mark.parametrize("what", LINKS)
def test_hdf5_does_not_lead_elsewhere(tmp_path, what):
    make, message = LINKS[what]
    path = with_secret(tmp_path)
    with h5py.File(path.with_suffix(".h5"), "r+") as file:
        del file["data0"]
        make(file)
    refused(path, message)


def test_a_circle_of_groups_does_no_harm(tmp_path):
    path = tmp_path / "m.med"
    body().write(path)
    with h5py.File(path, "r+") as file:
        file["around"] = file["/"]
    assert len(read_mesh(path, ("tetra",)).cells) == 2


def test_counts_of_exodus_are_those_of_what_is_there(tmp_path):
    import netCDF4

    path = write_exodus(tmp_path / "bar.exo", bar(), form="NETCDF3_CLASSIC")
    with netCDF4.Dataset(path, "r+") as data:
        data.renameDimension("num_elem", "number")
        data.createDimension("num_elem", 2**30)
    refused(path, "the blocks hold 12 elements: expected 1073741824 as num_elem says")


# --- what is no ordinary file


@pytest.mark.parametrize("what", ["loop", "pipe", "device", "long"])
def test_what_is_no_file_is_said(tmp_path, what):
    path = tmp_path / "m.msh"
    if what == "loop":
        path.symlink_to(path.name)
    elif what == "pipe":
        os.mkfifo(path)
    elif what == "device":
        path.symlink_to("/dev/zero")
    else:
        path = tmp_path / ("m" * 5000 + ".msh")
    refused(path, "there is no such file|not a file")


def test_data_that_number_nothing_are_no_sets(tmp_path):
    """Text under the name of another format: meshio may find data and no cells at all."""
    path = tmp_path / "m.avs"
    path.write_text("0 0 0 0 0\n")
    refused(path, "holds no nodes|cannot read it|found no cells")
    meshio.Mesh(np.zeros((0, 3)), []).write(tmp_path / "m.vtk")
    refused(tmp_path / "m.vtk", "holds no nodes|cannot read it")
