"""Damaged .osim files: texts with one thing wrong."""

import copy
import re
from xml.etree import ElementTree

import numpy as np

NUMBERS = ("", "abc", "nan", "1e999", "1 2", "--1", "0x10", "1,5", "-3", "0", "1" * 400, "\u0663")
EXTREME = ("1e30", "1e308", "1e20", "1e-300", "1e-12", "-1", "0", "1000", "-1e5", "7", "1e6")


def plain(text: str) -> str:
    return re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL).replace("::", "__")


def mutant(text: str, rng: np.random.Generator) -> str:
    """Return a text with one thing wrong: cut, an element gone, doubled or renamed, a number or a name broken."""
    kind = rng.integers(0, 8)
    if kind == 0:
        return text[: rng.integers(0, len(text))]
    if kind == 1:
        start = rng.integers(0, len(text))
        return text[:start] + text[start + rng.integers(1, 60) :]
    root = ElementTree.fromstring(plain(text))
    parents = [(parent, child) for parent in root.iter() for child in parent]
    parent, child = parents[rng.integers(0, len(parents))]
    if kind == 2:
        parent.remove(child)
    elif kind == 3:
        parent.append(copy.deepcopy(child))
    elif kind == 4:
        child.tag = child.tag[::-1]
    elif kind == 5:
        leaves = [e for e in root.iter() if e.text and re.match(r"\s*-?[\d.]", e.text)]
        leaf = leaves[rng.integers(0, len(leaves))]
        leaf.text = NUMBERS[rng.integers(0, len(NUMBERS))]
    elif kind == 6:
        leaves = [e for e in root.iter() if e.text and re.match(r"\s*[/A-Za-z]", e.text)]
        leaf, other = (leaves[i] for i in rng.integers(0, len(leaves), 2))
        leaf.text = other.text
    else:
        named = [e for e in root.iter() if "name" in e.attrib]
        element, other = (named[i] for i in rng.integers(0, len(named), 2))
        element.attrib["name"] = "" if rng.random() < 0.3 else other.attrib["name"]
    return ElementTree.tostring(root, encoding="unicode").replace("__", "::")


def extreme(text: str, rng: np.random.Generator) -> str:
    """Return a text with one of its numbers replaced by one that is too large, too small or of the wrong sign."""
    spots = list(re.finditer(r">\s*(-?\d[^<]*)<", text))
    spot = spots[rng.integers(0, len(spots))]
    words = spot[1].split()
    words[rng.integers(0, len(words))] = EXTREME[rng.integers(0, len(EXTREME))]
    return text[: spot.start(1)] + " ".join(words) + text[spot.end(1) :]
