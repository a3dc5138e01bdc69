"""Names that CalculiX takes for sets and materials."""

from __future__ import annotations

import re
from collections.abc import Iterable

LONGEST = 60
"""CalculiX takes 80 characters; some are left for what a deck adds."""


def deck_names(names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """A name in capitals, digits and underscores for each, beginning with a letter, all different."""
    used, found = set(taken), {}
    for name in names:
        word = re.sub(r"[^A-Z0-9_-]", "_", name.upper())
        word = word if re.match(r"[A-Z]", word) else f"G_{word}"
        stem, number = word[:LONGEST], 1
        word = stem
        while word in used:
            number += 1
            word = f"{stem}_{number}"
        used.add(word)
        found[name] = word
    return found
