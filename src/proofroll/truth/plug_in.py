"""Plug-in for the truth of mechanisms: dataset and error bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.bounces import with_bounces
from proofroll.core.columns import Columns
from proofroll.core.dataset import BORDERS, ENDED, ENDS, LAWS
from proofroll.core.element import Element
from proofroll.core.errors import NotUnique
from proofroll.core.events import with_events
from proofroll.core.observable import Role
from proofroll.elements.mechanism.dynamics.held_signals import has_held
from proofroll.elements.mechanism.dynamics.named_forces import FIELDS, named_forces
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.local_frame import local_bars
from proofroll.elements.mechanism.run.contacts.observables import PRESSES, SLIDES
from proofroll.elements.mechanism.run.dataset import UNDETERMINED, columns
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import shared_pairs

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.truth.error_bars import Routed, TwoRouteMotion

# Error bar of the routes that a variable gets.
_BARS = {
    "p_WB": "p_WB", "v_WB": "v_WB", "w_WB": "w_WB", "q_WB": "q_WB", "attitudes": "q_WB", "positions": "points",
    "forces": "wrench", "torques": "wrench", "energy": "energy", "energy_error": "energy",
    "energy_change": "energy", "drift": "drift", "gaps": "gap", "slips": "slip", "normal_forces": "pressed",
    "contact_forces": "pressed", "pair_forces": "sums", "net_forces": "sums", "net_torques": "sums",
    "penetration": "gap", "contact_pull": "pressed", "cone_excess": "pressed",
    "hop_speed": "slip", "energy_gain": "energy", "bushing_forces": "links", "bushing_torques": "links",
}  # fmt: skip
_LEAST = 1e-3  # natural lengths that count as a motion, however little moves
_VAGUE = 0.1  # natural times that the bracket of an event exceeds where routes part
_PARTED = 1e-3  # part of the motion that a bar exceeds from where routes part
_POSES = ("p_WB", "v_WB", "w_WB", "q_WB")
_PREFIXES = {"work.": "work", "net_": "sums", "q.": "q", "v.": "v", "force.": "wrench", "torque.": "wrench"}
_PREFIXES |= dict.fromkeys((f"{field}." for field in FIELDS), "named")


class MechanismTruth:
    """Plug-in; see :class:`proofroll.core.truth.ElementTruth`."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True for every mechanism; those that two routes do not cover are refused later, with the reason."""
        return isinstance(element, MechanismElement)

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:  # noqa: ARG004 -- nothing can be asked for
        """See :func:`proofroll.truth.truth_of_mechanism.truth_of`; of motions that are not unique, laws alone."""
        # imports of a third of a second, which what has another truth does not need
        from proofroll.truth.check.answer import held_answer
        from proofroll.truth.error_bars import cut_motion
        from proofroll.truth.smooth.smooth_truth import branching
        from proofroll.truth.truth_of_mechanism import truth_of

        assert isinstance(element, MechanismElement)  # by ``covers``
        try:
            motion = truth_of(element.mechanism, times)
        except NotUnique as error:
            return _laws_alone(element, times, str(error))
        if unknown := _unknown_from(element, motion):
            motion = cut_motion(motion, *unknown)
        dataset = MechanismTruth._dataset(element, motion, branching(motion.branches))
        if motion.tiles is None:
            return dataset
        between = None if motion.between is None else _columns(element, motion.between)
        check = held_answer(element, dataset, motion.tiles, times, between)
        if text := check.residuals.broken("what the truth publishes"):
            assert check.residuals.first is not None  # as there is a text
            motion = cut_motion(motion, check.residuals.first.time, text)
            return MechanismTruth._dataset(element, motion, branching(motion.branches))
        dataset.attrs[LAWS] = "; ".join(filter(None, [motion.laws, check.sentence()]))
        return dataset

    @staticmethod
    def by_steps(element: Element) -> bool:
        """See :class:`proofroll.core.truth.TakesSteps`: contacts under held targets, or whose turning shares a cone."""
        assert isinstance(element, MechanismElement)  # by ``covers``
        return bool(element.mechanism.contacts) and (has_held(element.mechanism) or element.mechanism.shares_cone)

    @staticmethod
    def reference(element: Element, times: FloatArray, engines: Sequence[str]) -> xr.Dataset:
        """See :func:`proofroll.truth.by_steps.reference_by_steps`."""
        from proofroll.truth.by_steps import reference_by_steps

        assert isinstance(element, MechanismElement)  # by ``covers``
        return reference_by_steps(element, times, engines)

    @staticmethod
    def _dataset(element: MechanismElement, motion: TwoRouteMotion, branches: str) -> xr.Dataset:
        """Dataset of a motion with its bars; ``branches``: note on singular poses along it."""
        record = motion.record
        dataset = _columns(element, motion).dataset()
        points = [point.name for point in element.mechanism.points]
        fields_of = {
            f"{kind}.{contact.name}{axis}": field
            for contact in element.mechanism.contacts
            for kind, axes, field in (
                ("force", (".x", ".y", ".z"), "pressed"),
                ("torque", (".x", ".y", ".z"), "turning"),
                ("gap", ("",), "gap"),
                ("slip", ("",), "slip"),
            )
            for axis in axes
        }
        fields_of |= {f"force.{spring.name}": "links" for spring in element.mechanism.springs}
        fields_of |= {
            f"{kind}.{bushing.name}.{letter}": "links"
            for bushing in element.mechanism.bushings
            for kind in ("force", "torque")
            for letter in "xyz"
        }
        pairs = shared_pairs(element.mechanism.contacts)
        fields_of |= {f"force.{name}.{letter}": "sums" for name in pairs for letter in "xyz"}
        place, turn, velocity, spin = (motion.bars[field] for field in ("p_WB", "q_WB", "v_WB", "w_WB"))
        # at the end of a body's arm; a quaternion changes by half the angle
        bars = motion.bars | {"gap": place + 2 * element.length * turn}
        bars |= {"slip": velocity + element.length * spin + 2 * element.speed * turn}
        body = element.on_wall
        local = {} if body is None else local_bars(body, dataset, {key: float(bar.max()) for key, bar in bars.items()})
        for name, variable in dataset.data_vars.items():
            field = (
                fields_of.get(str(name))
                or _BARS.get(str(name))
                or next((v for k, v in _PREFIXES.items() if str(name).startswith(k)), None)
            )
            if field is None and str(name).rpartition(".")[0] in points:
                field = "points"
            size = float(np.nanmax(np.abs(variable.to_numpy()), initial=0.0))
            bar = _bar_of_a_law(str(name), element, motion.bars)
            if field is not None:
                bar = float(bars[field].max())
            bar = local.get(str(name), bar)
            variable.attrs["error_bar"] = 4 * np.finfo(float).eps * size if bar is None else bar
        dataset.attrs["route"], *others = motion.routes
        dataset.attrs["second_route"] = ", ".join(others)
        if motion.checked_by is not None:
            dataset.attrs["second_route"] += f", {motion.checked_by[0]}"
        if motion.laws:
            dataset.attrs[LAWS] = motion.laws
        if motion.borders:
            dataset.attrs[BORDERS] = np.array(motion.borders)
        notes = [branches]
        if np.isfinite(motion.horizon):
            dataset.attrs["horizon"] = motion.horizon
            if not motion.ended or motion.horizon < record.time[-1]:
                notes.append(f"from {motion.horizon:.4g} s on {motion.reason}")
        if motion.ended:
            dataset.attrs |= {ENDS: motion.end, ENDED: motion.ended}
        if any(notes):
            dataset.attrs["ill_posed"] = "; ".join(filter(None, notes))
        if not element.mechanism.has_events:
            return dataset
        return with_bounces(with_events(dataset, motion.events), motion.bounces)


def _columns(element: MechanismElement, motion: TwoRouteMotion | Routed) -> Columns:
    """Variables of a motion."""
    record, placed = motion.record, motion.record.placed(element.mechanism)
    wrench = np.stack([record.wrench[..., :3], record.wrench[..., 3:]], axis=1)
    borne = np.zeros((len(record.time), 0, 7)) if motion.pressed is None else motion.pressed
    return columns(element, placed, wrench, borne, record.named, motion.sums, UNDETERMINED, motion.works)


def _unknown_from(element: MechanismElement, motion: TwoRouteMotion) -> tuple[float, str] | None:
    """Time [s] from which routes part before a horizon, so far that a bar tells nothing, with a sentence.

    None: they do not.
    """
    ends = [
        (event.time_low, f"the two routes part, and tell {event.kind} of {event.name} {width:.2g} s apart")
        for event in motion.events
        if (width := event.time_high - event.time_low) > _VAGUE * element.length / element.speed
    ]
    moved = np.abs(motion.record.p_WB - element.start.p_WB[:1]).reshape(len(motion.record.time), -1).max(1)
    size = np.maximum(np.maximum.accumulate(moved), _LEAST * element.length)
    bar, told = motion.bars["p_WB"], motion.record.time < motion.horizon
    beyond = np.flatnonzero((bar > size) & told)
    if beyond.size:
        number, widest = int(np.flatnonzero((bar > _PARTED * size) & told)[0]), f"{bar[beyond[0]]:.2g} m"
        text = f"the two routes part, and the error bar of places grows to {widest}, more than anything has moved"
        ends.append((float(motion.record.time[number]), text))
    time, text = min(ends, default=(np.inf, ""))
    return (time, f"{text}; please report it") if time < motion.horizon else None


def _laws_alone(element: MechanismElement, times: FloatArray, reason: str) -> xr.Dataset:
    """Dataset for a motion that is not unique: zero for residuals of the laws, NaN for everything else."""
    mechanism, count = element.mechanism, len(times)
    resting = Placed(mechanism, times, *(np.repeat(getattr(element.start, name), count, axis=0) for name in _POSES))
    wrench, pressed = np.zeros((count, 2, len(mechanism.connections), 3)), np.zeros((count, len(mechanism.contacts), 3))
    dataset = columns(element, resting, wrench, pressed, np.zeros((count, len(named_forces(mechanism))))).dataset()
    laws = {item.name for item in element.observables if item.role is Role.RESIDUAL and not item.hangs_on_events}
    for name, variable in list(dataset.data_vars.items()):
        if not np.issubdtype(variable.dtype, np.floating):
            continue
        dataset[name] = variable.copy(data=np.full(variable.shape, 0.0 if name in laws else np.nan))
        dataset[name].attrs |= {"error_bar": 0.0} if name in laws else {"absent": "no truth"}
    dataset.attrs |= {"route": "laws of contact alone", "second_route": "", "ill_posed": reason, ENDS: 0.0}
    dataset.attrs[ENDED] = reason
    return with_events(dataset, ())


def _bar_of_a_law(name: str, element: MechanismElement, bars: Mapping[str, FloatArray]) -> float | None:
    """Error bar of a residual that combines several fields; None for any other variable."""
    mass = element.mechanism.mass
    place, velocity, force = (
        float(bars[field].max()) if field in bars else 0.0 for field in ("p_WB", "v_WB", "pressed")
    )
    match name:
        case "friction_direction":  # large for contacts that hardly press or slide
            return force / (PRESSES * element.force) + velocity / (SLIDES * element.speed)
        case "natural_map":
            return force + velocity * element.force / element.speed
        case "momentum_error":
            return mass * velocity
        case "angular_momentum_error":
            return mass * (element.length * velocity + element.speed * place)
        case _:
            return None
