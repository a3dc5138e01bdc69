"""Units for axes, from the label a case gives: "SI", "mm, MPa, N". Nothing is converted."""

from __future__ import annotations

import re
from dataclasses import dataclass

LENGTHS = ("km", "m", "cm", "mm", "um", "in", "ft")
FORCES = ("MN", "kN", "N", "mN", "lbf")
STRESSES = ("GPa", "MPa", "kPa", "Pa", "psi")
ENERGIES = ("MJ", "kJ", "J", "mJ")
TIMES = ("s", "ms", "us", "min", "h")
MASSES = ("t", "kg", "g", "mg")
STRESS_OF = {("m", "N"): "Pa", ("m", "kN"): "kPa", ("mm", "N"): "MPa", ("mm", "kN"): "GPa"}
FORCE_OF = {(length, stress): force for (length, force), stress in STRESS_OF.items()}
ENERGY_OF = {("m", "N"): "J", ("m", "kN"): "kJ", ("mm", "N"): "mJ", ("mm", "kN"): "J"}


@dataclass(frozen=True)
class Units:
    """Names of units; empty where the label does not say."""

    length: str = ""
    force: str = ""
    stress: str = ""
    energy: str = ""
    time: str = ""
    mass: str = ""

    @property
    def speed(self) -> str:
        return f"{self.length}/{self.time}" if self.length and self.time else ""

    @property
    def stiffness(self) -> str:
        return f"{self.force}/{self.length}" if self.force and self.length else ""

    @property
    def momentum(self) -> str:
        return f"{self.force} {self.time}" if self.force and self.time else ""

    @property
    def angular_momentum(self) -> str:
        return f"{self.force} {self.length} {self.time}" if self.momentum and self.length else ""


def read_units(label: str) -> Units:
    """What the label says of each quantity; force, stress and energy are filled in where they follow."""
    if label.strip().upper() == "SI":
        return Units("m", "N", "Pa", "J", "s", "kg")
    words = re.split(r"[\s,;/]+", label.strip())
    length, force, stress, energy, time, mass = (
        next((word for word in words if word in known), "")
        for known in (LENGTHS, FORCES, STRESSES, ENERGIES, TIMES, MASSES)
    )
    force = force or FORCE_OF.get((length, stress), "")
    stress = stress or STRESS_OF.get((length, force), "")
    product = f"{force} {length}" if force and length else ""
    return Units(length, force, stress, energy or ENERGY_OF.get((length, force), product), time, mass)


def with_unit(name: str, unit: str) -> str:
    """A label for an axis."""
    return f"{name} [{unit}]" if unit else name


def as_typed(text: str) -> str:
    """A text of the user's for matplotlib, which would take dollars for formulas and leave out of a legend what
    begins with an underscore.
    """
    escaped = text.replace("$", r"\$")
    return f" {escaped}" if escaped.startswith("_") else escaped
