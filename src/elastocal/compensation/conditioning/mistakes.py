"""Mistakes in static postures: wrong frames, signs and units, and data that fit no tool.

The idea is that of the check of a dataset's conventions: if another interpretation explains the
data far better than the stated one, it is what was measured. Data that no interpretation explains
are refused as well: a spoilt posture, a rotation that differs from the mounting, a wrong unit.

A mistake is undone and one tool is fitted on the sensor as mounted.

Every candidate mistake is undone in turn. Each interpretation of the numbers is fitted by linear
least squares in mass and bias, ``F = m u + b`` and ``M = h x u + b_m`` with gravity ``u`` in the
sensor's frame; the plainest of those that leave nearly the least is named, where it leaves far less
than the numbers as stated.

Doubtful points that are not certain mistakes are returned as warnings.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.postures import LEAST_POSTURES, StaticPostures
from elastocal.compensation.conditioning.tool_choice import affine_scatter
from elastocal.compensation.conditioning.tool_fit import ToolFit, ToolModel, fit_tool, tool_residual
from elastocal.errors import CompensationError
from elastocal.parallel import one_blas_thread
from elastocal.robot import nearest_rotation, xyzabc_from_T

_LEAST_SPREAD = np.radians(15.0)
"""Least angular spread of the postures that determines a weight, in rad."""
_LEAST_LEVER, _LEVER_RATIO = 0.02, 5.0
"""Distance of a centre of mass from its sensor in m, and how far it may be from the stated one."""
_MUCH_LEFT, _LEAST_LEFT = 0.05, 3.0
"""Largest residual of a force component, or drift, relative to the weight, and in N."""
_LEAST_MASS, _MOST_MASS = 0.6, 1.15
"""Part of the stated mass that a sensor may feel: its own lower half does not count."""
_FORCE_UNITS = {"kgf": 9.80665, "lbf": 4.4482216, "kN": 1e3, "N, not kgf": 1 / 9.80665}
"""Forces that are taken for newtons, with their size in N."""
_NEAR = 0.1
"""Largest deviation of a ratio of masses from that of two units."""


def tool_doubts(
    postures: StaticPostures,
    fit: ToolFit,
    known_mass: float | None = None,
    known_centre: FloatArray | None = None,
) -> tuple[str, ...]:
    """Return the findings to look at before a tool is used.

    Parameters
    ----------
    postures : StaticPostures
        Fitted postures.
    fit : ToolFit
        Fit of these postures.
    known_mass : float, optional
        Mass of the tool by another source, in kg.
    known_centre : ndarray, shape (3,), optional
        Its centre of mass in the sensor's frame, in m.
    """
    found = []
    weight = abs(fit.mass) * float(np.linalg.norm(postures.gravity))
    left = float(np.sqrt(np.mean(np.square(tool_residual(postures, fit)[0]))))
    if postures.spread < _LEAST_SPREAD:
        found.append(
            f"gravity turns by {np.degrees(postures.spread):.2g} deg in the sensor over all"
            " postures, too little to tell a weight: turn the tool about two axes"
        )
    if left > max(_MUCH_LEFT * weight, _LEAST_LEFT):
        found.append(
            f"{left:.3g} N are left of a force component beside a tool of {weight:.3g} N: was it"
            " touched in some postures, does a cable pull?"
        )
    drift = float(np.linalg.norm(fit.drift[:3]))
    if drift > _MUCH_LEFT * weight:
        found.append(
            f"the bias drifts by {drift:.3g} N from the first posture to the last, the tool weighs"
            f" {weight:.3g} N: let the sensor warm up, or tare it at each pose"
        )
    if known_mass is not None and "mass" not in fit.undetermined:
        found.extend(other_mass(fit.mass, known_mass))
    if known_centre is not None:
        found.extend(other_centre(fit, known_centre))
    return tuple(found)


def other_mass(found: float, known: float) -> tuple[str, ...]:
    """Return the sentence about a mass that is not the known one; none where both agree.

    The tool of a cell file is everything behind the flange, of which a sensor carries its part.

    Parameters
    ----------
    found : float
        By the weight that a sensor feels, in kg.
    known : float
        By the scales or the drawing, in kg; 0: not known.
    """
    if not known > 0.0 or _LEAST_MASS * known <= found <= _MOST_MASS * known:
        return ()
    unit = next(
        (name for name, ratio in _FORCE_UNITS.items() if abs(found / known * ratio - 1.0) < _NEAR),
        "",
    )
    why = f"are the forces in {unit}?" if unit else "are the forces in another unit or gain?"
    return (
        f"the sensor feels a tool of {found:.3g} kg, which weighs {known:.3g} kg as stated: {why}",
    )


def other_centre(fit: ToolFit, known: FloatArray) -> tuple[str, ...]:
    """Return the sentence about a centre of mass at another distance than the known one.

    Parameters
    ----------
    fit : ToolFit
        Fit of static postures.
    known : ndarray, shape (3,)
        By the drawing, in the sensor's frame, in m.
    """
    found, stated = (float(np.linalg.norm(each)) for each in (fit.centre, known))
    if any(name.startswith("centre") for name in fit.undetermined) or not stated > _LEAST_LEVER:
        return ()
    if stated / _LEVER_RATIO < found < stated * _LEVER_RATIO:
        return ()
    return (
        f"the moments put the tool's centre of mass {1e3 * found:.3g} mm from the sensor, which is"
        f" {1e3 * stated:.3g} mm as stated: are they in another unit?",
    )


_NOTICEABLE = 0.05
"""Part of what turns with the posture that is left, from which on mistakes are looked for."""
_CROSS_TALK = 0.03
"""Share of the ranges that cross-talk may carry over from forces to moments and back."""
_MOST_CROSS_TALK = 2.0 * 0.05 * np.sqrt(3.0)
"""Two standard deviations of what three components carry into another one where each entry of the
matrix is of 5 %, as of sensors before they are calibrated (`elastocal.sim.truth`)."""
_FITTED_BY_CROSS_TALK = 4
"""Directions of gravity that cross-talk always explains."""
_FAR_BETTER = 0.3
"""Part of it that undoing a mistake leaves at most."""
_TIE = 1.3
"""Interpretations with nearly equal residuals are not distinguished."""
_ROUNDING = 1e-6
"""Part of what is left as stated that is rounding."""
_LEAST_OVER = 8
"""Numbers left over, by which a reading is judged."""
_LEAST_PART = 2
"""Postures on either side of a change in time."""
_LEAST_TURN = np.radians(3.0)
"""A rotation of base or sensor below this angle is a usual mounting error."""
_DEAD, _SAME = 0.1, 0.03
"""Gains of an axis below which it is dead, and nearer to 1 than which it is right."""
About = Literal["rotation of the sensor", "zero of the sensor", ""]
"""The part that a mistake concerns, where a caller knows more of it."""
_SIGN_ALONE = 0.2
"""Largest deviation of a gain from -1 at which the sign alone is turned."""
_AXES = "xyz"
_ORDERS = ("zyx", "XYZ", "ZYZ", "ZXZ", "YZX")
"""Senses of three angles beside KUKA's ZYX, as SciPy writes them."""


@dataclass(frozen=True, eq=False)
class _Reading:
    """One reading of the numbers, and what one tool leaves of it."""

    sentence: str
    """The mistake; empty: none."""
    left: float
    """Standard deviation of a component."""
    imitated: bool = False
    """Whether cross-talk looks like a little of this mistake."""
    entry: str = ""
    """See `SensorMistake`."""
    about: About = ""
    """See `SensorMistake`."""


@dataclass(frozen=True)
class SensorMistake:
    """A mistake in forces or moments."""

    message: str
    """Sentence without its end, with its figures."""
    entry: str = ""
    """Key and value by which the map of a log undoes it; empty where no key does."""
    about: About = ""
    """A rotation may be explained further; another zero from some time on does no harm where each
    pose has a zero of its own."""


def force_mistake(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> SensorMistake | None:
    """Return the mistake whose correction lets one tool explain the forces; None if there is none.

    Parameters
    ----------
    postures : StaticPostures
        In the order of time.
    R_flange_sensor : ndarray, shape (3, 3)
        As mounted.
    lever : float
        The sensor's moment range over its force range, in m.
    """
    u, F = postures.gravity_flange @ R_flange_sensor, postures.force
    others = _force_readings(postures, R_flange_sensor)
    floors = _floors(u, F, postures.moment / lever)
    return _judged(_solved(F, [u])[1], others, floors, "force", "N")


def moment_mistake(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> SensorMistake | None:
    """Return the mistake without which one tool explains the moments; see `force_mistake`."""
    u, M = postures.gravity_flange @ R_flange_sensor, postures.moment
    terms = [np.cross(axis, u) for axis in np.eye(3)]

    def readings() -> Iterator[_Reading]:
        drift = [np.outer(postures.course, axis) for axis in np.eye(3)]
        yield _Reading("", _solved(M, [*terms, *drift])[1])
        for k, name in enumerate(_AXES):
            own = np.arange(3) == k
            h, _ = _solved(M, [np.where(own, 0.0, term) for term in terms], ~own)
            expected = sum(x * term for x, term in zip(h, terms, strict=True))
            parts = [np.where(own, 0.0, expected), np.where(own, expected, 0.0)]
            (_, gain), left = _solved(M, parts)
            yield _Reading(
                f"moment_{name} shows {gain:.2g} times what the tool's weight makes of it by the"
                f" other axes: {_why(gain)}",
                left if abs(gain - 1.0) > _SAME else np.inf,
                imitated=True,
                entry=_signs(k, gain, "moment"),
            )
        for pair, order in _exchanges("moment"):
            entry = _exchanged(order, "moment")
            yield _Reading(pair, _solved(M[:, order], terms)[1], entry=entry)

    floors = _floors(u, M, postures.force * lever)
    return _judged(_solved(M, terms)[1], readings(), floors, "moment", "N*m")


def _floors(u: FloatArray, own: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Return the residuals above which mistakes are sought, in general and beside cross-talk.

    Cross-talk is an affine law of gravity of twelve numbers, which four directions always fit: then
    only a residual beyond any cross-talk shows a mistake.

    Parameters
    ----------
    u : ndarray, shape (posture, 3)
        Gravity in the sensor, in m/s².
    own, other : ndarray, shape (posture, 3)
        What is judged, and what may talk into it, in the same unit.
    """
    directions = list[FloatArray]()
    for each in u / np.linalg.norm(u, axis=1, keepdims=True):
        if all(_angle_between(each, known) > _LEAST_TURN for known in directions):
            directions.append(each)
    if len(directions) <= _FITTED_BY_CROSS_TALK:
        most = _MOST_CROSS_TALK * float(np.hypot(_scatter(own), _scatter(other)))
        return most, most
    least = _NOTICEABLE * _scatter(own)
    return least, least + _CROSS_TALK * _scatter(other)


def _judged(
    stated: float, others: Iterable[_Reading], floors: tuple[float, float], what: str, unit: str
) -> SensorMistake | None:
    """Return the mistake of the plainest reading that leaves nearly the least, with its figures.

    ``stated`` is left as stated; ``floors`` is what must be left to look for mistakes, and for
    those that cross-talk imitates.
    """
    if not floors[0] < stated < np.inf:
        return None
    every = [each for each in others if stated > floors[1] or not each.imitated]
    least = min(each.left for each in every)
    if not least < _FAR_BETTER * stated:
        return None
    near = max(_TIE * least, _ROUNDING * stated)
    best = next(each for each in every if each.left <= near)
    if not best.sentence:
        return None
    return SensorMistake(
        f"{best.sentence}; so read, {best.left:.3g} {unit} are left of a {what} component instead"
        f" of {stated:.3g} {unit}",
        best.entry,
        best.about,
    )


def _force_readings(postures: StaticPostures, R_flange_sensor: FloatArray) -> Iterator[_Reading]:
    """Yield every reading of the forces, the plainest first; a drift is no mistake."""
    u, F = postures.gravity_flange @ R_flange_sensor, postures.force
    drift = [np.outer(postures.course, axis) for axis in np.eye(3)]
    yield _Reading("", _solved(F, [u, *drift])[1])
    yield from _axis_gains(u, F)
    for pair, order in _exchanges("force"):
        (mass,), left = _solved(F[:, order], [u])
        entry = _exchanged(order, "force")
        yield _Reading(pair, left if mass > 0.0 else np.inf, entry=entry)
    yield from _in_time(u, F)
    yield from _turned_sensor(u, F)
    yield from _other_orientations(postures, R_flange_sensor)
    # The weight in the flange's axes is that in base, turned: the base may be tilted.
    turned = postures.R_base_flange @ R_flange_sensor
    weight, left = _solved(F, list(np.moveaxis(turned, 1, 0)))
    tilt = _angle_between(weight, postures.gravity)
    yield _Reading(
        f"gravity comes out {np.degrees(tilt):.0f} deg from where it is said to be in base: is the"
        " base mounted as stated (--down, mounting)?",
        left if tilt > _LEAST_TURN else np.inf,
        imitated=True,
    )
    back = np.einsum("nij,nj->ni", turned, F)
    (mass,), left = _solved(back, [u])
    yield _Reading(
        "the wrenches are in the sensor's frame already, though they are said to be in base",
        left if mass > 0.0 else np.inf,
        entry="`frame: sensor`",
    )


def _axis_gains(u: FloatArray, F: FloatArray) -> Iterator[_Reading]:
    for k, name in enumerate(_AXES):
        own = np.arange(3) == k
        (other, mass), left = _solved(F, [np.where(own, 0.0, u), np.where(own, u, 0.0)])
        gain = mass / other if other > 0.0 else 1.0
        yield _Reading(
            f"force_{name} shows {mass:.3g} kg of the tool, the other axes {other:.3g} kg:"
            f" {_why(gain)}",
            left if abs(gain - 1.0) > _SAME else np.inf,
            imitated=True,
            entry=_signs(k, gain, "force"),
        )


def _signs(axis: int, gain: float, what: str) -> str:
    """Return the entry of a map that turns the sign of an axis; empty where that is not enough."""
    signs = [-1 if each == axis else 1 for each in range(3)]
    return f"`signs: {signs}` at {what}" if abs(gain + 1.0) < _SIGN_ALONE else ""


def _exchanged(order: list[int], what: str) -> str:
    """Return the entry of a map that exchanges two columns."""
    return f"`columns` in the order {', '.join(_AXES[each] for each in order)} at {what}"


def _why(gain: float) -> str:
    if abs(gain) < _DEAD:
        return "is its channel dead?"
    return "is its sign turned?" if gain < 0.0 else "is its gain or unit another?"


def _exchanges(what: str) -> Iterator[tuple[str, list[int]]]:
    for a, b in combinations(range(3), 2):
        order = [b if k == a else a if k == b else k for k in range(3)]
        yield f"{what}_{_AXES[a]} and {what}_{_AXES[b]} are exchanged", order


def _in_time(u: FloatArray, F: FloatArray) -> Iterator[_Reading]:
    """Yield the best step of the bias, and the best change of the tool."""
    steps, changes = [], []
    for row in range(_LEAST_PART, len(F) - _LEAST_PART + 1):
        late = (np.arange(len(F)) >= row)[:, None]
        (_, *step), left = _solved(F, [u, *(late * axis for axis in np.eye(3))])
        size = float(np.linalg.norm(step))
        text = f"the bias jumps by {size:.3g} N after posture {row}: was the sensor zeroed there?"
        steps.append(_Reading(text, left, about="zero of the sensor"))
        (first, last), left = _solved(F, [u * ~late, u * late])
        text = (
            f"the tool weighs {first:.3g} kg up to posture {row} and {last:.3g} kg after it: was"
            " it changed, or a unit?"
        )
        changes.append(_Reading(text, left))
    for found in (steps, changes):
        yield from sorted(found, key=lambda each: each.left)[:1]


def _turned_sensor(u: FloatArray, F: FloatArray) -> Iterator[_Reading]:
    Q = nearest_rotation((F - F.mean(axis=0)).T @ (u - u.mean(axis=0)))
    angle = float(Rotation.from_matrix(Q).magnitude())
    left = _solved(F, [u @ Q.T], unknowns=4 + 3)[1]
    yield _Reading(
        "the sensor is not turned as stated (--sensor, cell, map): it sits"
        f" {np.degrees(angle):.1f} deg from there; correct it, or give --free-rotation",
        left if angle > _LEAST_TURN else np.inf,
        imitated=True,
        about="rotation of the sensor",
    )


def _other_orientations(postures: StaticPostures, R_sensor: FloatArray) -> Iterator[_Reading]:
    """Yield orientations that are inverted, in another order of angles, or of another row."""
    R, g, F = postures.R_base_flange, postures.gravity, postures.force

    def read(R_read: FloatArray, force: FloatArray, sentence: str) -> _Reading:
        (mass,), left = _solved(force, [g @ R_read @ R_sensor])
        return _Reading(sentence, left if mass > 0.0 else np.inf)

    inverse = "the orientations are those of the base in the flange: invert them"
    yield read(np.swapaxes(R, 1, 2), F, inverse)
    yield read(R[:-1], F[1:], "the wrenches belong to the orientations of the row before")
    yield read(R[1:], F[:-1], "the wrenches belong to the orientations of the row after")
    T = np.tile(np.eye(4), (len(R), 1, 1))
    T[:, :3, :3] = R
    angles = xyzabc_from_T(T)[:, 3:]
    about_x = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix()
    yield read(about_x, F, "the columns of the angles a and c are exchanged")
    for order in _ORDERS:
        about = ", ".join(f"{'fixed' if order.islower() else 'turned'} {axis}" for axis in order)
        text = f"the three angles are turns about {about}, not about turned Z, Y, X"
        yield read(Rotation.from_euler(order, angles).as_matrix(), F, text)


def _solved(
    values: FloatArray,
    terms: Iterable[FloatArray],
    axes: FloatArray | None = None,
    unknowns: int = 0,
) -> tuple[FloatArray, float]:
    """Return the factors of some terms beside a bias, and what is left of a component.

    Parameters
    ----------
    values : ndarray, shape (posture, 3)
        Forces or moments.
    terms : iterable of ndarray, shape (posture, 3)
        What they are a sum of.
    axes : ndarray, shape (3,), optional
        Which are counted; by default all.
    unknowns : int
        How many there are where it is more than terms and biases.
    """
    kept = np.ones(3, dtype=bool) if axes is None else axes
    centred = [each[:, kept] - each[:, kept].mean(axis=0) for each in (values, *terms)]
    b, *columns = [each.ravel() for each in centred]
    A = np.column_stack(columns)
    x = np.asarray(np.linalg.lstsq(A, b)[0])
    over = len(b) - max(unknowns, int(kept.sum()) + len(x))
    if over < _LEAST_OVER:
        return x, np.inf
    return x, float(np.sqrt(np.sum((b - A @ x) ** 2) / over))


def _scatter(values: FloatArray) -> float:
    return float(np.sqrt(np.mean((values - values.mean(axis=0)) ** 2)))


def _angle_between(a: FloatArray, b: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


_HEAVIEST = 5000.0
"""In kg; robots carry up to 2300 kg."""
_FREE = ToolModel(rotation=True)
_QUATERNIONS = (("x y z w", "w x y z", [1, 2, 3, 0]), ("w x y z", "x y z w", [3, 0, 1, 2]))
"""Orders of a quaternion: of the column names, of the numbers, and of the numbers in words."""
_UNITS = ("N", "N*m")
_POOR = 0.1
"""Part of what turns with the posture that may be left: noise, cross-talk leave a few percent."""
_NOISE = np.array([5.0, 0.5])
"""Noise of a sensor in N and N·m, used where too few postures determine it."""
_ABOVE_NOISE = 3.0
"""Residual over that of the best affine law of gravity above which it is more than noise."""
_MUCH_BETTER = 0.2
"""Share of what is left, from which on another reading is believed."""
_TRIED = 10
"""Postures that are left out in turn, those with most left first."""
_BETTER = 0.5
"""Residual of another reading, as a share of the stated one's, from which on it is believed."""
_WRONGLY_READ = 1e-3
"""Residual, as a share of the readings' size, below which the stated reading is right."""
_LIGHT = 0.1
"""Weight, as a share of what is constant, below which a sensor seems to feel no weight turn."""
_FARTHEST = 3.0
"""Largest distance of a centre of mass from its sensor that is believed, in m."""
_CLEAR = 10.0
"""Change of the moment, as a multiple of its scatter, from which on that is believed."""
_CLOSE = 0.3
"""Largest distance of the centre of mass from where another point puts it, as a share."""


@one_blas_thread()
def refuse_mistakes(
    postures: StaticPostures,
    fit: ToolFit,
    R_nominal: FloatArray | None = None,
    expected_centre: FloatArray | None = None,
    points: Mapping[str, FloatArray] | None = None,
) -> None:
    """Refuse postures that another interpretation of their numbers explains.

    Parameters
    ----------
    postures : StaticPostures
        As stated.
    fit : ToolFit
        Fit of these postures.
    R_nominal : ndarray, shape (3, 3), optional
        Rotation of the sensor in the flange as it was mounted.
    expected_centre : ndarray, shape (3,), optional
        Where the tool's centre of mass should be, in the sensor's frame, in m; without it the
        reference point of the moments is unknown.
    points : mapping of str to ndarray, optional
        Points that moments may be about, in the sensor's frame, in m.

    Raises
    ------
    CompensationError
        Naming the mistake.
    """
    if fit.rotation_known:
        refuse_other_readings(postures, fit.R_flange_sensor, fit.model.lever)
    # Judged with the rotation free: a sensor that sits elsewhere is another mistake.
    free = fit if fit.model.rotation else fit_tool(postures, R_nominal, _FREE)
    _refuse_other_order(postures, free, R_nominal)
    _refuse_base(postures, free)
    _refuse_other_forces(postures, fit, free, R_nominal)
    _refuse_other_moments(postures, free)
    _refuse_far_centre(postures, fit)
    _refuse_misfit(postures, fit, R_nominal)
    if expected_centre is not None:
        _refuse_other_point(fit, expected_centre, points or {})


def sensor_mistake(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> SensorMistake | None:
    """Return the mistake in forces, else in moments; see `force_mistake`."""
    found = force_mistake(postures, R_flange_sensor, lever)
    return found or moment_mistake(postures, R_flange_sensor, lever)


def refuse_other_readings(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> None:
    """Refuse postures that one tool explains once a mistake is undone, the sensor as mounted.

    Parameters
    ----------
    postures : StaticPostures
        As stated.
    R_flange_sensor : ndarray, shape (3, 3)
        As mounted.
    lever : float
        The sensor's moment range over its force range, in m.

    Raises
    ------
    CompensationError
        Naming the mistake.
    """
    found = sensor_mistake(postures, R_flange_sensor, lever)
    if found is not None:
        raise CompensationError(found.message)


def _refuse_misfit(postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None) -> None:
    """Refuse postures that do not fit one tool, saying why where that can be found."""
    if fit.mass > _HEAVIEST:
        raise CompensationError(
            f"mass comes out as {fit.mass:.4g} kg, more than a robot carries ({_HEAVIEST:g} kg):"
            " forces in another unit than stated"
        )
    left, turning = _left(postures, fit), _turning(postures)
    if not np.any(left > _allowed(postures)):
        return
    _refuse_one_posture(postures, fit, R_nominal, left)
    # Without weight, or turned too little, noise is all that changes: undetermined, no misfit.
    if postures.spread > _LEAST_SPREAD and _weight(postures, fit) > left[0]:
        which = int(np.argmax(left / _allowed(postures)))
        unit = _UNITS[which]
        raise CompensationError(
            f"the postures do not fit one tool: {left[which]:.3g} {unit} are left of a component of"
            f" the {('force', 'moment')[which]}, of {turning[which]:.3g} {unit} that change with"
            " the posture: was the robot at rest, the tool free, the cables slack?"
        )


def _refuse_one_posture(
    postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None, left: FloatArray
) -> None:
    if len(postures) <= LEAST_POSTURES + 1:
        return
    for row in _suspects(postures, fit):
        others = postures.chosen(np.arange(len(postures)) != row)
        refit = fit_tool(others, R_nominal, fit.model)
        without = _left(others, refit)
        worst = int(np.argmax(left / np.maximum(without, np.finfo(float).tiny)))
        if np.all(without <= _allowed(others)) and without[worst] < _MUCH_BETTER * left[worst]:
            unit = _UNITS[worst]
            raise CompensationError(
                f"posture {row + 1} does not fit the others: {left[worst]:.3g} {unit} are left of a"
                f" component, without it {without[worst]:.3g} {unit}: measure it again or leave it"
                " out"
            )


def _suspects(postures: StaticPostures, fit: ToolFit) -> Iterable[int]:
    force, moment = (
        np.linalg.norm(part, axis=1) / max(float(np.abs(part).max()), np.finfo(float).tiny)
        for part in tool_residual(postures, fit)
    )
    worst: list[int] = np.argsort(-np.maximum(force, moment), kind="stable").tolist()
    return worst[:_TRIED]


def _left(postures: StaticPostures, fit: ToolFit) -> FloatArray:
    """Return the rest of a component of force and moment, root mean square."""
    return np.array([_rms(part) for part in tool_residual(postures, fit)])


def _allowed(postures: StaticPostures) -> FloatArray:
    scatter = affine_scatter(postures)
    noise = _NOISE if scatter is None else _ABOVE_NOISE * scatter
    allowed: FloatArray = np.maximum(_POOR * _turning(postures), noise)
    return allowed


def _turning(postures: StaticPostures) -> FloatArray:
    """Return the part of a component of force and moment that changes with the posture."""
    return np.array([_rms(part - part.mean(axis=0)) for part in (postures.force, postures.moment)])


def _refuse_other_order(
    postures: StaticPostures, free: ToolFit, R_nominal: FloatArray | None
) -> None:
    """Refuse quaternions whose numbers are in the other of the two usual orders."""
    if not postures.quaternions:
        return
    stated = _rms(tool_residual(postures, free)[0])
    if not stated > _WRONGLY_READ * _rms(postures.force):
        return
    quaternions = Rotation.from_matrix(postures.R_base_flange).as_quat()
    for named, actual, places in _QUATERNIONS:
        R = Rotation.from_quat(quaternions[:, places]).as_matrix()
        other = postures.read_as(R_base_flange=R)
        left = _rms(tool_residual(other, fit_tool(other, R_nominal, _FREE))[0])
        if left < _MUCH_BETTER * stated:
            raise CompensationError(
                f"the quaternions' numbers stand in the order {actual}, their columns are named"
                f" {named}: read so, {left:.3g} N are left of a force component instead of"
                f" {stated:.3g} N; rename the columns"
            )


def _refuse_base(postures: StaticPostures, fit: ToolFit) -> None:
    """Refuse wrenches in base: the weight does not turn with the sensor, it looks like a bias."""
    g = postures.gravity
    R = postures.R_base_flange
    # F = mass g + R b in base, if b is the bias in the flange's axes.
    A = np.dstack([np.broadcast_to(g[:, None], (len(R), 3, 1)), R]).reshape(-1, 4)
    solution, *_ = np.linalg.lstsq(A, postures.force.ravel(), rcond=None)
    left = _rms(postures.force.ravel() - A @ solution)
    stated = _rms(tool_residual(postures, fit)[0])
    constant = float(np.linalg.norm(fit.force_bias))
    upright = float(fit.force_bias @ g) > 0.9 * constant * float(np.linalg.norm(g))
    seems_constant = (
        _weight(postures, fit) < _LIGHT * constant and upright and postures.spread > _LEAST_SPREAD
    )
    noticeable = stated > _WRONGLY_READ * _rms(postures.force)
    if solution[0] > 0.0 and (seems_constant or (noticeable and left < _BETTER * stated)):
        raise CompensationError(
            "wrenches seem to be in base already: the weight does not turn with the sensor"
            f" ({solution[0]:.3g} kg along gravity in all {len(postures)} postures); give the raw"
            " ones, in the sensor's frame"
        )


def _refuse_other_forces(
    postures: StaticPostures, fit: ToolFit, free: ToolFit, R_nominal: FloatArray | None
) -> None:
    stated = _rms(tool_residual(postures, free)[0])
    others = {
        "the sign of the wrenches is turned, or one of the sensor's axes (a left-handed frame),"
        " or gravity": (postures.read_as(-postures.force, -postures.moment)),
        "the orientations are those of the base in the flange: invert them": (
            postures.read_as(R_base_flange=np.swapaxes(postures.R_base_flange, 1, 2))
        ),
    }
    fits = {mistake: fit_tool(other, R_nominal, _FREE) for mistake, other in others.items()}
    left = {mistake: _rms(tool_residual(others[mistake], fits[mistake])[0]) for mistake in others}
    best = min(left, key=left.__getitem__)
    if stated > _WRONGLY_READ * _rms(postures.force) and left[best] < _BETTER * stated:
        raise CompensationError(
            f"{best}: read so, {left[best]:.3g} N are left of a force component instead of"
            f" {stated:.3g} N"
        )
    turned = next(iter(others))
    as_mounted = np.eye(3) if R_nominal is None else R_nominal
    # With gravity turning in one plane both signs fit; the position of the sensor decides.
    fits_both = left[turned] <= 1.5 * stated + _WRONGLY_READ * _rms(postures.force)
    weighs = _weight(postures, fit) > _WRONGLY_READ * _rms(postures.force)
    if (fit.mass < 0.0 and weighs and "mass" not in fit.undetermined) or (
        fits_both
        and _angle(free.R_flange_sensor, as_mounted) > 0.5 * np.pi
        and _angle(fits[turned].R_flange_sensor, as_mounted) < 0.25 * np.pi
    ):
        raise CompensationError(
            f"{turned}: the mass comes out as {fit.mass:.3g} kg and the sensor"
            f" {np.degrees(_angle(free.R_flange_sensor, as_mounted)):.0f} deg from where it sits"
        )


def _refuse_other_moments(postures: StaticPostures, fit: ToolFit) -> None:
    stated = _rms(tool_residual(postures, fit)[1])
    if not stated > 10.0 * _WRONGLY_READ * max(_rms(postures.moment), 1e-9):
        return
    R = postures.R_base_flange @ fit.R_flange_sensor
    other = postures.read_as(moment=np.einsum("nji,nj->ni", R, postures.moment))
    left = _rms(tool_residual(other, fit_tool(other, fit.R_flange_sensor))[1])
    if left < _BETTER * stated:
        raise CompensationError(
            f"moments seem to be in base while the forces are not: read so, {left:.3g} N*m are left"
            f" of a component instead of {stated:.3g} N*m"
        )


def _refuse_far_centre(postures: StaticPostures, fit: ToolFit) -> None:
    """Refuse a centre of mass far away, where a moment in N·mm that is called N·m puts it."""
    distance = float(np.linalg.norm(fit.centre))
    seen = _turning(postures)[1] > _CLEAR * fit.moment_scatter and "mass" not in fit.undetermined
    if seen and distance > _FARTHEST:
        raise CompensationError(
            f"centre of mass comes out {distance:.3g} m from the sensor: forces or moments in"
            " another unit than stated, or moments about a point far away"
        )


def _refuse_other_point(
    fit: ToolFit, expected: FloatArray, points: Mapping[str, FloatArray]
) -> None:
    if any(name.startswith("centre") for name in fit.undetermined):
        return
    off, lever = (float(np.linalg.norm(v)) for v in (fit.centre - expected, expected))
    if off > lever > 0.0 and float(np.linalg.norm(fit.centre + expected)) < _CLOSE * lever:
        raise CompensationError(
            "the sign of the moments is turned: the centre of mass comes out opposite to where it"
            f" should be, {1e3 * lever:.0f} mm from the sensor's origin"
        )
    for name, point in points.items():
        arm = float(np.linalg.norm(point))
        # About a point p the weight's lever is c - p.
        if off > (1.0 - _CLOSE) * arm > 0.0 and (
            float(np.linalg.norm(fit.centre - (expected - point))) < _CLOSE * arm
        ):
            raise CompensationError(
                f"moments seem to be about the {name}, not the sensor's origin: the centre of mass"
                f" comes out {1e3 * off:.0f} mm from where it should be, which is that lever"
            )


def _weight(postures: StaticPostures, fit: ToolFit) -> float:
    return abs(fit.mass) * float(np.linalg.norm(postures.gravity))


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arccos(np.clip(0.5 * (np.trace(a.T @ b) - 1.0), -1.0, 1.0)))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
