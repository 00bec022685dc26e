"""The settings of `mjwrap replay`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mjwrap.cli.common.recorded import RecordingSettings


@dataclass(frozen=True)
class StatesSettings:
    """The settings for a table of states.

    model: a file or a model by name. keyframe: gives the values that the table lacks, None for qpos0. side_rule: as for
    `MuscleSystem`. table: a file for the quantities named in `kinds`, or None. analysis: the prefix of tables in
    OpenSim's layout, or None. motion: a file of coordinates that OpenSim replays, or None.
    """

    model: str
    keyframe: str | None
    recording: RecordingSettings
    side_rule: int | None = None
    table: str | None = None
    kinds: Sequence[str] = ()
    analysis: str | None = None
    motion: str | None = None

    @property
    def kept(self) -> bool:
        """Whether a file is written or a viewer connected."""
        return bool(self.recording.wanted or self.table or self.analysis or self.motion)


@dataclass(frozen=True)
class ReplaySettings:
    """The settings of `mjwrap replay`.

    file: a recording, or a table of states; states: the settings for the latter. serve: show it in a browser, at
    `port`. info: only describe it. json: a file for the description as values, "-" for standard output, or None.
    """

    file: str
    states: StatesSettings | None
    serve: bool
    port: int
    info: bool = False
    json: str | None = None
