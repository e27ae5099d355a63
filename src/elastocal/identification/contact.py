"""Calibration without a tracker: the tooling holds the tool in its place.

A tool that is pressed onto a stiff tooling hardly moves. What the controller travels is then minus
the deflection of the arm, and what the contact itself gives way by. Between a light contact (at
joints ``q_0``, under the force ``f_0``) and a press (``q``, ``f``), with ``df = f - f_0`` and the
normal ``n`` of the surface, which is the z axis of the tcp,

    -dp_c = (O(q, f) + S(q) - O(q_0, f_0) - S(q_0)) c + m (n n' / k_n + (I - n n') / k_s) df.

The sign is a trap: the surface is pushed away along ``-df``, so the tool follows it, and the
controller travels *further* than the arm deflects. ``m`` disks or tips are stacked. A press on one
and a press on two of them at one pose differ by the compliance of one, and in nothing of the arm.

The two compliances of the contact are columns beside those of the springs. They are not of one kind
with them: a normal compliance is a sum of what gears do under the same press, so that without any
knowledge of it the part of its column outside those of gears is 0.000, and 0.19 outside those of
springs at bearings. A free one is refused where no part is left.

The errors of the readings at one place belong together: they share the light contact from which
they count, a tip that slips stays where it slipped to, and no two places of a tooling are equally
stiff. Rows are whitened by that (C. R. Henderson, "Best linear unbiased estimation and prediction
under a selection model", Biometrics 31, 1975).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator

from elastocal.arrays import BoolArray, FloatArray, IndexArray, Triple
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError
from elastocal.identification._least_squares import RANK_TOLERANCE
from elastocal.records import StrictModel, from_data, read_yaml_data, record
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.units import parse_quantity, parse_share
from elastocal.wording import Phrase, counted, phrase, um

NORMAL, LATERAL = "normal", "lateral"
CONTACT_SCHEMA = "elastocal.contact/1"
"""Schema of a contact file."""
_SIZE = 1e-7
"""A sensible compliance of a contact, in m/N: 10 N/um."""
_SIDEWAYS = 0.05
"""Part of a force below which it has no lateral load: noise, and a normal that is a little off."""
_PULL = 0.02
"""Part of a press by which a light contact may seem to pull: noise and drift of the sensor."""
LEAST_OUTSIDE = 0.05
"""Part of the column of a free compliance that must lie outside those of the springs."""
_SOFTEST, _STIFFEST = 1e3, 1e10
"""Stiffnesses of contacts in N/m: softer than any foam, and stiffer than a machine's bed."""
_ASIDE, _ASIDE_SPREAD = 2.0, 1.0
"""Lateral compliance of a contact over its normal one, and its standard deviation."""
_REPEATED = 0.03
"""Part of a load within which another press at the same pose repeats it. Narrower than
`_SAME_LOAD`: nothing takes away by what more load travels further."""
_OTHER_STACK, _OTHER_STACK_SIGMAS, _OTHER_STACK_POSES = 0.05, 4.0, 3
"""Part of its travel by which a repeated press of another stack travels further, that difference
over its standard error, and poses where it is seen."""
_FULL = 0.9
"""Part of the largest load of its pose above which a press overcomes what friction held before."""
CUT = 0.1
"""Part of its standard deviation by which a compliance that is cut is weighed."""
_LEAST_PLACES = 4
"""Places with presses on one and on two disks from which a standard error is known."""
_LEAST_ERROR = 1e-3
"""Least standard error of a compliance over its value."""
_SAME_LOAD = 0.1
"""Part of a force within which two presses are of one load case."""
_LONGEST = 1e-3
"""Largest standard deviation of a stop and of a slip, in m."""
_FARTHEST = 0.05
"""Largest standard deviation of the tip's place, in m: farther off is another tool."""
_IMITATORS = 3
"""Springs that are named as those that imitate a compliance of the contact."""


def _parse_stiffness(text: object) -> float:
    value = parse_quantity(text, "translational stiffness")
    if not _SOFTEST <= value <= _STIFFEST:
        raise ValueError(f"{text!r} must lie between 1 N/mm and 10000 N/um, as that of any contact")
    return value


def _parse_length(text: object, most: float) -> float:
    value = parse_quantity(text, "length")
    if not 0.0 < value <= most:
        raise ValueError(f"{text!r} must be above 0 and up to {1e3 * most:g} mm")
    return value


_Share = Annotated[float, BeforeValidator(partial(parse_share, most=1.0))]
_Stiffness = Annotated[float, BeforeValidator(_parse_stiffness)]
_Length = Annotated[float, BeforeValidator(partial(_parse_length, most=_LONGEST))]
_Place = Annotated[float, BeforeValidator(partial(_parse_length, most=_FARTHEST))]


_APART = 3.0
"""Standard deviations from which on two statements of a compliance contradict each other."""


class ContactEntry(StrictModel):
    """The key ``contact`` of a contact file; see `Contact`."""

    normal: _Stiffness | None = None
    lateral: _Stiffness | None = None
    uncertainty: _Share = 0.3
    spread: _Share = 0.2
    stop: _Length = 10e-6
    slip: _Length = 2e-6
    tip: _Place | None = None

    @property
    def contact(self) -> "Contact":
        """What it says is known."""
        return Contact(**{name: getattr(self, name) for name in ContactEntry.model_fields})


class ContactFile(StrictModel):
    """A contact file."""

    contact: ContactEntry


@brief_repr
@record()
class TipPlace:
    """Where the tip was found, against where the description has the tcp."""

    place: Triple
    """In the tcp frame, in m."""
    stated: float
    """Standard deviation that was stated, in m."""
    beside_gears: Triple
    """Where the tip is beside gears that stiffen, whatever springs the model has."""
    low: Triple | None = None
    """Lower ends of the 95 % intervals, in m; None before the springs are fitted."""
    high: Triple | None = None
    """Upper ends of them, in m."""

    def told(self) -> tuple[bool, ...]:
        """Return along which axes the readings tell the place: to half of what was stated.

        Half of its 95 % interval then is shorter than the standard deviation that was stated.
        """
        if self.low is None or self.high is None:
            return False, False, False
        most = 2.0 * self.stated
        return tuple(high - low < most for low, high in zip(self.low, self.high, strict=True))

    def sentence(self) -> Phrase:
        """Return in words where the tip is."""
        x, y, z = (
            phrase(
                "{value} mm ({low} to {high})",
                value=f"{1e3 * value:+.1f}",
                low=f"{1e3 * low:.1f}",
                high=f"{1e3 * high:.1f}",
            )
            if told
            else phrase("not told from the springs")
            for value, low, high, told in zip(
                self.place,
                self.low or self.place,
                self.high or self.place,
                self.told(),
                strict=True,
            )
        )
        return phrase(
            "The tip lies beside the stated tcp along x: {x}; along y: {y}; along z: {z} (95 %"
            " intervals); the model has its tcp there, and its draws move the tip. It is the place"
            " that predicts best, and no measurement of the tool.",
            x=x,
            y=y,
            z=z,
        )


@record()
class Contact:
    """What is known of the contact between tool and tooling, of one disk or tip."""

    normal: float | None = None
    """Stiffness along the normal of the surface, in N/m; None: free."""
    lateral: float | None = None
    """Stiffness across it, in N/m; None: free."""
    uncertainty: float = 0.3
    """Standard deviation of either, as a share."""
    spread: float = 0.2
    """Standard deviation of a place from the mean of all, as a share."""
    stop: float = 10e-6
    """Standard deviation of a position in which the controller stops, in m."""
    slip: float = 2e-6
    """Standard deviation of the slip sideways from press to press, in m."""
    tip: float | None = None
    """Standard deviation of the tip's place along each axis of the tcp, in m; None: it is exact."""
    tip_found: TipPlace | None = None
    """Where the tip was found (`elastocal.identification.with_tip_found`)."""
    doubled: tuple[tuple[float, float] | None, tuple[float, float] | None] = (None, None)
    """Normal and lateral compliance by presses on one and on two disks alone, each with its
    standard error, in m/N; None: there are too few (`with_doubled`)."""
    noise: float | None = None
    """Standard deviation of one component of a row, found from the readings, in m; None: ``stop``
    (`elastocal.identification.weigh_contact`)."""
    size: tuple[float, float] | None = None
    """Normal and lateral compliance of a first fit, in m/N, of which ``spread`` is a share; None:
    the inverses of the stiffnesses that are stated."""

    def __post_init__(self) -> None:
        """Refuse numbers that no contact has.

        Raises
        ------
        IdentificationError
            If a stiffness, a share or a length is no number, not above 0, or beyond that of any
            contact.
        """
        for name in (NORMAL, LATERAL, "uncertainty", "spread", "stop", "slip", "tip"):
            if isinstance(value := getattr(self, name), str):
                raise IdentificationError(
                    f"contact.{name} is {value!r}: in Python a number in SI units, in a contact"
                    " file a quantity with its unit"
                )
        for name in (NORMAL, LATERAL):
            value = getattr(self, name)
            if value is not None and not _SOFTEST <= value <= _STIFFEST:
                raise IdentificationError(
                    f"contact.{name} is {value:g} N/m: it must lie between {_SOFTEST:g} and"
                    f" {_STIFFEST:g}"
                )
        bounds = {"uncertainty": 1.0, "spread": 1.0, "stop": _LONGEST, "slip": _LONGEST}
        for name, most in (bounds | ({} if self.tip is None else {"tip": _FARTHEST})).items():
            value = getattr(self, name)
            if not 0.0 < value <= most:
                raise IdentificationError(
                    f"contact.{name} is {value:g}: it must be above 0 and up to {most:g}"
                )

    @property
    def row_noise(self) -> float:
        """Standard deviation of one component of a row, in m."""
        return self.stop if self.noise is None else self.noise

    def stated(self, name: str) -> float | None:
        """Return a compliance that is stated, in m/N; None: it is free."""
        stiffness = {NORMAL: self.normal, LATERAL: self.lateral}[name]
        return None if stiffness is None else 1.0 / stiffness

    def known(self, name: str) -> "KnownCompliance | None":
        """Return what is known of a compliance beside the fit; None: it is free.

        A free lateral compliance is expected beside a normal one that is known: twice it, give or
        take once. A sphere on a plate has 1.2 times its normal compliance (R. D. Mindlin,
        "Compliance of elastic bodies in contact", J. Applied Mechanics 16, 1949), a bonded disk of
        rubber up to three times. Springs of the last joint imitate it wholly.
        """
        stated = self.stated(name)
        found = self.doubled[(NORMAL, LATERAL).index(name)]
        if stated is not None and found is not None:
            if abs(found[0] - stated) > _APART * np.hypot(self.uncertainty * stated, found[1]):
                # They contradict each other: what was measured counts.
                return KnownCompliance(*found, True)
            weights = 1.0 / np.square([self.uncertainty * stated, found[1]])
            mean = float(weights @ np.array([stated, found[0]]) / weights.sum())
            return KnownCompliance(mean, float(weights.sum() ** -0.5), True)
        if found is not None:
            return KnownCompliance(*found, True)
        if stated is not None:
            return KnownCompliance(stated, self.uncertainty * stated, False)
        normal = self.known(NORMAL) if name == LATERAL else None
        if normal is None:
            return None
        return KnownCompliance(_ASIDE * normal.mean, _ASIDE_SPREAD * normal.mean, False)

    def expected(self, name: str) -> float:
        """Return the compliance of which the spread is a share, in m/N; 0 where none is known."""
        if self.size is not None:
            return self.size[(NORMAL, LATERAL).index(name)]
        return self.stated(name) or 0.0


@dataclass(frozen=True)
class KnownCompliance:
    """A compliance that is known beside the fit, in m/N."""

    mean: float
    sigma: float
    """Its standard deviation."""
    is_cut: bool
    """Whether the fit takes it as it is and only draws it: what springs lack of the arm would move
    it (M. Plummer, "Cuts in Bayesian graphical models", Statistics and Computing 25, 2015)."""

    @property
    def gain_sigma(self) -> float:
        """Standard deviation by which the fit weighs it, in m/N."""
        return CUT * self.sigma if self.is_cut else self.sigma


def guessed(contact: Contact) -> Contact:
    """Return a contact whose free compliances are guessed, give or take all of them."""
    free = 1.0 / _SIZE
    return replace(
        contact,
        normal=contact.normal or free,
        lateral=contact.lateral or free,
        uncertainty=1.0,
    )


def as_fitted(contact: Contact) -> Contact:
    """Return a contact whose free compliances are stated as a first fit has them (`Contact.size`).

    One that the fit has at zero is as stiff as contacts are at most.
    """
    normal, lateral = (
        float(np.clip(1.0 / max(each, 1.0 / _STIFFEST), _SOFTEST, _STIFFEST))
        for each in contact.size or (0.0, 0.0)
    )
    return replace(contact, normal=contact.normal or normal, lateral=contact.lateral or lateral)


def read_contact(path: Path) -> Contact:
    """Return what a contact file knows.

    Raises
    ------
    SchemaError, FileAccessError
        If the file cannot be read or does not fit.
    """
    data = read_yaml_data(path)
    if isinstance(data, dict):
        # A file of one line need not state it.
        data = {"schema": CONTACT_SCHEMA} | data
    return from_data(ContactFile, data, str(path), CONTACT_SCHEMA).contact.contact


def require_metrology(readings: Readings) -> None:
    """Refuse readings that no tracker measured where nothing is said of the contact.

    Raises
    ------
    IdentificationError
        Naming the first pose.
    """
    held = readings.by_contact
    if not held.any():
        return
    if held.all():
        raise IdentificationError(
            "dataset has no marker_displacement: to identify springs, metrology is needed (a"
            " tracker that measures the marker), or what is known of the contact that holds the"
            " tool (--contact CONTACT.yaml)"
        )
    poses = len(np.unique(readings.pose[held]))
    raise IdentificationError(
        f"marker_displacement has no number at pose {readings.pose[held][0]} ({poses} such poses):"
        " leave them out (--exclude), or give what is known of the contact that holds the tool"
        " there (--contact CONTACT.yaml)"
    )


def require_pressed(robot: Robot, readings: Readings) -> None:
    """Refuse readings of which none is by contact, or that no contact can have made.

    A tooling pushes the tool away and cannot pull it: under the reference as under a load, the
    force on the robot points out of the surface, against the z axis of the tcp.

    Raises
    ------
    IdentificationError
        Naming the first pose that is pulled, or the column that leaves nothing to the contact.
    """
    held = readings.by_contact
    if not held.any():
        raise IdentificationError(
            "a contact is stated, and marker_displacement has a number at every reading: the"
            " contact holds the tool only where no tracker measured; leave the contact out, or"
            " the column (an empty cell is no 0)"
        )
    z = robot.forward(readings.joint_position)[:, :3, 2]
    forces = {"force": readings.force, "reference_force": readings.reference_force}
    for name, force in forces.items():
        if force is None:
            continue
        pull = np.einsum("ri,ri->r", z, force)
        pulled = held & (pull > _PULL * np.linalg.norm(readings.force, axis=1))
        if pulled.any():
            row = int(np.flatnonzero(pulled)[0])
            poses = len(np.unique(readings.pose[pulled]))
            raise IdentificationError(
                f"{name} of pose {readings.pose[row]}, load case {str(readings.load_case[row])!r},"
                f" pulls the tool into the surface by {pull[row]:.0f} N ({poses} such poses), and a"
                " contact only pushes it away: is its sign turned, is it in another frame than"
                " base, or of another pose?"
            )


def untold_stacks(robot: Robot, readings: Readings) -> tuple[float, int] | None:
    """Return what shows that presses were made on other stacks than the readings say.

    A press that repeats one of the largest loads of its pose, on as many disks, travels as far. One
    on another disk travels further by what that disk gives way, at every pose. Smaller loads show
    nothing: after a larger press friction holds a part of its travel.

    Returns
    -------
    tuple of float and int, optional
        By how much more the later ones of such presses travel along the normal, in m, and the
        number of poses that have any; None: no more than they scatter.
    """
    z = robot.forward(readings.joint_position)[:, :3, 2]
    travel = np.einsum("ri,ri->r", z, readings.controller_displacement)
    disks, load = readings.disks, np.linalg.norm(readings.force, axis=1)
    apart, whole = [], []
    for pose in np.unique(readings.pose[readings.by_contact]).tolist():
        rows = np.flatnonzero((readings.pose == pose) & readings.by_contact)
        first, second = rows[np.array(np.triu_indices(len(rows), 1))]
        change = np.linalg.norm(readings.force[second] - readings.force[first], axis=1)
        repeated = (disks[first] == disks[second]) & (change <= _REPEATED * load[first])
        repeated &= load[first] >= _FULL * load[rows].max(initial=0.0)
        if repeated.any():
            apart.append(float(np.median((travel[second] - travel[first])[repeated])))
            whole.append(float(np.abs(travel[first[repeated]]).mean()))
    if len(apart) < _OTHER_STACK_POSES:
        return None
    mean, error = _mean_and_error(apart)
    is_other = abs(mean) > max(_OTHER_STACK * float(np.mean(whole)), _OTHER_STACK_SIGMAS * error)
    return (abs(mean), len(apart)) if is_other else None


@brief_repr
@dataclass(frozen=True, eq=False)
class ContactColumns:
    """Columns of the contact in an observation system, and the errors that its readings share."""

    names: tuple[str, ...]
    """`NORMAL`, `LATERAL` or both."""
    columns: FloatArray
    """Shape (reading, 3, column), in m per m/N."""
    prior: FloatArray
    """Rows of the prior on the columns, right-hand side last, shape (row, column + 1)."""
    prior_error: FloatArray
    """Standard deviation of the right-hand side of each, shape (row,), in m."""
    shared: FloatArray
    """Errors that readings of one block share, each of unit variance, over the noise of a row,
    shape (reading, 3, error)."""

    @property
    def size(self) -> FloatArray:
        """A sensible size of each compliance, shape (column,), in m/N."""
        return np.full(len(self.names), _SIZE)


def contact_columns(
    robot: Robot, readings: Readings, block: IndexArray, contact: Contact
) -> ContactColumns:
    """Return the columns of the contact; zero at readings that a tracker measured.

    Parameters
    ----------
    robot : Robot
        Its tcp's z axis is the normal of the surface.
    readings : Readings
        With joints in the robot's order.
    block : ndarray of int, shape (reading,)
        Place of each reading.
    contact : Contact
        What is known of it.
    """
    R = robot.forward(readings.joint_position)[:, :3, :3]
    names = [NORMAL, LATERAL] if is_pressed_sideways(robot, readings) else [NORMAL]
    found = _columns(R, readings)[:, :, : len(names)]
    known = {name: each for name in names if (each := contact.known(name)) is not None}
    prior = np.zeros((len(known), len(names) + 1))
    error = np.zeros(len(known))
    for row, (name, each) in enumerate(known.items()):
        gain = contact.row_noise / each.gain_sigma
        prior[row, names.index(name)], prior[row, -1] = gain, gain * each.mean
        error[row] = gain * each.sigma
    expected = np.array([contact.expected(name) for name in names])
    shared = _shared_errors(readings, block, R, contact, found * (contact.spread * expected))
    return ContactColumns(tuple(names), found, prior, error, shared / contact.row_noise)


def _columns(R: FloatArray, readings: Readings) -> FloatArray:
    """Return the columns of both compliances under the force since the light touch."""
    df = readings.force.copy()
    if readings.reference_force is not None:
        df -= readings.reference_force
    return compliance_columns(R, df, readings.disks)


def compliance_columns(R: FloatArray, force: FloatArray, disks: NDArray[np.int8]) -> FloatArray:
    """Return the columns of the normal and the lateral compliance, in m per m/N.

    Parameters
    ----------
    R : ndarray, shape (reading, 3, 3)
        Axes of the tcp in base; the third is the normal of the surface.
    force : ndarray, shape (reading, 3)
        Force on the tool since the light touch, in base, in N.
    disks : ndarray of int, shape (reading,)
        Disks between tool and tooling.

    Returns
    -------
    ndarray, shape (reading, 3, 2)
    """
    along = np.einsum("ri,ri->r", R[:, :, 2], force)[:, None] * R[:, :, 2]
    return np.asarray(np.stack([along, force - along], axis=2) * disks[:, None, None])


def with_doubled(contact: Contact, robot: Robot, readings: Readings, arm: FloatArray) -> Contact:
    """Return a contact with the compliances that presses on one and on two disks show alone.

    At each place they follow from the differences of such presses under one load, by least
    squares; their mean over places has the standard error of the mean. The arm has next to no part
    in them.

    Parameters
    ----------
    contact : Contact
        What else is known.
    robot, readings
        As for `contact_columns`.
    arm : ndarray, shape (reading, 3)
        What the arm's springs predict of each reading, in m: on two disks it stands elsewhere, and
        a soft arm deflects there by tens of micrometres more or less.
    """
    more = counts_from_other_stack(readings)
    if not more.any():
        return contact
    R = robot.forward(readings.joint_position)[:, :3, :3]
    columns, own = _columns(R, readings), readings.deflection - arm
    size = np.linalg.norm(readings.force, axis=1)
    found: list[list[float]] = [[], []]
    for pose in np.unique(readings.pose[more]):
        there = readings.pose == pose
        few = np.flatnonzero(there & ~more)
        rows, sides = [], []
        for press in np.flatnonzero(there & more).tolist():
            apart = np.linalg.norm(readings.force[few] - readings.force[press], axis=1)
            near = int(few[apart.argmin()])
            if apart.min() < _SAME_LOAD * size[press]:
                rows.append(columns[press] - columns[near])
                sides.append(own[press] - own[near])
        for number, value in _of_place(np.array(rows), np.array(sides)):
            found[number].append(value)
    normal, lateral = (_compliance_with_error(values) for values in found)
    return replace(contact, doubled=(normal, lateral))


def _of_place(rows: FloatArray, sides: FloatArray) -> list[tuple[int, float]]:
    """Return the number and the value of each compliance that the presses of a place load."""
    if not len(rows):
        return []
    A, b = rows.reshape(-1, 2), sides.ravel()
    norms = np.linalg.norm(A, axis=0)
    loaded = np.flatnonzero(norms > _SIDEWAYS * norms.max())
    values = np.linalg.lstsq(A[:, loaded], b, rcond=None)[0]
    return list(zip(loaded.tolist(), values.tolist(), strict=True))


def _mean_and_error(values: Sequence[float]) -> tuple[float, float]:
    """Return a mean and its standard error."""
    return float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(len(values)))


def _compliance_with_error(values: Sequence[float]) -> tuple[float, float] | None:
    """Return the compliance of several places with its standard error; None of too few."""
    if len(values) < _LEAST_PLACES:
        return None
    mean, error = _mean_and_error(values)
    # A contact that is too stiff for the positions of a controller is as soft as they allow.
    return max(mean, error), max(error, _LEAST_ERROR * mean)


def is_pressed_sideways(robot: Robot, readings: Readings) -> bool:
    """Return whether any reading that no tracker measured has a lateral load."""
    held = readings.by_contact
    if not held.any():
        return False
    R = robot.forward(readings.joint_position[held])[:, :3, :3]
    own = np.einsum("rji,rj->ri", R, readings.force[held])
    lateral = np.linalg.norm(own[:, :2], axis=1)
    return bool(np.any(lateral > _SIDEWAYS * np.linalg.norm(own, axis=1)))


def _shared_errors(
    readings: Readings, block: IndexArray, R: FloatArray, contact: Contact, spread: FloatArray
) -> FloatArray:
    """Return the errors that readings of a block share, shape (reading, 3, error), in m.

    Of each light contact its place, and the slip from each press to the next; of each block what
    its place is stiffer by than others.
    """
    stack, held = readings.disks, readings.by_contact
    order = np.arange(len(readings)) if readings.sequence is None else readings.sequence
    # A light contact is made once a pose, and anew for each number of stacked disks.
    _, touch = np.unique(np.column_stack([readings.pose, stack]), axis=0, return_inverse=True)
    touch = touch.ravel()
    place, step = np.zeros(len(readings), dtype=int), np.zeros(len(readings), dtype=int)
    for each in np.unique(block):
        own = np.flatnonzero(block == each)
        place[own] = np.unique(touch[own], return_inverse=True)[1]
    for each in np.unique(touch):
        own = np.flatnonzero(touch == each)
        step[own] = np.argsort(np.argsort(order[own], kind="stable"), kind="stable")
    width = 3 + 2 * (int(step.max(initial=0)) + 1)
    touches = int(place.max(initial=0)) + 1
    errors = np.zeros((len(readings), 3, touches * width + spread.shape[2]))
    for row in np.flatnonzero(held).tolist():
        first = place[row] * width
        errors[row, :, first : first + 3] = contact.stop * np.eye(3)
        for each in range(step[row] + 1):
            second = first + 3 + 2 * each
            errors[row, :, second : second + 2] = contact.slip * R[row, :, :2]
    errors[held, :, touches * width :] = spread[held]
    return errors


def whitened(rows: FloatArray, shared: FloatArray, block: IndexArray) -> FloatArray:
    """Return rows multiplied by ``(I + G G')^(-1/2)`` of their block.

    Parameters
    ----------
    rows : ndarray, shape (reading, 3, column)
        Rows of unit variance but for what they share.
    shared : ndarray, shape (reading, 3, error)
        ``G``.
    block : ndarray of int, shape (reading,)
        Readings that share something.
    """
    found = rows.copy()
    order = np.argsort(block, kind="stable")
    _, starts, counts = np.unique(block[order], return_index=True, return_counts=True)
    for count in np.unique(counts):  # blocks of one size at once
        own = order[starts[counts == count, None] + np.arange(count)]
        G = shared[own].reshape(len(own), 3 * count, shared.shape[2])
        U, s, _ = np.linalg.svd(G, full_matrices=False)
        less = U * (1.0 - 1.0 / np.sqrt(1.0 + np.square(s)))[:, None]
        system = rows[own].reshape(*G.shape[:2], rows.shape[2])
        found[own] = (system - less @ (U.mT @ system)).reshape(*own.shape, *rows.shape[1:])
    return found


@dataclass(frozen=True)
class ContactVisibility:
    """Distinction of a compliance of the contact from the springs."""

    name: str
    outside: float
    """Part of its column outside those of the springs and the other compliance, 0 to 1."""
    imitators: tuple[str, ...]
    """The parameters of springs that imitate it most."""


def visibility(
    names: Sequence[str], contact: FloatArray, springs: Sequence[str], columns: FloatArray
) -> tuple[ContactVisibility, ...]:
    """Return how far the springs imitate each compliance of the contact.

    Parameters
    ----------
    names : sequence of str
        Compliances.
    contact : ndarray, shape (row, compliance)
        Their whitened columns.
    springs : sequence of str
        Parameters of the springs.
    columns : ndarray, shape (row, column)
        Whitened columns of these, and of what else is fitted behind them.
    """
    found = []
    for number, name in enumerate(names):
        others = np.column_stack([columns, np.delete(contact, number, axis=1)])
        norms = np.linalg.norm(others, axis=0)
        others = others / np.where(norms > 0.0, norms, 1.0)
        own, size = contact[:, number], float(np.linalg.norm(contact[:, number]))
        share = np.linalg.lstsq(others, own, rcond=RANK_TOLERANCE)[0]
        left = float(np.linalg.norm(own - others @ share)) / size if size else 0.0
        most = _most_alike(own, others[:, : len(springs)])
        found.append(ContactVisibility(name, left, tuple(springs[each] for each in most)))
    return tuple(found)


def _most_alike(own: FloatArray, columns: FloatArray) -> list[int]:
    """Return the columns of unit norm that explain another one best, one after the other.

    Orthogonal matching pursuit (Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, 27th Asilomar
    Conference, 1993): coefficients of all columns at once say nothing where these are dependent.
    """
    chosen: list[int] = []
    left = own
    while len(chosen) < min(_IMITATORS, columns.shape[1]):
        chosen.append(int(np.abs(left @ columns).argmax()))
        some = columns[:, chosen]
        left = own - some @ np.linalg.lstsq(some, own, rcond=RANK_TOLERANCE)[0]
    return list(dict.fromkeys(chosen))


def is_doubled(readings: Readings) -> bool:
    """Return whether any pose is pressed on different numbers of disks."""
    return bool(np.any(counts_from_other_stack(readings)))


def require_seen(
    contact: Contact, seen: Sequence[ContactVisibility], sideways: bool, doubled: bool
) -> None:
    """Refuse a free compliance that the springs of a model imitate.

    Presses along the normal alone, on one disk, tell it from no springs: by what part they would
    is then a matter of what the model lacks.

    Raises
    ------
    IdentificationError
        Naming it, the springs, and what would tell them apart.
    """
    for each in seen:
        is_open = not each.outside > LEAST_OUTSIDE or not (sideways or doubled)
        if contact.known(each.name) is None and is_open:
            if not (sideways or doubled):
                raise IdentificationError(
                    f"contact.{each.name} is free, and every press is along the normal on one disk:"
                    " nothing tells it from the springs; state it in the contact file with its"
                    " uncertainty, or press sideways too, and at some places on one and on two"
                    " disks (contacts 1 and 2)"
                )
            more = "" if sideways else " sideways too,"
            raise IdentificationError(
                f"contact.{each.name} is free, and the springs imitate it (most:"
                f" {', '.join(each.imitators)}): {each.outside:.3f} of its column lies outside"
                f" theirs, and {LEAST_OUTSIDE:g} is needed; state it in the contact file with its"
                f" uncertainty, or press{more} at some places on one and on two disks (contacts 1"
                " and 2); turning the tool by +-1 rad about the normal and a second tip help"
            )


@brief_repr
@record()
class ContactFigure:
    """A compliance of the contact, as it was found."""

    name: str
    """``normal`` or ``lateral``."""
    compliance: float
    """In m/N, of one disk or tip."""
    low: float
    """Lower end of its 95 % interval, in m/N."""
    high: float
    """Upper end, in m/N."""
    stated: float | None
    """Compliance that was stated, in m/N; None: it was free."""
    doubled: float | None
    """Compliance by presses on one and on two disks alone, in m/N; None: not known."""
    outside: float
    """Part of its column outside those of the springs: 0 where springs imitate it."""
    imitators: tuple[str, ...] = ()
    """Parameters of springs that imitate it most."""

    def contradicts(self, uncertainty: float) -> bool:
        """Return whether it is not what was stated, with a standard deviation as a share."""
        if self.stated is None:
            return False
        apart = abs(self.compliance - self.stated) > _APART * uncertainty * self.stated
        return apart and not self.low <= self.stated <= self.high

    @property
    def is_seen(self) -> bool:
        """Whether the readings tell it from the springs."""
        return self.outside > LEAST_OUTSIDE


@brief_repr
@record()
class ContactSummary:
    """The contact of a calibration without a tracker: where its zero comes from."""

    figures: tuple[ContactFigure, ...]
    poses: int
    """Poses that no tracker measured."""
    tracked: int
    """Poses that a tracker measured."""
    doubled: int
    """Poses pressed on different numbers of disks."""
    noise: float
    """Standard deviation of one component of a row, in m."""
    zero: float
    """Standard uncertainty along one axis that the contact leaves to a deflection as large as those
    measured, in m."""
    fixed: tuple[str, ...] = ()
    """Compliances that no press loads: they were not fitted."""
    tip: TipPlace | None = None
    """Where the tip was found; None: its place was taken as exact."""

    def sentence(self) -> Phrase:
        """Return in words where the zero of the deflections comes from."""
        poses, zero = counted(self.poses, "pose"), um(self.zero)
        if self.tracked:
            return phrase(
                "No tracker measured {poses}: there the tooling held the tool. A tracker measured"
                " at {tracked}. The contact leaves {zero} to a deflection along one axis (standard"
                " uncertainty); {doubled} pressed on different numbers of disks.",
                poses=poses,
                tracked=counted(self.tracked, "pose"),
                zero=zero,
                doubled=counted(self.doubled, "pose"),
            )
        return phrase(
            "No tracker measured: the tooling held the tool at {poses}. The contact leaves {zero}"
            " to a deflection along one axis (standard uncertainty); {doubled} pressed on different"
            " numbers of disks.",
            poses=poses,
            zero=zero,
            doubled=counted(self.doubled, "pose"),
        )


def contact_summary(
    contact: Contact,
    readings: Readings,
    seen: Sequence[ContactVisibility],
    fitted: tuple[FloatArray, FloatArray, FloatArray],
    zero: float,
) -> ContactSummary:
    """Return the contact as it was found.

    Parameters
    ----------
    contact : Contact
        What was known of it.
    readings : Readings
        All that entered the fit.
    seen : sequence of ContactVisibility
        Compliances that were fitted.
    fitted : tuple of ndarray, shape (column,)
        The compliances, and the lower and upper ends of their 95 % intervals, in m/N.
    zero : float
        `ContactSummary.zero`.
    """
    held = readings.by_contact
    pairs = np.unique(np.column_stack([readings.pose, readings.disks])[held], axis=0)
    poses, stacks = np.unique(pairs[:, 0], return_counts=True)
    names = [each.name for each in seen]
    numbers = zip(seen, *(each.tolist() for each in fitted), strict=True)
    return ContactSummary(
        figures=tuple(
            ContactFigure(
                each.name,
                value,
                low,
                high,
                contact.stated(each.name),
                None if (found := contact.doubled[names.index(each.name)]) is None else found[0],
                each.outside,
                each.imitators,
            )
            for each, value, low, high in numbers
        ),
        poses=len(poses),
        tracked=len(np.unique(readings.pose[~held])),
        doubled=int(np.count_nonzero(stacks > 1)),
        noise=contact.row_noise,
        zero=zero,
        fixed=tuple(name for name in (NORMAL, LATERAL) if name not in names),
        tip=contact.tip_found,
    )


def at_tcp(robot: Robot, readings: Readings, marker_offset: ArrayLike | None) -> Readings:
    """Return readings whose controller displacement is the tcp's wherever no tracker measured.

    Where a marker is named, a dataset's controller displacements are those of that point; what the
    tooling holds is the tcp. Without recorded joints of the reference the tool did not turn, and
    both are the same.
    """
    q_0 = readings.reference_joint_position
    if readings.contacts is None or marker_offset is None or q_0 is None:
        return readings
    held = _counts_from_recorded(readings)
    moved = readings.controller_displacement.copy()
    here, there = robot.forward(readings.joint_position[held]), robot.forward(q_0[held])
    moved[held] = here[:, :3, 3] - there[:, :3, 3]
    return replace(readings, controller_displacement=moved)


def _counts_from_recorded(readings: Readings) -> BoolArray:
    """Return whether each reading by contact counts from the recorded joints of the reference."""
    return np.asarray(readings.by_contact & ~counts_from_other_stack(readings))


def counts_from_other_stack(readings: Readings) -> BoolArray:
    """Return whether each reading is one on more disks than the fewest at its pose.

    It counts from a light contact on as many disks, whose joints are not recorded.
    """
    if readings.contacts is None:
        return np.zeros(len(readings), dtype=bool)
    fewest = np.array(
        [readings.contacts[readings.pose == pose].min() for pose in readings.pose.tolist()]
    )
    return np.asarray(readings.contacts > fewest)
