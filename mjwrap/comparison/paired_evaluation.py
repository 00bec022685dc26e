"""Evaluate MuJoCo's tendons and mjwrap's paths at the same poses: lengths, velocities, moment arms, judgements."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.judge_geodesic import (
    ANGLE,
    INSIDE_TOLERANCE,
    SAME_TURN,
    Fault,
    judge,
    judge_held,
    lifted,
    opposite,
)
from mjwrap.comparison.motion_records import (
    Frames,
    Numbers,
    assign_contacts,
    in_frame,
    is_cylinder,
    own_points,
)
from mjwrap.comparison.tendons import Span, SpanPoints, WrapRecord, muscle_spans, tendon_spans
from mjwrap.mjcf.inside import reference_pose
from mjwrap.poses.continuation import PathFollower, SweepTrace
from mjwrap.poses.joint_sweeps import PoseSequence
from mjwrap.poses.sizes import route_size, turning_dofs
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LENGTH = (
    3e-9  # largest difference of a path's length from the sum of its parts, as a share of the muscle's size
)
TURN = 2.0 * np.pi
# why a muscle is not compared whose path MuJoCo does not have
PLACEHOLDER, NO_TENDON = (
    "its tendon is a placeholder: mjwrap's route is different",
    "it has no tendon in MuJoCo",
)
NARROW = 1e-6  # the same of two points that coincide, so that rounding chooses the direction between them


@dataclass
class PathRecord:
    """One program's path of one muscle over a motion, (T,) each, and its judgement.

    length [m], velocity [m/s], jacobian (T, nv) ∂l/∂q; fault: `Fault` of the worst span, measure: of this fault, span:
    index of this span; turns (T, spans) [rad]: the branch, see `judge_geodesic.Judgement`; touched (T, spans); hinted
    (T, spans): whether it passes a cylinder on the side that its side site means, by the muscle's side rule; true if it
    has no side site.
    """

    length: Array
    velocity: Array
    jacobian: Array
    fault: Ints
    measure: Array
    span: Ints
    turns: Array
    touched: NDArray[np.bool_]
    hinted: NDArray[np.bool_]


class _ComparedMuscle(NamedTuple):
    """A muscle to compare: name, index in the MuscleSystem or -1, tendon, spans, size [m] (`poses/sizes.py`)."""

    name: str
    index: int
    tendon: int
    spans: list[Span]
    size: float


@dataclass
class MusclePair:
    """One muscle in both programs over a motion.

    index: in the `MuscleSystem`; status (T,): of mjwrap. A muscle that stays with MuJoCo has index -1, mjwrap None.
    size: of the muscle [m]; arms (nv,): sizes of its moment arms, the size about joints that turn and 1 along slides.
    tie (T,): the ends of a span are opposite to each other, seen from its sphere's centre, so that all ways round are
    equally long; kink (T,): two stops coincide, so that there is no direction from one to the other, or an end lies on
    the surface in which a span is held.
    """

    name: str
    index: int
    tendon: int
    spans: list[Span]
    native: PathRecord
    mjwrap: PathRecord | None
    status: Ints
    size: float
    arms: Array
    tie: NDArray[np.bool_]
    kink: NDArray[np.bool_]


@dataclass
class Batch:
    """All compared muscles over one motion; trace: of all muscles of mjwrap."""

    motion: PoseSequence
    trace: SweepTrace
    pairs: list[MusclePair] = field(default_factory=list)


class Comparer:
    """Evaluate motions with both programs.

    muscles: a `MuscleSystem`; wanted: names of the muscles to compare, also of muscles that stay with MuJoCo. Muscles
    whose route in mjwrap differs from their tendon, and muscles without a spatial tendon, are left out; `left_out` has
    their names and the reasons.
    """

    def __init__(self, muscles: MuscleSystem, wanted: Sequence[str]) -> None:
        self.muscles, self.model = muscles, muscles.model
        # MuJoCo's tendons need no contacts and no constraints; a copy leaves the caller's options unchanged.
        self._native = copy.copy(self.model)
        off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self._native.opt.disableflags |= int(off)
        self._native_data = mujoco.MjData(self._native)
        mujoco.mj_kinematics(self._native, self._native_data)
        self.data = mujoco.MjData(self.model)
        self.follower = PathFollower(muscles, self.data)
        self._turning = turning_dofs(self.model)
        self._rest = reference_pose(self.model)
        self.left_out: dict[str, str] = {}
        self._selected: list[_ComparedMuscle] = []
        for name in wanted:
            found = self._compared(name)
            if isinstance(found, str):
                self.left_out[name] = found
            else:
                self._selected.append(found)

    def _compared(self, name: str) -> _ComparedMuscle | str:
        """Return the muscle to compare, or the reason why it cannot be compared."""
        model = self.model
        if name in self.muscles.names:
            index = self.muscles.index(name)
            declared = self.muscles.declarations[index]
            if declared.tendon < 0:
                return NO_TENDON
            own = muscle_spans(declared)
            spans = tendon_spans(model, self._native_data, declared.tendon)
            if own is None or [span._replace(turn=0.0) for span in own] != spans:
                return PLACEHOLDER
            return self._sized(name, index, declared.tendon, own)
        actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if actuator < 0 or int(model.actuator_trntype[actuator]) != int(mujoco.mjtTrn.mjTRN_TENDON):
            return "it has no spatial tendon"
        tendon = int(model.actuator_trnid[actuator, 0])
        spans = tendon_spans(model, self._native_data, tendon)
        return self._sized(name, -1, tendon, spans) if spans else "it has no spatial tendon"

    def _sized(self, name: str, index: int, tendon: int, spans: list[Span]) -> _ComparedMuscle:
        legs = [(span.start, span.end, span.weight) for span in spans]
        geoms = [span.geom for span in spans if span.geom >= 0]
        size = route_size(self.model, self._rest, legs, geoms)
        return _ComparedMuscle(name, index, tendon, spans, size)

    def evaluate(self, motion: PoseSequence, start: Array | None = None) -> Batch:
        """Evaluate all poses of a motion; start (nq,): pose from which a continuous motion takes its branches."""
        count, nv = len(motion.at), self.model.nv
        native, mine = Numbers(count, self.model.ntendon, nv), Numbers(count, self.muscles.n, nv)
        wraps = WrapRecord(self.model, count)
        contacts: list[dict[int, Array]] = []
        geoms = Frames(count, self.model)
        taken = [muscle.index for muscle in self._selected if muscle.index >= 0]
        branches: list[Array] = []
        self.muscles.reset(self.data)
        if motion.continuous and start is not None:
            self.follower.move_to(start, motion.qpos[0])
        for k in range(count):
            native.keep(k, *self.native_at(motion.qpos[k], motion.qvel[k]))
            wraps.keep(k, self._native_data)
            geoms.keep(k, self._native_data)
            if not motion.continuous:
                self.muscles.reset(self.data)
            mine.keep(k, *self.mjwrap_at(motion.qpos[k], motion.qvel[k]))
            contacts.append({i: self.muscles.contact_points(i) for i in taken})
            branches.append(self.muscles.branch(self.data))
        slopes = np.einsum("tnv,tv->tn", mine.jacobian, motion.tangent)
        batch = Batch(motion, SweepTrace(motion.at, mine.length, slopes, mine.status == 0, branches))
        for name, index, tendon, spans, size in self._selected:
            points = wraps.points(tendon, spans)
            record = self._record(spans, points, geoms, INSIDE_TOLERANCE, size, *native.of(tendon))
            own_record, status = None, np.zeros(count, dtype=np.int64)
            if index >= 0:
                own = [own_points(at) for at in points]
                assign_contacts(spans, own, [contact[index] for contact in contacts], self.model, geoms)
                own_record, status = (
                    self._record(spans, own, geoms, ANGLE, size, *mine.of(index)),
                    mine.status[:, index],
                )
            arms = np.where(self._turning, size, 1.0)
            tie, kink = self._degenerate(spans, points, geoms, size)
            batch.pairs.append(
                MusclePair(name, index, tendon, spans, record, own_record, status, size, arms, tie, kink)
            )
        return batch

    def native_at(self, qpos: Array, qvel: Array) -> tuple[Array, Array, Array]:
        """Return MuJoCo's tendon lengths (ntendon,), velocities and ten_J (ntendon, nv) at a state."""
        model, data = self._native, self._native_data
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        rows = np.zeros((model.ntendon, model.nv))
        counts, starts, columns = _sparse(model, data)
        mujoco.mju_sparse2dense(rows, data.ten_J.reshape(-1), counts, starts, columns)
        return data.ten_length.copy(), data.ten_velocity.copy(), rows

    def mjwrap_at(self, qpos: Array, qvel: Array) -> tuple[Array, Array, Array, Ints]:
        """Return mjwrap's lengths (n,), velocities, ∂l/∂q (n, nv) and status at a state, from its present branches."""
        self.data.qpos[:], self.data.qvel[:] = qpos, qvel
        jacobian = self.muscles.length_jacobian(self.data)
        muscles = self.muscles
        return muscles.length.copy(), muscles.velocity.copy(), jacobian, muscles.status.copy()

    def _degenerate(
        self, spans: list[Span], points: list[SpanPoints], geoms: Frames, size: float
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return at which poses (T,) a muscle has a tie, and a kink: see `MusclePair`."""
        tie, kink = (np.zeros(len(points[0].a), dtype=np.bool_) for _ in range(2))
        for span, at in zip(spans, points, strict=True):
            kink |= np.linalg.norm(at.b - at.a, axis=1) <= NARROW * size
            if span.geom < 0:
                continue
            ends = [geoms.local(span.geom, x) for x in (at.a, at.b)]
            if span.inside:
                flat = 2 if is_cylinder(self.model, span.geom) else 3
                radius = float(self.model.geom_size[span.geom, 0])
                for end in ends:
                    kink |= np.abs(np.linalg.norm(end[:, :flat], axis=1) - radius) <= NARROW * size
            elif not is_cylinder(self.model, span.geom):
                tie |= opposite(*ends)
        return tie, kink

    def _record(
        self, spans: list[Span], points: list[SpanPoints], geoms: Frames, angle: float, size: float,
        length: Array, velocity: Array, jacobian: Array,
    ) -> PathRecord:  # fmt: skip
        count = len(length)
        fault, measure, worst = np.zeros(count, dtype=np.int64), np.zeros(count), np.full(count, -1)
        turns, hinted = np.zeros((count, len(spans))), np.ones((count, len(spans)), dtype=np.bool_)
        total = np.zeros(count)
        for s, (span, at) in enumerate(zip(spans, points, strict=True)):
            straight = np.where(
                at.touched,
                np.linalg.norm(at.p - at.a, axis=1) + np.linalg.norm(at.b - at.q, axis=1),
                np.linalg.norm(at.b - at.a, axis=1),
            )
            arc = np.zeros(count)
            if span.geom >= 0:
                local = in_frame(self.model, span.geom, geoms, at)
                found = judge_held(*local, angle) if span.inside else judge(*local)
                turns[:, s], arc = found.turn, np.where(at.touched, found.arc, 0.0)
                if not span.inside:  # what lies between a surface and an end just below it does not count
                    cylinder, radius, a, b, _, p, q = local
                    over = np.linalg.norm(p - lifted(a, cylinder, radius), axis=1)
                    over += np.linalg.norm(lifted(b, cylinder, radius) - q, axis=1)
                    straight = np.where(at.touched, over, straight)
                if span.hint >= 0 and not span.inside:
                    side = geoms.local(span.geom, geoms.sites[:, span.hint])
                    if span.turn:
                        near = np.abs(span.turn - found.turn) < np.pi + SAME_TURN
                        most = np.abs(found.turn + TURN * np.round((span.turn - found.turn) / TURN))
                        hinted[:, s] = near | (
                            most > TURN
                        )  # more than one turn is followed in small steps only
                    else:
                        hinted[:, s] = np.einsum("ti,ti->t", found.middle[:, :2], side[:, :2]) > 0.0
                new = (found.fault > 0) & (fault == 0)
                fault[new], measure[new], worst[new] = found.fault[new], found.measure[new], s
            total += span.weight * (straight + arc)
        off = np.abs(total - length)
        new = (fault == 0) & ~(off <= LENGTH * size)
        fault[new], measure[new] = Fault.WRONG_LENGTH, off[new]
        touched = np.stack([at.touched for at in points], axis=1)
        return PathRecord(length, velocity, jacobian, fault, measure, worst, turns, touched, hinted)


def _sparse(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[NDArray[np.int32], ...]:
    """Return row counts, row starts and columns of ten_J; in newer MuJoCo they are in the model."""
    home = model if hasattr(model, "ten_J_rownnz") else data
    return home.ten_J_rownnz, home.ten_J_rowadr, home.ten_J_colind.reshape(-1)
