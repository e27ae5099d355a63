"""Both arms from presses on each other: prior, fit, left-out poses, intervals, what is not seen.

The prior says what is known beside the presses. Of an arm that was calibrated before, its model,
which the draws alone spread; of another one, that no spring is softer by far than the drive of
its joint (`elastocal.identification.DriveCompliances`). Where the presses see only the sum of a
tilt of both bases, the prior shares it out.

Blunders are set aside before anything is chosen, since one would move both arms: a press that fits
neither springs at the bearings nor gears, as `elastocal.identification.screen` judges it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel, actuated
from elastocal.errors import IdentificationError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification import (
    BLUNDER_SCORE,
    BLUNDER_SIZE,
    CUT,
    MOST_BLUNDERS,
    MOST_UNEXPLAINED,
    RANK_TOLERANCE,
    CalibratedModel,
    CalibrationDomain,
    Contact,
    DriveCompliances,
    HeldOut,
    Observability,
    Overlap,
    PoseGrams,
    Problem,
    Solution,
    as_fitted,
    bootstrap,
    factor,
    find_hidden,
    interval,
    judge_models,
    leave_poses_out,
    observability,
    robust_fit,
    rung_of,
    screen,
    solve,
    weighed_contact,
    widen_draws,
    widening_factor,
)
from elastocal.parallel import one_blas_thread
from elastocal.results import brief_repr
from elastocal.two_robots.presses import PairModel, PairPrior, PairReadings, build_pair
from elastocal.two_robots.tilts import tilt_finding
from elastocal.wording import mm, phrase

AUTO = "auto"
TRIED = ("actuated", "bearing", "links", "gears")
"""Springs that `auto` chooses from, by the error at left-out poses; the simplest first."""
_ROUNDS = 3
"""Fits after which the noise of a row no longer changes."""
_ALIKE = 0.1
"""Standard deviation of the springs of two arms of one type from one another, over the compliance
of the drive of the joint."""
_DRAWN_APART = 2.0
"""How many times as far apart the draws let them be: the fit errs less with a tenth, and arms of
one type differ by a fifth (docs/decisions/0146-draws-move-the-tip.md)."""
_MOST_ASIDE = 0.25
"""Largest part of the presses that may be set aside. It is more than for one arm, since a tool
that slips spoils every press of its meeting."""
_LEAST_SPREAD = 1e-3
"""Least standard deviation of a known direction, over the largest of its arm."""

UNFIT = Kind(
    "two-robots.unfit",
    "at left-out poses the models leave {left} of the relative displacement unexplained, more than"
    " half: they are not fit for use",
    shown={"left": as_number(".0%")},
)
UNMATCHED = Kind(
    "two-robots.unmatched",
    "{count} readings were left out: the other arm recorded none of that pose and load case",
    grade=Grade.NOTE,
)
SET_ASIDE = Kind(
    "two-robots.press-set-aside",
    "the press at {name} was set aside as a blunder, the readings of both arms ({error} off)",
    advice="Press at {name} again: what the controllers said there is no press of these arms.",
    grade=Grade.NOTE,
    shown={"error": mm},
)
MANY_ASIDE = Kind(
    "two-robots.many-presses-set-aside",
    "{count} of {all} presses were set aside as blunders: more than single mistakes",
    advice="Find out what went wrong at them (a tool that slips, rows mixed up) before the models"
    " are used.",
)
LOOKS_WRONG = Kind(
    "two-robots.presses-look-wrong",
    "presses beyond any noise were kept in the fit: {count}, the worst at {name} ({error} off)",
    advice="Look at {name}, and leave it out with `--exclude {key}` if it is wrong.",
    shown={"error": mm},
)
LEFT_OUT = Kind(
    "two-robots.left-out-by-hand",
    "presses left out by hand: {names}",
    advice="Measure again what was left out, so that nothing has to be.",
    grade=Grade.NOTE,
)


@brief_repr
@dataclass(frozen=True, eq=False)
class PairCalibration:
    """Models of both arms, with the evidence of their quality."""

    pair: PairReadings
    """The presses that were fitted."""
    springs: str
    """Name of the springs that were fitted."""
    models: tuple[CalibratedModel, CalibratedModel]
    """Draw by draw the two belong together."""
    seen: Observability
    """Of both arms together, by the presses alone; springs are named ``ARM:joint.axis``."""
    held_out: HeldOut
    """Errors of the relative displacement at left-out poses."""
    contact: tuple[tuple[str, float, float, float], ...]
    """Compliances of the contact: name, value, and ends of the 95 % interval, in m/N."""
    tried: tuple[tuple[str, float], ...]
    """Springs that were tried, with their mean error at left-out poses, in m."""
    findings: tuple[Finding, ...]
    known: tuple[str, ...]
    """Arms whose model was known before."""

    @property
    def deflection(self) -> float:
        """Mean relative displacement less what the controllers say, in m."""
        return float(np.linalg.norm(self.pair.relative, axis=1).mean())


@dataclass(frozen=True, eq=False)
class _Fit:
    """Springs that were fitted, and how well they predict left-out poses."""

    name: str
    model: PairModel
    problem: Problem
    held_out: HeldOut
    solution: Solution


@one_blas_thread()
def identify_pair(
    pair: PairReadings,
    rng: Generator,
    contact: Contact | None = None,
    springs: str = AUTO,
    known: Mapping[str, CalibratedModel] | None = None,
    draws: int = 200,
) -> PairCalibration:
    """Identify the springs of both arms from presses on each other.

    Parameters
    ----------
    pair : PairReadings
        The presses.
    rng : Generator
        Source of randomness of the bootstrap.
    contact : Contact, optional
        What is known of the contact; needed where no tracker measured.
    springs : str
        Name of a spring layout or rung, or ``auto``: the best at left-out poses of `TRIED`.
    known : mapping, optional
        Models of arms that were calibrated before, by the arm's name; they keep their own springs.
    draws : int
        Bootstrap draws.

    Raises
    ------
    IdentificationError
        If poses are too few, nothing is known of the contact, or the springs imitate it.
    """
    before = dict(known or {})
    _require_known(pair, before)
    pair, wrong = _screened(pair, contact)
    contact, noise = _weighed(pair, contact)
    drives = _drives(pair, contact)
    names = TRIED if springs == AUTO else (springs,)
    fits = [_fit(pair, name, before, (contact, noise), drives) for name in names]
    fit = fits[_best(fits)]
    found = _certified(pair, fit, fits, before, drives, rng, draws)
    return replace(found, findings=(*found.findings, *wrong))


def _screened(
    pair: PairReadings, contact: Contact | None
) -> tuple[PairReadings, tuple[Finding, ...]]:
    """Return the presses without blunders, and findings on those that look wrong.

    First by springs at the bearings, as for one arm; then by gears, which fit closer and so find
    smaller ones. Either may imitate a free contact: it is taken as a first fit has it. A press that
    has one of the two marks of a blunder is kept, and said.
    """
    stated = None if contact is None else as_fitted(contact)
    typical = float(np.median(np.linalg.norm(pair.relative, axis=1)))
    findings: list[Finding] = []
    whole = len(pair)
    for name in ("bearing", "gears"):
        problem = build_pair(_model(pair, name, {}), pair, stated)
        seen, found = pair, screen(problem, _MOST_ASIDE)
        order = np.argsort(-found.residual, kind="stable")
        findings += [
            SET_ASIDE(name=_press(pair, row), error=float(found.residual[row]))
            for row in order[found.blunder[order]].tolist()
        ]
        pair = pair.set_aside(found.blunder)
    if len(findings) > MOST_BLUNDERS * whole:
        findings.insert(0, MANY_ASIDE(count=len(findings), all=whole))
    marked = (found.score > BLUNDER_SCORE) | (found.residual > BLUNDER_SIZE * typical)
    kept = order[(found.suspicious & marked & ~found.blunder)[order]].tolist()
    if kept:
        worst = kept[0]
        name, error = _press(seen, worst), float(found.residual[worst])
        findings.append(LOOKS_WRONG(count=len(kept), name=name, key=seen.name(worst), error=error))
    if pair.excluded:
        findings.append(LEFT_OUT(names=pair.excluded))
    return pair, tuple(findings)


def _press(pair: PairReadings, row: int) -> str:
    """Return the meeting and load case of a press, in words."""
    return phrase(
        "pose {pose} {load_case}",
        pose=int(pair.first.pose[row]),
        load_case=str(pair.first.load_case[row]),
    )


def _require_known(pair: PairReadings, known: Mapping[str, CalibratedModel]) -> None:
    for name, model in known.items():
        if name not in pair.names:
            raise IdentificationError(
                f"there is no arm {name!r} to know anything of: {', '.join(pair.names)}"
            )
        robot = pair.robots[pair.names.index(name)]
        if model.model.robot.joint_names != robot.joint_names:
            raise IdentificationError(f"the model of {name!r} is of a robot with other joints")


def _model(pair: PairReadings, name: str, known: Mapping[str, CalibratedModel]) -> PairModel:
    """Return springs of a name for both arms; a known arm keeps its own."""
    first, second = (
        known[arm].model
        if arm in known
        else ElasticModel(robot, rung_of(robot, name).springs(robot, readings))
        for arm, robot, readings in zip(
            pair.names, pair.robots, (pair.first, pair.second), strict=True
        )
    )
    return PairModel(pair.names, (first, second))


def _weighed(pair: PairReadings, contact: Contact | None) -> tuple[Contact | None, float]:
    """Return the contact weighed against the noise of a row, and that noise, in m.

    By first fits of gears; of springs at bearings where gears imitate a compliance that is free.
    """
    try:
        return _weighed_by(_model(pair, "gears", {}), pair, contact)
    except IdentificationError:
        return _weighed_by(_model(pair, "bearing", {}), pair, contact)


def _weighed_by(
    model: PairModel, pair: PairReadings, contact: Contact | None
) -> tuple[Contact | None, float]:
    if contact is None:
        return None, robust_fit(build_pair(model, pair))[1]
    for _ in range(_ROUNDS):
        problem = build_pair(model, pair, contact)
        c, noise = robust_fit(problem)
        contact = weighed_contact(contact, problem, c, noise)
    return contact, contact.row_noise


def _drives(pair: PairReadings, contact: Contact | None) -> DriveCompliances:
    """Return the compliance of the drive of each joint of both arms."""
    first, second = (ElasticModel(robot, actuated(robot)) for robot in pair.robots)
    model = PairModel(pair.names, (first, second))
    joints = [each.joint for each in model.springs]
    revolute = [each for robot in pair.robots for each in robot.revolute]
    # Drives alone imitate the contact: it is taken as a first fit has it.
    problem = build_pair(model, pair, None if contact is None else as_fitted(contact))
    return DriveCompliances.of_problem(joints, revolute, problem, model.springs)


def prior_of(
    model: PairModel, known: Mapping[str, CalibratedModel], drives: DriveCompliances
) -> PairPrior:
    """Return what is known of both arms beside the presses.

    Of a known arm ``L^-1 (c - c_before)`` with the covariance ``L L'`` of its draws; of another
    ``c / s`` with the sizes ``s`` of its drives. The fit takes a known arm as it is and only draws
    it, as `elastocal.identification.KnownCompliance` does: what both models lack, and the contact,
    would move it, and its draws would not show by how much.
    """
    parameters = model.parameters
    rows = np.zeros((len(parameters), len(parameters) + 1))
    drawn = np.ones(len(parameters))
    sizes = drives.sizes(parameters)
    for arm, name in enumerate(model.names):
        own = model.columns(arm)
        if name not in known:
            rows[own, own] = np.diag(1.0 / sizes[own])
            continue
        before = known[name]
        scale = np.array([each.scale for each in before.model.parameters])
        deviations = (before.draws - before.compliance) / scale
        values, vectors = np.linalg.eigh(deviations.T @ deviations / len(deviations))
        least = _LEAST_SPREAD**2 * max(float(values.max()), np.finfo(float).tiny)
        whitening = (vectors / np.sqrt(np.maximum(values, least))).T / scale / CUT
        rows[own, own], rows[own, -1] = whitening, whitening @ before.compliance
        drawn[own] = 1.0 / CUT
    first, second = (model.columns(arm) for arm in (0, 1))
    if known or not of_one_type(model):
        return PairPrior(rows, drawn)
    alike = np.zeros((len(sizes[first]), rows.shape[1]))
    apart = 1.0 / (_ALIKE * np.minimum(sizes[first], sizes[second]))
    alike[:, first], alike[:, second] = np.diag(apart), -np.diag(apart)
    drawn = np.append(drawn, np.full(len(alike), _DRAWN_APART))
    return PairPrior(np.concatenate([rows, alike]), drawn)


def of_one_type(model: PairModel) -> bool:
    """Return whether both arms are of one type: the same springs, and the same lengths."""
    first, second = (each.robot for each in model.models)
    # Knees of gears follow from the loads of each, so that their parameters differ in name.
    springs = [[(s.name, len(s.parameters)) for s in each.springs] for each in model.models]
    if springs[0] != springs[1]:
        return False
    joints = zip(first.chain.joints, second.chain.joints, strict=True)
    return all(
        np.allclose(one.placement, other.placement) and np.allclose(one.axis, other.axis)
        for one, other in joints
    )


def _fit(
    pair: PairReadings,
    name: str,
    known: Mapping[str, CalibratedModel],
    weighed: tuple[Contact | None, float],
    drives: DriveCompliances,
) -> _Fit:
    model = _model(pair, name, known)
    problem = build_pair(model, pair, weighed[0], prior_of(model, known, drives), weighed[1])
    return _Fit(name, model, problem, leave_poses_out(problem), solve(problem))


def _best(fits: list[_Fit]) -> int:
    """Return the number of the fit that predicts left-out poses best."""
    if len(fits) == 1:
        return 0
    folds = range(fits[0].held_out.folds)
    errors = np.array(
        [[each.held_out.error[each.held_out.fold == k].mean() for each in fits] for k in folds]
    )
    overlap = Overlap.leaving_one_out(len(errors))
    return judge_models(errors, np.ones(len(fits), dtype=bool), overlap).best


def _certified(
    pair: PairReadings,
    fit: _Fit,
    fits: list[_Fit],
    known: Mapping[str, CalibratedModel],
    drives: DriveCompliances,
    rng: Generator,
    draws: int,
) -> PairCalibration:
    """Return the calibration with intervals, and what it does not see."""
    problem, c = fit.problem, fit.solution.compliance
    drawn = bootstrap(PoseGrams.of(problem), draws, rng, problem.prior_error)
    by = widening_factor(problem, c, drawn, fit.held_out.compliance)
    drawn = widen_draws(problem, c, drawn, by)
    plain = problem.of_springs()
    springs = c[problem.springs]
    sizes = drives.sizes(fit.model.parameters)
    seen = _seen(plain, fit.model, springs, sizes)
    names = tuple(name for name in pair.names if name in known)
    tilt = tilt_finding(fit.model, pair.T_first_second, names)
    findings = [] if tilt is None else [tilt]
    unexplained = fit.held_out.mean / float(np.linalg.norm(problem.d, axis=1).mean())
    if not unexplained <= MOST_UNEXPLAINED:
        findings.insert(0, UNFIT(left=unexplained))
    if pair.unmatched:
        findings.append(UNMATCHED(count=pair.unmatched))
    first, second = (
        _model_of(arm, pair, fit, known, (drawn, plain, unexplained, sizes)) for arm in (0, 1)
    )
    return PairCalibration(
        pair=pair,
        springs=fit.name,
        models=(first, second),
        seen=seen,
        held_out=fit.held_out,
        contact=_contact_figures(problem, c, drawn),
        tried=tuple((each.name, each.held_out.mean) for each in fits),
        findings=tuple(findings),
        known=names,
    )


def _seen(
    problem: Problem, model: PairModel | ElasticModel, c: FloatArray, sizes: FloatArray
) -> Observability:
    """Return what presses tell of each spring, without the prior."""
    found = observability(factor(problem.without_prior()), model.springs, problem, c)
    return find_hidden(found, problem, c, model.parameters, sizes, held=True)


def _contact_figures(
    problem: Problem, c: FloatArray, draws: FloatArray
) -> tuple[tuple[str, float, float, float], ...]:
    own = problem.contact_columns
    low, high = interval(draws[:, own])
    numbers = zip(c[own].tolist(), low.tolist(), high.tolist(), strict=True)
    return tuple((name, *each) for name, each in zip(problem.contact, numbers, strict=True))


def _model_of(
    arm: int,
    pair: PairReadings,
    fit: _Fit,
    known: Mapping[str, CalibratedModel],
    found: tuple[FloatArray, Problem, float, FloatArray],
) -> CalibratedModel:
    """Return the model of one arm, as any calibration has it."""
    draws, plain, unexplained, sizes = found
    own, model = fit.model.columns(arm), fit.model.models[arm]
    c = fit.solution.compliance[own]
    readings = (pair.first, pair.second)[arm]
    other = pair.names[1 - arm]
    alone = _alone(plain, own, other in known)
    return CalibratedModel(
        model,
        c,
        draws[:, own],
        _seen(alone, model, c, sizes[own]),
        f"presses of {pair.names[0]} and {pair.names[1]} on each other",
        fit.held_out.misfit,
        unexplained=unexplained,
        domain=CalibrationDomain.of(model.robot, readings, plain.block),
    )


def _alone(problem: Problem, own: slice, other_is_known: bool) -> Problem:
    """Return the problem of one arm in what the other arm cannot explain, unless it is known."""
    rows = problem.weighted().reshape(-1, problem.columns + 1)
    if not other_is_known:
        others = np.delete(rows[:, :-1], np.r_[own], axis=1)
        norms = np.linalg.norm(others, axis=0)
        U, s, _ = np.linalg.svd(others / np.where(norms > 0.0, norms, 1.0), full_matrices=False)
        Q = U[:, s > RANK_TOLERANCE * s[0]]
        rows = rows - Q @ (Q.T @ rows)
    seen = rows.reshape(len(problem), -1, problem.columns + 1)
    columns = np.arange(problem.columns)[own]
    size = np.broadcast_to(problem.size, problem.lower.shape)
    return Problem(
        O=seen[:, :, columns],
        d=seen[:, :, -1],
        weight=np.ones_like(problem.weight),
        block=problem.block,
        lower=problem.lower[own],
        upper=problem.upper[own],
        prior_rows=np.zeros((0, len(columns) + 1)),
        size=size[own],
    )
