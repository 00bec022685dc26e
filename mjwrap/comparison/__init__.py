"""Compare MuJoCo's own tendons with mjwrap's paths: at the same poses, in the same motion, and which one is correct.

`compare_poses` sweeps every joint and draws random poses; `compare_motion` simulates both. Every path is judged by
its geometry (`judge_geodesic.judge`), independently of both programs.
"""

from __future__ import annotations

from mjwrap.comparison.jumps import Jump
from mjwrap.comparison.motion import MotionDifference, compare_motion, with_native_laws
from mjwrap.comparison.pose_comparison import PoseComparison, compare_poses
from mjwrap.comparison.tables import TableDifference, compare_tables
from mjwrap.comparison.verdict import AGREE, MuscleSummary, Outcome
from mjwrap.comparison.verdict_text import Verdict, verdict

__all__ = [
    "AGREE",
    "Jump",
    "MotionDifference",
    "MuscleSummary",
    "Outcome",
    "PoseComparison",
    "TableDifference",
    "Verdict",
    "compare_motion",
    "compare_poses",
    "compare_tables",
    "verdict",
    "with_native_laws",
]
