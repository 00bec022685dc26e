"""The MJCF document that an import fills: its sections, bodies by name, and numbers in full precision."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from xml.etree import ElementTree

import mujoco
import numpy as np

from mjwrap.errors import OsimError

SECTIONS = ("compiler", "option", "size", "asset", "worldbody", "deformable", "contact", "equality", "tendon",
            "actuator", "sensor", "custom", "keyframe")  # fmt: skip


def text_of(value: object) -> str:
    """Return an attribute's text: numbers so that reading them gives the same bits, sequences with spaces."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, Iterable):
        return " ".join(text_of(item) for item in value)
    number = float(value)  # type: ignore[arg-type]
    if abs(number) < sys.float_info.min:  # MuJoCo's reader refuses numbers that are not normal
        return "0"
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)


class Document:
    """An MJCF model in the making. `bodies` has the element of every OpenSim body, and of "ground", the world."""

    def __init__(self, name: str) -> None:
        self.root = ElementTree.Element("mujoco", model=name)
        self._sections = {tag: ElementTree.Element(tag) for tag in SECTIONS}
        self.bodies: dict[str, ElementTree.Element] = {"ground": self._sections["worldbody"]}
        self.assets: dict[
            str, bytes
        ] = {}  # contents of mesh files, by the name under which the model refers to them

    def section(self, tag: str) -> ElementTree.Element:
        """Return a section, one of `SECTIONS`."""
        return self._sections[tag]

    def add(self, parent: ElementTree.Element | str, tag: str, **attributes: object) -> ElementTree.Element:
        """Add an element to another one or to a section; attributes that are None are left out. `class_` is `class`."""
        where = self._sections[parent] if isinstance(parent, str) else parent
        given = {key.rstrip("_"): text_of(value) for key, value in attributes.items() if value is not None}
        return ElementTree.SubElement(where, tag, given)

    def numeric(self, name: str, data: Iterable[float]) -> str:
        """Add a numeric to `custom`; return its name."""
        self.add("custom", "numeric", name=name, data=list(data))
        return name

    def compile(self) -> mujoco.MjModel:
        """Return the model as it is so far, compiled.

        Raises:
            OsimError: MuJoCo refuses it; the message says why.
        """
        try:
            return mujoco.MjModel.from_xml_string(self.to_xml(), self.assets)
        except ValueError as error:
            raise OsimError(f"MuJoCo does not accept the model: {error}") from None

    def to_xml(self) -> str:
        """Return the text of the model."""
        root = ElementTree.Element(self.root.tag, self.root.attrib)
        for tag in SECTIONS:
            section = self._sections[tag]
            if len(section) or section.attrib:
                root.append(section)
        ElementTree.indent(root)
        return ElementTree.tostring(root, encoding="unicode") + "\n"
