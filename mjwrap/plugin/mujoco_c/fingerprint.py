"""Hash the parts of a model that the plugin reads, without copying it; models with equal hashes share arrays.

The arrays of an mjModel are consecutive in one buffer, so that each ends where the next begins. Meshes, textures and
similar arrays, which have nearly all of its bytes, are left out: no muscle depends on them.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib

from mjwrap.plugin.mujoco_c.offsets import ModelBuffer, model_buffer

_LEFT_OUT = ("mesh_", "tex_", "mat_", "skin_", "hfield_", "bvh_", "oct_", "flex", "light_", "cam_", "key_")


@functools.cache
def buffer_layout() -> ModelBuffer:
    """Return the layout of mjModel's arrays, found once."""
    return model_buffer()


def fingerprint(address: int) -> bytes | None:
    """Return the hash of the model at an address, or None if its arrays are not laid out as expected."""
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
