"""The exceptions of mjwrap.

Every error that a user can correct is a `MjwrapError`. Each is also a built-in exception of the same kind, so that
`except ValueError` works too. A message names the element, says what is wrong with it, and lists what exists instead.
"""


class MjwrapError(Exception):
    """The base class of all errors of mjwrap."""


class ModelError(MjwrapError, ValueError):
    """An MJCF model or one of its muscle declarations cannot be used.

    The message names the muscle and the element, and lists the names that exist in the model.
    """


class OsimError(ModelError):
    """An .osim file cannot be read or imported.

    The message names the file, the line and the element, and says what to do.
    """


class GeometryError(MjwrapError, ValueError):
    """A surface or a point has a size or a position with which no path can be computed.

    Radii [m] must be finite and positive, points (3,) [m] finite, quaternions (4,) finite and not zero.
    """


class PathError(MjwrapError, RuntimeError):
    """A muscle's path could not be found, and `strict=True` was given.

    Without `strict` nothing is raised, and the status of the solution gives the reason.
    """


class StateError(MjwrapError, ValueError):
    """A simulation state (position, velocity, activation, control) is not valid, or a call does not fit the state."""


class SignalError(MjwrapError, ValueError):
    """An excitation, control or prescribed motion has a wrong pattern, file or name.

    The message names the pattern, or the file, line and column, and lists what exists.
    """


class TableError(SignalError):
    """A table over time cannot be read or written; the message names file, line and column."""


class RecordingError(MjwrapError, OSError):
    """A recording, film or output file cannot be written, or a recording cannot be read."""


class VersionError(MjwrapError, RuntimeError):
    """The installed MuJoCo is too old, or the engine plugin cannot verify its layout.

    In the second case `MuscleSystem` works without the plugin.
    """


class MissingPackageError(MjwrapError, ImportError):
    """A package that mjwrap needs for this is not installed; the message says which one, and how to install it."""
