"""Hashes what the plugin reads of a model, without copying it; models of one hash share their muscles' arrays.

The arrays of an mjModel lie one after the other in one buffer, so each ends where the next begins. Meshes, textures and
the like, nearly all of its bytes, are left out: no muscle depends on them.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib

from mjwrap.plugin.mujoco_c.offsets import ModelBuffer, model_buffer

_LEFT_OUT = ("mesh_", "tex_", "mat_", "skin_", "hfield_", "bvh_", "oct_", "flex", "light_", "cam_", "key_")


@functools.cache
def buffer_layout() -> ModelBuffer:
    """Return where mjModel keeps its arrays, found once."""
    return model_buffer()


def fingerprint(address: int) -> bytes | None:
    """Return the hash of the model at an address, or None where its arrays do not lie as they should."""
    layout = buffer_layout()
    start = ctypes.c_uint64.from_address(address + layout.buffer).value
    end = start + ctypes.c_int64.from_address(address + layout.nbuffer).value
    places = sorted(
        (ctypes.c_uint64.from_address(address + at).value, name) for name, at in layout.arrays.items()
    )
    if not places or places[0][0] < start or places[-1][0] > end:
        return None
    digest = hashlib.blake2b((ctypes.c_char * layout.sizes).from_address(address), digest_size=16)
    ends = [place for place, _ in places[1:]] + [end]
    for (place, name), stop in zip(places, ends, strict=True):
        if stop > place and not name.startswith(_LEFT_OUT):
            digest.update(name.encode() + b"\0")
            digest.update((ctypes.c_char * (stop - place)).from_address(place))
    return digest.digest()
