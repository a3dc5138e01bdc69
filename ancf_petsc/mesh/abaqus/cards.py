"""What each keyword that describes the mesh does: one function a keyword, and the table of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ancf_petsc.mesh.abaqus import generate, place
from ancf_petsc.mesh.abaqus.data import (
    Line,
    fields,
    label,
    numbered,
    plain_number,
    records,
    rows,
    table,
    whole,
    words,
)
from ancf_petsc.mesh.abaqus.deck import KeywordCard
from ancf_petsc.mesh.abaqus.scope import (
    Elements,
    Listed,
    Member,
    Nodes,
    Range,
    Reader,
    Reference,
    Surface,
    SurfaceLine,
)
from ancf_petsc.mesh.abaqus.types import element_type

WHOLE_NUMBERS = str.maketrans("", "", "0123456789, \t\n")


def node(reader: Reader, card: KeywordCard) -> None:
    given = card.known("NSET", "SYSTEM", ignored=("INPUT",))
    if not card.text().strip():
        return
    data = rows(card, 4)
    numbers = numbered(card, whole(card, data[:, 0]), "a node")
    points = place.to_rectangular(card, given.get("SYSTEM", ""), data[:, 1:])
    scope = reader.scope
    scope.nodes.append(Nodes(numbers, scope.to_global(points) if scope.to_global else points, card))
    if given.get("NSET"):
        scope.add("node", label(given["NSET"]), [Listed(numbers)])


def element(reader: Reader, card: KeywordCard) -> None:
    given = card.known("TYPE", "ELSET", ignored=("INPUT",))
    title = "".join(card.needed(given, "TYPE").replace('"', "").split()).upper()
    kind = element_type(title)
    if kind is None:
        raise card.error(
            f"the element type {title} is not known",
            expected="solids such as C3D4, C3D10, C3D8, C3D20; plane elements such as CPE4; beams such as B21",
            cure="write the body with such elements",
        )
    if not card.text().strip():
        return
    if kind.shape is None:
        reader.beyond[title] = reader.beyond.get(title, 0) + len(table(card).counts)
        numbers = _first_numbers(card)
        reader.scope.elements.append(
            Elements(title, kind, numbers, np.empty((len(numbers), 0), np.int64), card)
        )
    else:
        width = len(kind.shape.order) or _nodes_of(kind.shape.kind)
        data = numbered(card, records(card, 1 + width, "element"), "an element or node")
        numbers = data[:, 0]
        reader.scope.elements.append(Elements(title, kind, numbers, data[:, 1:], card))
    if given.get("ELSET"):
        reader.scope.add("element", label(given["ELSET"]), [Listed(numbers)])


def _nodes_of(kind: str) -> int:
    from ancf_petsc.mesh.kinds import KINDS

    return KINDS[kind].nodes


def _first_numbers(card: KeywordCard) -> np.ndarray:
    """Element numbers of springs and the like, one a line."""
    flat, counts = table(card)
    starts = np.cumsum(counts) - counts
    return numbered(card, whole(card, flat[starts]), "an element")


def node_set(reader: Reader, card: KeywordCard) -> None:
    given = card.known(
        *("NSET", "GENERATE", "ELSET", "INSTANCE", "UNSORTED"), ignored=("INTERNAL", "INPUT", "DMINFORMATION")
    )
    name = label(card.needed(given, "NSET"))
    if given.get("ELSET"):
        line = (card.source.path, card.source.line(card.position))
        owner = _instance(reader, card, given)
        members: list[Member] = [Reference(label(given["ELSET"]), owner, card, line, elements=True)]
    else:
        members = _members(reader, card, given, "node")
    reader.scope.add("node", name, members)
    reader.scope.sets["node"][name.key].unsorted |= "UNSORTED" in given


def element_set(reader: Reader, card: KeywordCard) -> None:
    given = card.known(
        "ELSET", "GENERATE", "INSTANCE", ignored=("INTERNAL", "UNSORTED", "INPUT", "DMINFORMATION")
    )
    name = label(card.needed(given, "ELSET"))
    reader.scope.add("element", name, _members(reader, card, given, "element"))


def _instance(reader: Reader, card: KeywordCard, given: dict[str, str]) -> str:
    if "INSTANCE" not in given:
        return ""
    key = label(card.needed(given, "INSTANCE")).key
    if key not in reader.instances:
        raise card.error(
            "there is no such instance",
            got=given["INSTANCE"],
            expected=f"one of {', '.join(i.shown for i in reader.instances.values()) or 'none'}",
            cure="give the *INSTANCE before its sets",
        )
    return key


def _members(reader: Reader, card: KeywordCard, given: dict[str, str], what: str) -> list[Member]:
    """Members of a set; a set that is named takes in what that set holds so far."""
    owner = _instance(reader, card, given)
    if "GENERATE" in given:
        return _ranges(card, owner, what)
    text = card.text()
    if not text.translate(WHOLE_NUMBERS):
        flat = whole(card, table(card).flat)
        return [Listed(flat[flat != 0], owner)]
    members: list[Member] = []
    for line, content in card.lines():
        own = words(content)
        numbers = [number for word in own if (number := plain_number(word)) is not None]
        if numbers:
            members.append(Listed(np.array(numbers, dtype=np.int64), owner))
        for word in own:
            if plain_number(word) is None:
                members += _named(reader, card, line, word, owner, what)
    return members


def _named(reader: Reader, card: KeywordCard, line: Line, word: str, owner: str, what: str) -> list[Member]:
    """A set by its name, or INSTANCE.name, or INSTANCE.number."""
    if word.lstrip("+-").replace(".", "").isdecimal():
        raise card.error(
            f"a member of a {what} set", line=line, got=word, expected=f"the number of a {what} or a name"
        )
    name, instance, number = split_name(reader, word)
    if number is not None:
        return [Listed(np.array([number], dtype=np.int64), instance)]
    known = reader.scope.sets[what].get(name.key) if not (instance or owner) else None
    return list(known.members) if known else [Reference(name, instance or owner, card, line)]


def split_name(reader: Reader, word: str):
    """Label, key of the instance before a dot ("" without one), and the number where it is one of an instance."""
    for key in reader.instances:
        prefix, _, rest = word.partition(".")
        if rest and label(prefix).key == key:
            plain = rest.strip()
            return label(rest), key, plain_number(plain)
    return label(word), "", None


def _ranges(card: KeywordCard, owner: str, what: str) -> list[Member]:
    members: list[Member] = []
    for line, text in card.lines():
        own = [word for word in fields(text) if word]
        given = [number for word in own if (number := plain_number(word)) is not None]
        if len(given) < len(own) or len(own) not in (2, 3):
            raise card.error("GENERATE", line=line, got=text.strip()[:40], expected="first, last, step")
        first, last, step = (*given, 1)[:3]
        if first > last or step < 1:
            raise card.error(
                "GENERATE", line=line, got=text.strip()[:40], expected="first <= last and a step of 1 or more"
            )
        members.append(Range(first, last, step, owner))
    if not members:
        raise card.error(f"a {what} set with GENERATE and no numbers", cure="give first, last, step")
    return members


def surface(reader: Reader, card: KeywordCard) -> None:
    given = card.known(
        *("NAME", "TYPE", "COMBINE"),
        ignored=(
            *(
                "INTERNAL",
                "TRIM",
                "NOOFFSET",
                "NOTHICK",
                "MAXRATIO",
                "SCALETHICK",
                "REGIONTYPE",
                "FILLETRADIUS",
            ),
            *("CROP", "DEFINITION", "OFFSET", "PROPERTY"),
        ),
    )
    name = label(card.needed(given, "NAME"))
    kind = label(given.get("TYPE") or "ELEMENT").key
    if kind not in ("ELEMENT", "NODE") or given.get("COMBINE") or "CROP" in given:
        what = (
            f"COMBINE={given['COMBINE']}"
            if given.get("COMBINE")
            else "CROP"
            if "CROP" in given
            else f"TYPE={given['TYPE']}"
        )
        reader.refused[name.shown] = f"a surface with {what}, which is not read"
        return
    found = reader.scope.surfaces.setdefault(name.key, Surface(name.shown, card, kind == "NODE"))
    if found.of_nodes != (kind == "NODE"):
        raise card.error(f"{name.shown} is a surface of nodes and of elements", cure="give it another name")
    for line, text in card.lines():
        word, face = (*fields(text), "")[:2]
        found.lines.append(SurfaceLine(word, "" if kind == "NODE" else label(face).key, line))


def refused(reader: Reader, card: KeywordCard) -> None:
    raise card.error(
        "changes the mesh and is not read", cure="write the deck with the mesh as it is after it"
    )


HANDLERS: dict[str, Callable[[Reader, KeywordCard], None]] = {
    "NODE": node,
    "ELEMENT": element,
    "NSET": node_set,
    "ELSET": element_set,
    "SURFACE": surface,
    "SYSTEM": place.system,
    "PART": place.part,
    "ENDPART": place.end_part,
    "ASSEMBLY": place.assembly,
    "ENDASSEMBLY": place.end_assembly,
    "INSTANCE": place.instance,
    "ENDINSTANCE": place.end_instance,
    "NGEN": generate.nodes_between,
    "NFILL": generate.fill,
    "NCOPY": generate.copy_nodes,
    "ELGEN": generate.elements,
    "ELCOPY": generate.copy_elements,
    **dict.fromkeys(
        (
            "NMAP",
            "IMPERFECTION",
            "SYMMETRICMODELGENERATION",
            "IMPORT",
            "IMPORTNSET",
            "IMPORTELSET",
            "SUBSTRUCTUREPROPERTY",
        ),
        refused,
    ),
}

MECHANICS = {
    *(
        "TIE",
        "EQUATION",
        "MPC",
        "COUPLING",
        "KINEMATIC",
        "KINEMATICCOUPLING",
        "DISTRIBUTING",
        "DISTRIBUTINGCOUPLING",
    ),
    *(
        "RIGIDBODY",
        "EMBEDDEDELEMENT",
        "CONTACT",
        "CONTACTPAIR",
        "SHELLTOSOLIDCOUPLING",
        "FASTENER",
        "MODELCHANGE",
    ),
    *(
        "CYCLICSYMMETRYMODEL",
        "PRE-TENSIONSECTION",
        "CLEARANCE",
        "CONNECTORSECTION",
        "SPRING",
        "DASHPOT",
        "MASS",
    ),
    *("DISPLAYBODY", "RELEASE", "INITIALCONDITIONS", "TIEDCONTACT", "NETWORKMPC", "REBAR", "REBARLAYER"),
    *("NONSTRUCTURALMASS", "ROTARYINERTIA", "FOUNDATION"),
}
"""Keywords that change how the body moves; cases say such things, or do not have them."""
HARMLESS = {"HEADING", "PREPRINT", "RESTART", "PARAMETER"}
