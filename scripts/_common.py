"""What the scripts share: errors in one line, exit codes, models, start states, output files, progress, Ctrl-C."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import signal
import sys
import uuid
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any, NoReturn

try:
    import mujoco

    from mjwrap.errors import GeometryError, MjwrapError, ModelError, SignalError
    from mjwrap.mjcf import name_of, names, read_model
except ModuleNotFoundError as error:
    sys.exit(f"{error}; from mjwrap's folder, first install it: {sys.executable} -m pip install '.[demo]'")

USER_ERROR, RUN_FAILED, INTERRUPTED = 2, 1, 130
INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}
_MYO = "myo_sim:"
_MYO_NOISE = (
    "Attaching a spec with an empty prefix"  # myo_sim's models do that; it matters for saving them only
)


class UserError(Exception):
    """Something that the user can mend; the message says what, and what exists instead."""


class RunError(Exception):
    """A run that could not be finished, through nobody's mistake on the command line."""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message and stop."""
        self.exit(USER_ERROR, f"{self.prog}: {message} (see {self.prog} --help)\n")


def run(name: str, body: Callable[[], int]) -> int:
    """Run a script's body; errors become one line on standard error and an exit code.

    2: the user can mend it; 1: the run failed; 130: Ctrl-C. Output files that are not finished are removed.
    """
    try:
        with _quiet_mujoco(name):
            return body()
    except (UserError, ModelError, SignalError, GeometryError) as error:
        return _say(name, error, USER_ERROR)
    except (RunError, MjwrapError) as error:
        return _say(name, error, RUN_FAILED)
    except MemoryError:
        return _say(name, "out of memory", RUN_FAILED)
    except KeyboardInterrupt:
        return _say(name, "stopped by Ctrl-C", INTERRUPTED)
    except BrokenPipeError:  # whoever reads standard output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return RUN_FAILED
    finally:
        Output.discard_open()


def _say(name: str, error: object, code: int) -> int:
    print(f"{name}: {' '.join(str(error).split())}", file=sys.stderr)
    return code


@contextlib.contextmanager
def _quiet_mujoco(name: str) -> Iterator[None]:
    """Show each of MuJoCo's warnings once, on standard error, and leave no MUJOCO_LOG.TXT behind."""
    seen: set[str] = set()

    def show(text: str) -> None:
        kind = text.split(".")[0]
        if kind not in seen and not kind.startswith(_MYO_NOISE):
            seen.add(kind)
            print(f"{name}: MuJoCo warns: {' '.join(text.split())}", file=sys.stderr)

    mujoco.set_mju_user_warning(show)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)


def load(source: str) -> mujoco.MjModel:
    """Load an MJCF or MJB file, or "myo_sim:NAME", a model that the myo_sim package composes."""
    if not source.startswith(_MYO):
        return read_model(source)
    name = source.removeprefix(_MYO)
    try:
        import myo_sim
    except ImportError:
        raise UserError(f"'{source}' needs the myo-sim package: pip install 'mjwrap[myo]'") from None
    known = sorted({*myo_sim.REGISTRY, *myo_sim._composed_models()})
    if name not in known:
        raise UserError(f"myo_sim has no model '{name}'; it has: {', '.join(known)}")
    with warnings.catch_warnings():  # of its own making, about saving the model as XML
        warnings.simplefilter("ignore")
        model: Any = myo_sim.load_model(name)
    return model


def start_keyframe(model: mujoco.MjModel, name: str | None) -> int:
    """Return the id of a keyframe, -1 for None."""
    if name is None:
        return -1
    known = names(model, mujoco.mjtObj.mjOBJ_KEY, model.nkey)
    if name not in known:
        raise UserError(f"no keyframe '{name}'; keyframes: {', '.join(known) or 'none'}")
    return known.index(name)


def start_state(model: mujoco.MjModel, key: int, positions: Sequence[str]) -> mujoco.MjData:
    """Return data at a keyframe (-1: qpos0) with single joints at given positions ("name=value", rad or m)."""
    data = mujoco.MjData(model)
    if key >= 0:
        mujoco.mj_resetDataKeyframe(model, data, key)
    for entry in positions:
        name, _, text = entry.partition("=")
        joint = find_joint(model, name, entry)
        data.qpos[model.jnt_qposadr[joint]] = number(text, f"'{entry}'")
    return data


def find_joint(model: mujoco.MjModel, name: str, entry: str) -> int:
    """Return the id of a hinge or slide."""
    single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    fit = {
        name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j): j
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in single
    }
    if name not in fit:
        raise UserError(f"'{entry}': no hinge or slide '{name}'; there are: {', '.join(fit) or 'none'}")
    return fit[name]


def number(text: str, where: str) -> float:
    """Return a finite number, or say where it is not one."""
    try:
        value = float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r} is not a number") from None
    if not math.isfinite(value):
        raise UserError(f"{where}: {text} is not finite")
    return value


def positive(text: str) -> float:
    """Return a finite number above zero, for argparse."""
    value = float(text)
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number above zero")
    return value


def not_negative(text: str) -> float:
    """Return a finite number, zero or more, for argparse."""
    value = float(text)
    if not (math.isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number, zero or more")
    return value


def at_least(least: int) -> Callable[[str], int]:
    """Return the argparse type of a whole number of at least `least`."""

    def whole(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"{text} must be {least} or more")
        return value

    whole.__name__ = "whole number"
    return whole


class Output:
    """A file that appears whole, under its own name, or not at all.

    The place is tried at once, so that an unwritable one shows before a run. `part` is written to, `publish` gives it
    the name `path`; an older file of that name stays until then. What is not published is removed at the end.
    """

    _open: list[Output] = []  # noqa: RUF012

    def __init__(self, path: str, option: str, suffixes: Sequence[str]) -> None:
        self.path, self.option = Path(path), option
        self._file: IO[str] | None = None
        if self.path.suffix.lower() not in suffixes:
            raise UserError(f"{option} '{path}': the name must end in {' or '.join(suffixes)}")
        if any(other.path.resolve() == self.path.resolve() for other in Output._open):
            raise UserError(f"{option} '{path}': another output goes to the same file")
        if self.path.exists() and not (self.path.is_file() and os.access(self.path, os.W_OK)):
            raise UserError(f"cannot write {option} '{path}': it is not a file, or write-protected")
        unique = f"{os.getpid()}-{uuid.uuid4().hex[:8]}"
        self.part = self.path.with_name(f".{self.path.stem}.{unique}.part{self.path.suffix}")
        try:
            self.part.open("xb").close()
        except OSError as error:
            raise UserError(f"cannot write {option} '{path}': {_reason(error, self.path)}") from None
        Output._open.append(self)

    def open_text(self) -> IO[str]:
        """Return the part, open for text; it is closed with the output."""
        self._file = self.part.open("w", encoding="utf-8", newline="")
        return self._file

    def publish(self) -> None:
        """Put the finished file on the disk and give it its name."""
        with self.writing():
            if self._file is not None:
                self._file.close()
            with self.part.open("rb+") as file:
                os.fsync(file.fileno())
            os.replace(self.part, self.path)
        Output._open.remove(self)

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Turn what the disk refuses inside a with block into an error in one line."""
        try:
            yield
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise RunError(
                f"writing {self.option} '{self.path}' failed: {reason}; nothing was kept of it"
            ) from None

    @classmethod
    def discard_open(cls) -> None:
        """Remove every part that has not become a file."""
        for output in cls._open:
            with contextlib.suppress(OSError):
                if output._file is not None:
                    output._file.close()
            with contextlib.suppress(OSError):
                output.part.unlink(missing_ok=True)
        cls._open.clear()


def _reason(error: OSError, path: Path) -> str:
    folder = path.absolute().parent
    if isinstance(error, FileNotFoundError) and not folder.exists():
        existing = next(parent for parent in folder.parents if parent.exists())
        return f"there is no folder '{folder}' (the path exists as far as '{existing}')"
    return (error.strerror or str(error)).lower()


class Interrupt:
    """Ctrl-C asks a loop to end: look at `asked` once a turn. A second Ctrl-C stops at once."""

    def __init__(self) -> None:
        self.asked = False

    def __enter__(self) -> Interrupt:
        self._before = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _handle(self, *_: object) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True


def progress_bar(total: float, unit: str, label: str) -> Any:
    """Return a bar with `update(n)` and `close()` that shows after two seconds, on a terminal only."""
    if sys.stderr.isatty():
        with contextlib.suppress(ImportError):
            from tqdm import tqdm

            form = "{desc}: {percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]"
            return tqdm(total=total, unit=unit, desc=label, delay=2.0, leave=False, bar_format=form)
    return _NoBar()


class _NoBar:
    def update(self, n: float) -> None:
        """Do nothing."""

    def set_description_str(self, text: str) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


def need_matplotlib() -> None:
    """Raise `UserError` before a run whose plot could not be drawn."""
    try:
        import matplotlib
    except ImportError:
        raise UserError("--plot needs matplotlib: pip install 'mjwrap[demo]'") from None
    matplotlib.use("Agg")
