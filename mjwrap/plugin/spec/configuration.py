"""Write and read the configuration of an instance of the plugin, which is stored in the model.

It has the names of muscles without the prefixes that `attach` adds; the instance's own name has these prefixes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from urllib.parse import quote, unquote

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.marks import IDLE, PLUGIN_INSTANCE, is_own_instance, read_side_rule
from mjwrap.plugin.mujoco_c.library import library
from mjwrap.plugin.mujoco_c.registration import (
    ATTRIBUTES,
    MODE,
    MUSCLES,
    NUMBERS,
    PLUGIN_NAME,
    SIDE_RULE,
)

WRENCH, TRANSMISSION = "wrench", "transmission"
MODES = (WRENCH, TRANSMISSION)


class Configuration(NamedTuple):
    """The names of an instance's muscles, its number of entries of plugin_state, its mode, and its side rule."""

    muscles: list[str]
    numbers: int
    mode: str
    side_rule: int


def configuration_texts(muscles: list[str], numbers: int, mode: str, side_rule: int) -> dict[str, str]:
    """Return a configuration as MuJoCo stores it; names are quoted as in URLs and separated by spaces."""
    names = " ".join(quote(name, safe="/") for name in muscles)
    return {MUSCLES: names, NUMBERS: str(numbers), MODE: mode, SIDE_RULE: str(side_rule)}


def parse_configuration(name: str, texts: Mapping[str, str]) -> Configuration:
    """Return the configuration of an instance from its name and texts; `ModelError` if mjwrap did not write it."""
    muscles, numbers, mode, side_rule = (texts.get(key, "") for key in ATTRIBUTES)
    if not is_own_instance(name) or not numbers.isdigit() or mode not in MODES:
        raise ModelError(
            f"plugin instance '{name}' was not made by mjwrap.install; remove it and call install on the MjSpec"
        )
    prefix = name.removesuffix(PLUGIN_INSTANCE)
    names = [prefix + unquote(part) for part in muscles.split()]
    return Configuration(names, int(numbers), mode, read_side_rule(side_rule.encode()))


def configuration_of(element: mujoco.MjsPlugin) -> Configuration:
    """Return the configuration of an instance in an MjSpec."""
    return parse_configuration(element.name, dict(element.config))


def configuration_at(model: int, instance: int) -> Configuration:
    """Return the configuration of an instance of the model at an address."""
    lib = library()
    name = lib.mj_id2name(model, int(mujoco.mjtObj.mjOBJ_PLUGIN), instance) or b""
    texts = {key: lib.mj_getPluginConfig(model, instance, key.encode()) or b"" for key in ATTRIBUTES}
    told = {key: text.decode(errors="replace") for key, text in texts.items()}
    return parse_configuration(name.decode(), told)


def is_idle(model: int, instance: int) -> bool:
    """Return whether an instance of the model at an address drives nothing (`plugin/uninstalling.py`)."""
    text = library().mj_getPluginConfig(model, instance, MUSCLES.encode()) or b""
    return bool(text.startswith(bytes([IDLE])))


def spec_instances(spec: mujoco.MjSpec) -> list[mujoco.MjsPlugin]:
    """Return the instances of mjwrap's plugin in an MjSpec, including those of attached models."""
    return [element for element in spec.plugins if element.plugin_name == PLUGIN_NAME]
