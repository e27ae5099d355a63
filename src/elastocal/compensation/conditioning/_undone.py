"""Static postures with a mistake undone: what one tool on the sensor as mounted then explains.

What a mistake did can be undone without knowing whether it was made. Each reading of the numbers
is fitted by linear least squares in mass and bias, ``F = m u + b`` and ``M = h x u + b_m`` with
gravity ``u`` in the sensor's frame; the plainest of those that leave nearly the least is named,
where it leaves far less than the numbers as stated.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures
from elastocal.robot import nearest_rotation

_NOTICEABLE = 0.05
"""Part of what turns with the posture that is left, from which on mistakes are looked for."""
_CROSS_TALK = 0.03
"""Share of the ranges that cross-talk may carry over from forces to moments and back."""
_FAR_BETTER = 0.3
"""Part of it that undoing a mistake leaves at most."""
_TIE = 1.3
"""Readings that leave nearly the same are not told apart."""
_ROUNDING = 1e-6
"""Part of what is left as stated that is rounding."""
_LEAST_OVER = 8
"""Numbers left over, by which a reading is judged."""
_LEAST_PART = 2
"""Postures on either side of a change in time."""
_LEAST_TURN = np.radians(3.0)
"""A base or sensor turned by less is mounted as people mount them."""
_DEAD, _SAME = 0.1, 0.03
"""Gains of an axis below which it is dead, and nearer to 1 than which it is right."""
SENSOR_TURNED = "the sensor is not turned as stated"
"""How the mistake of a rotation begins, of which a caller may know more."""
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


def force_mistake(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> str | None:
    """Return the mistake without which one tool explains the forces; None where there is none.

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
    cross = _CROSS_TALK * _scatter(postures.moment) / lever
    least = _NOTICEABLE * _scatter(F)
    return _judged(_solved(F, [u])[1], others, (least, least + cross), "force", "N")


def moment_mistake(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> str | None:
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
            )
        for pair, order in _exchanges("moment"):
            yield _Reading(pair, _solved(M[:, order], terms)[1])

    least = _NOTICEABLE * _scatter(M)
    cross = _CROSS_TALK * _scatter(postures.force) * lever
    return _judged(_solved(M, terms)[1], readings(), (least, least + cross), "moment", "N*m")


def _judged(
    stated: float, others: Iterable[_Reading], floors: tuple[float, float], what: str, unit: str
) -> str | None:
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
    return (
        f"{best.sentence}; so read, {best.left:.3g} {unit} are left of a {what} component instead"
        f" of {stated:.3g} {unit}"
    )


def _force_readings(postures: StaticPostures, R_flange_sensor: FloatArray) -> Iterator[_Reading]:
    """Yield every reading of the forces, the plainest first; a drift is no mistake."""
    u, F = postures.gravity_flange @ R_flange_sensor, postures.force
    drift = [np.outer(postures.course, axis) for axis in np.eye(3)]
    yield _Reading("", _solved(F, [u, *drift])[1])
    yield from _axis_gains(u, F)
    for pair, order in _exchanges("force"):
        (mass,), left = _solved(F[:, order], [u])
        yield _Reading(pair, left if mass > 0.0 else np.inf)
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
        )


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
        steps.append(_Reading(text, left))
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
        f"{SENSOR_TURNED} (--sensor, cell, map): it sits"
        f" {np.degrees(angle):.1f} deg from there; correct it, or give --free-rotation",
        left if angle > _LEAST_TURN else np.inf,
        imitated=True,
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
    angles = Rotation.from_matrix(R).as_euler("ZYX")
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
