"""The exceptions, in one tree.

Every error that mjwrap raises for a reason that its user can correct is a `MjwrapError`. Each is also the
built-in exception that fits, so that `except ValueError` keeps working. A message names the element, says
what is wrong with it, and lists what exists instead.
"""


class MjwrapError(Exception):
    """Root of every error that mjwrap raises on purpose; catch it to catch them all."""


class ModelError(MjwrapError, ValueError):
    """An MJCF model or one of its muscle declarations cannot be used as it stands.

    The message names the muscle and the element at fault, and lists the names that the model has.
    """


class GeometryError(MjwrapError, ValueError):
    """A surface or a point has a size or a position that no path can be computed with.

    Radii [m] must be finite and positive, points (3,) [m] finite, quaternions (4,) finite and not zero.
    """


class PathError(MjwrapError, RuntimeError):
    """A muscle's path could not be found, and the caller asked to be stopped for that (`strict=True`).

    Without `strict` the status of the solution says the same and nothing is raised.
    """


class StateError(MjwrapError, ValueError):
    """A simulation state (position, velocity, activation, control) is not finite."""


class SignalError(MjwrapError, ValueError):
    """An excitation, control or prescribed motion cannot be read: a wrong pattern, file or name.

    The message names the pattern, or file, line and column, and lists what exists.
    """


class TableError(SignalError):
    """A table over time cannot be read or written; the message names file, line and column."""


class RecordingError(MjwrapError, OSError):
    """A recording could not be written: no such folder, no permission, or no space left."""


class VersionError(MjwrapError, RuntimeError):
    """The installed MuJoCo is too old, or is not one that the engine plugin can verify.

    In the second case `MuscleSystem` works without the plugin.
    """
