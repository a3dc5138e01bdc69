"""The digital code dncm of elements in absolute nodal coordinates.

d is the dimension of the element, n its number of nodes, c the nodal vectors of each node (1: the position r;
1 + d: r and its slopes along the axes), m the components of r. `3413` is the linear tetrahedron; with ten
nodes and more the code is written with dashes, `3-10-1-3`; `+4` adds four nodes that carry a position only,
`3443+4`.

Source: Dmitrochenko and Mikkola, Digital nomenclature code for topology and kinematics of finite elements
based on the absolute nodal co-ordinate formulation, Proc. IMechE K 225 (2011) 34; Olshevskiy et al.,
Nonlinear Dynamics 88 (2017) 2457.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ancf_petsc.errors import CaseError

_PLAIN = re.compile(r"(\d)(\d)(\d)(\d)(?:\+(\d+))?")
_DASHED = re.compile(r"(\d)-(\d+)-(\d+)-(\d)(?:\+(\d+))?")
_BODIES = {1: "line", 2: "surface", 3: "solid"}


@dataclass(frozen=True)
class Dncm:
    """A digital code: d, n, c, m and the extra nodes that carry a position only."""

    dimension: int
    nodes: int
    vectors: int
    components: int
    extra: int = 0

    def __str__(self) -> str:
        numbers = (self.dimension, self.nodes, self.vectors, self.components)
        plain = "".join(map(str, numbers)) if max(numbers) < 10 else "-".join(map(str, numbers))
        return f"{plain}+{self.extra}" if self.extra else plain

    @property
    def functions(self) -> int:
        """Number of shape functions, which is the number of nodal vectors and of monomials."""
        return self.nodes * self.vectors + self.extra

    @property
    def unknowns(self) -> int:
        """Degrees of freedom of one element."""
        return self.functions * self.components

    @property
    def meaning(self) -> str:
        """The code in words."""
        slopes = "" if self.vectors == 1 else f" and {self.dimension} slope" + "s" * (self.dimension > 1)
        extra = f", {self.extra} more nodes with position" if self.extra else ""
        return (
            f"{_BODIES[self.dimension]} of {self.nodes} nodes with position{slopes}{extra}, "
            f"{self.components} components: {self.unknowns} degrees of freedom"
        )


def parse(code: str) -> Dncm:
    """The code `code` taken apart. Raises CaseError where it is none."""
    match = _PLAIN.fullmatch(code.strip()) or _DASHED.fullmatch(code.strip())
    if match is None:
        raise _refused(code, "four digits dncm, 3413, or numbers with dashes, 3-10-1-3, with or without +k")
    d, n, c, m, extra = (int(number or 0) for number in match.groups())
    if not 1 <= d <= 3:
        raise _refused(code, "a dimension d of 1, 2 or 3")
    if n <= d:
        raise _refused(code, f"at least {d + 1} nodes n in dimension {d}")
    if c not in (1, 1 + d):
        raise _refused(code, f"c = 1 (position) or c = {1 + d} (position and slopes) in dimension {d}")
    if not d <= m <= 3:
        raise _refused(code, f"m from {d} to 3 components")
    return Dncm(d, n, c, m, extra)


def _refused(code: str, expected: str) -> CaseError:
    return CaseError(key="mesh.element", got=code, expected=expected, cure="see `ancf info --elements`")
