"""How kernels are compiled, what their machine code is called, and where it is kept.

numba keeps machine code in files and links those of one process together by the names of functions. Two functions of one
name are then one function, whichever file came first. A function nested in a factory has one name for all it was made from: one
for all laws. `kernel` and `composed` therefore append to the name what the function's closure holds and a digest of all code that
can be reached from it: functions of different code never share a name, nor a file.

numba does not notice changes in functions of other files either. So the cache folder's name holds a hash of the sources of all
kernels and laws, of the program's folder, and of the versions of numba and numpy. `ANCF_CACHE_DIR` moves the folder.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import numba
import numpy
from llvmlite import ir
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.core.typing.templates import Signature
from numba.extending import intrinsic, overload, register_jitable


def _start_without_blas() -> None:
    """Load numba's functions of arrays without SciPy's linear algebra, which would take a fifth of a run's start.

    numba looks for it only to choose between two loops of `np.kron`, and imports it when a kernel takes a product of matrices.
    """
    blas = "scipy.linalg.cython_blas"
    if blas not in sys.modules:
        sys.modules[blas] = None  # type: ignore[assignment]  # so that importing it is an ImportError
        try:
            import_module("numba.np.arraymath")
        finally:
            del sys.modules[blas]


_start_without_blas()

PACKAGE = Path(__file__).parent
SOURCES = ("algebra", "kernel", "material")


def source_hash() -> str:
    """Hash of every file that machine code is made from, of this module and the compiler."""
    digest = hashlib.sha256(f"{numba.__version__} {numpy.__version__} {PACKAGE}".encode())
    files = (file for folder in SOURCES for file in sorted((PACKAGE / folder).glob("**/*.py")))
    for file in (Path(__file__), *files):
        digest.update(str(file.relative_to(PACKAGE)).encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _is_own(folder: Path) -> bool:
    """Make a folder in the place for temporary files; whether it is this user's alone: numba unpickles what lies there."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def cache_folder() -> Path:
    """The folder for machine code: the first of these that can be written to; else one for this process alone."""
    base = os.environ.get("ANCF_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    candidates = [
        Path(base) if base else Path.home() / ".cache",
        Path(tempfile.gettempdir()) / f"cache-{os.getuid()}",
    ]
    for candidate in candidates:
        if candidate is candidates[1] and not _is_own(candidate):
            continue
        folder = candidate / "ancf_petsc" / f"kernels-{source_hash()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    with suppress(OSError):
        return Path(tempfile.mkdtemp(prefix="ancf-cache-"))
    return candidates[-1]


CACHE_FOLDER = cache_folder()
numba.config.CACHE_DIR = str(CACHE_FOLDER)


REGROUPED = {"contract", "reassoc"}
"""Mathematics of a sum whose terms may be added in any order."""


def kernel(function: Callable) -> Callable:
    """Compile a pure loop, keep its machine code, divide like IEEE 754 does; products and sums may be fused."""
    return numba.njit(_named(function), cache=True, error_model="numpy", nogil=True, fastmath={"contract"})


def composed(function: Callable) -> Callable:
    """A function made from others, those in its closure, to be compiled into the kernels that call it."""
    named = _named(function)
    if named is function:
        register_jitable(forceinline=True)(function)
    return named


def address_of(function: Callable, signature: Signature) -> int:
    """Where the machine code of a function for these types begins: what `call_at` takes.

    A compiled loop that is given an address need not be compiled anew for every function it may call.
    """
    named = _named(function)
    key = (named, signature)
    if key not in _ADDRESSES:
        if numba.config.DISABLE_JIT:
            address = id(named)
        else:
            options = {"error_model": "numpy", "fastmath": {"contract"}}
            code = numba.cfunc(signature, cache=True, **options)(named)
            _ADDRESSES[code] = address = code.address
        _ADDRESSES[key] = address
        _BEHIND[address] = named
    return _ADDRESSES[key]


_ADDRESSES: dict[Any, int] = {}
_BEHIND: dict[int, Callable] = {}


def call_at(address: int, *arguments: Any) -> float:
    """Call what lies at an address of `address_of`, with arguments of its signature. It returns a float."""
    return _BEHIND[address](*arguments)


@overload(call_at)
def _call_at(address, *arguments):
    return lambda address, *arguments: _jump(address, arguments)


@intrinsic
def _jump(_, address, arguments):
    """The call itself: machine code of a callback takes its arguments by value."""

    def generate(context, builder, signature, values):
        types_ = [context.get_value_type(kind) for kind in arguments]
        pointer_type = ir.FunctionType(ir.DoubleType(), types_).as_pointer()
        items = [builder.extract_value(values[1], k) for k in range(len(types_))]
        return builder.call(builder.inttoptr(values[0], pointer_type), items)

    return types.float64(address, arguments), generate


def digest(function: Callable) -> str:
    """Hash of a function's code and of all Python code and numbers that can be reached from it.

    Raises TypeError for a closure over anything but functions, numbers, strings, tuples and arrays.
    """
    seen: dict[int, int] = {}
    sha = hashlib.sha256()
    for part in _parts(function, seen):
        sha.update(part)
        sha.update(b"\0")
    return sha.hexdigest()[:12]


def ingredients(function: Callable) -> list[str]:
    """Names of the functions of other packages that a nested one is made from in the end: of a kernel, those of its law."""
    package = _plain(function).__module__.rpartition(".")[0]
    found, waiting = set(), [function]
    while waiting:
        item = _plain(waiting.pop())
        waiting += [inner for inner in _closure(item) if callable(inner)]
        if not _closure(item) and item.__module__.rpartition(".")[0] != package:
            found.add(item.__name__)
    return sorted(found)


def _named(function: Callable) -> Callable:
    """A function with a closure under the name of its code, made now or before.

    It becomes an attribute of its module and so is pickled by its name, which makes numba's key of the machine code the same in all
    processes. Otherwise a nested function is pickled with its code object, whose bytes differ between code that Python has just
    compiled and code loaded from a .pyc file.
    """
    if not _closure(function):
        return function
    made_from = ",".join(ingredients(function))
    name = f"{function.__name__}{made_from and f'[{made_from}]'}-{digest(function)}"
    function.__qualname__ = name
    module = sys.modules[function.__module__]
    if not hasattr(module, name):
        setattr(module, name, function)
    return getattr(module, name)


def _plain(function: Any) -> FunctionType:
    """The Python function of a compiled one."""
    return function.py_func if isinstance(function, Dispatcher) else function


def _closure(function: Any) -> list[Any]:
    return [cell.cell_contents for cell in function.__closure__ or ()]


def _parts(item: Any, seen: dict[int, int]) -> Iterator[bytes]:
    """What makes a function, or a value that it uses, what it is."""
    if isinstance(item, Dispatcher):
        yield repr(sorted((key, repr(value)) for key, value in item.targetoptions.items())).encode()
        item = item.py_func
    if isinstance(item, FunctionType):
        if id(item) in seen:  # a function that is reached twice, or calls itself
            yield f"again {seen[id(item)]}".encode()
            return
        seen[id(item)] = len(seen)
        yield from _code(item.__code__)
        yield repr(item.__defaults__).encode()
        for value in _closure(item):
            yield from _parts(value, seen)
        for name in sorted(_globals_of(item.__code__)):
            yield name.encode()
            yield from _global(item.__globals__.get(name), seen)
    elif isinstance(item, numpy.ndarray):
        yield f"{item.dtype} {item.shape}".encode()
        yield item.tobytes()
    elif isinstance(item, tuple):
        yield f"{type(item).__name__} {len(item)}".encode()
        for entry in item:
            yield from _parts(entry, seen)
    elif isinstance(item, (bool, int, float, str, numpy.generic)) or item is None:
        yield f"{type(item).__name__} {item!r}".encode()
    else:
        raise TypeError(f"compiled functions may not be made from a {type(item).__name__}: {item!r}")


def _global(item: Any, seen: dict[int, int]) -> Iterator[bytes]:
    """A global that code uses: only its name where it is no code and no number of this program."""
    known = isinstance(item, (Dispatcher, FunctionType, numpy.ndarray, tuple, bool, int, float, str))
    if known and not getattr(item, "__module__", "").startswith(("numpy", "math")):
        yield from _parts(item, seen)


def _code(code: CodeType) -> Iterator[bytes]:
    yield code.co_code
    yield repr((code.co_names, code.co_varnames, code.co_freevars)).encode()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant)
        elif isinstance(constant, frozenset):
            yield repr(sorted(map(repr, constant))).encode()
        else:
            yield repr(constant).encode()


def _globals_of(code: CodeType) -> set[str]:
    """Names that code and what is nested in it may look up among globals."""
    inner = (_globals_of(constant) for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*inner)
