"""The uncertainty of a predicted deflection, stated in the form of ISO/IEC 17025.

The evaluation follows the GUM (JCGM 100:2008): standard uncertainties of type A from readings at
poses that were left out of the fit, of type B from what calibration certificates state, added in
quadrature; the expanded uncertainty has Student's coverage factor of the effective degrees of
freedom (JCGM 100, G.4: Welch-Satterthwaite) for the 95.45 % that k = 2 covers of a normal
distribution. It applies to the deflection along any one axis, at poses and under forces like those
of the run.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from elastocal.results import brief_repr
from elastocal.verdict.evidence import Evidence
from elastocal.wording import Phrase, counted, phrase

COVERAGE_FACTOR = 2.0
"""Coverage factor of the uncertainties that the instruments' certificates state."""
_COVERED = 0.9545
"""Probability that k = 2 covers of a normal distribution."""


@dataclass(frozen=True)
class UncertaintySource:
    """One contribution."""

    name: Phrase
    kind: str
    """``A``: from readings of this run; ``B``: from elsewhere."""
    standard: float | None
    """Standard uncertainty of a deflection along one direction, in m; None: not known."""
    origin: Phrase
    """Method of its evaluation."""


@brief_repr
@dataclass(frozen=True)
class UncertaintyStatement:
    """Contributions and what they come to."""

    sources: tuple[UncertaintySource, ...]
    degrees_of_freedom: int
    """Degrees of freedom of the type A evaluation: poses that were left out, less one."""

    @property
    def standard(self) -> float:
        """Combined standard uncertainty in m, of what is known."""
        known = [each.standard for each in self.sources if each.standard is not None]
        return float(np.sqrt(np.sum(np.square(known))))

    @property
    def effective_degrees(self) -> float:
        """Effective degrees of freedom: those of type A, more where type B adds to it."""
        of_type_a = sum((each.standard or 0.0) ** 4 for each in self.sources if each.kind == "A")
        part = of_type_a / self.standard**4 if self.standard > 0.0 else 1.0
        return max(self.degrees_of_freedom, 1) / part

    @property
    def factor(self) -> float:
        """Coverage factor k, by Student's distribution."""
        return float(stdtrit(np.floor(self.effective_degrees), 0.5 * (1.0 + _COVERED)))

    @property
    def expanded(self) -> float:
        """Expanded uncertainty in m, `factor` times the standard one."""
        return self.factor * self.standard

    @property
    def is_complete(self) -> bool:
        """Whether every contribution is known."""
        return all(each.standard is not None for each in self.sources)


def state_uncertainty(evidence: Evidence) -> UncertaintyStatement | None:
    """Return the uncertainty of a predicted deflection; None where no error is known."""
    unseen = evidence.unseen
    if unseen is None:
        return None
    # The norm holds three directions.
    spread = float(np.sqrt(np.mean(unseen.error**2) / 3.0))
    sources = [
        UncertaintySource(
            phrase("error at poses left out of the fit: model, repeatability, noise, set-up"),
            "A",
            spread,
            phrase(
                "root mean square of {readings} at {poses}, along one direction",
                readings=counted(len(unseen.error), "reading"),
                poses=counted(unseen.poses, "pose"),
            ),
        ),
        *_zero(evidence),
        _sensor(evidence),
    ]
    return UncertaintyStatement(tuple(sources), unseen.poses - 1)


def why_not_stated(evidence: Evidence) -> Phrase:
    """Return why there is no uncertainty to state."""
    if evidence.figures is None:
        return phrase("Not stated: no error at poses left out of the fit is known.")
    return phrase("Not stated: the errors that the model file states could not be confirmed.")


def _zero(evidence: Evidence) -> Iterator[UncertaintySource]:
    """Yield the contributions of what measured the zero: the tracker, the contact, or both."""
    contact = None if evidence.figures is None else evidence.figures.contact
    if contact is not None:
        yield UncertaintySource(
            phrase("compliance of the contact that held the tool, without a tracker"),
            "A",
            contact.zero,
            phrase(
                "spread over fits to resampled poses; what was stated of the contact is drawn with"
                " them"
            ),
        )
    if contact is None or contact.tracked:
        yield _tracker(evidence)


def _tracker(evidence: Evidence) -> UncertaintySource:
    name, stated = phrase("calibration of the tracker"), evidence.certificate.tracker.uncertainty
    if stated is None:
        return UncertaintySource(name, "B", None, _NOT_STATED)
    return UncertaintySource(name, "B", stated / COVERAGE_FACTOR, _FROM_CERTIFICATE)


def _sensor(evidence: Evidence) -> UncertaintySource:
    """Return the contribution of the sensor's calibration: forces scale the deflections."""
    name, stated = (
        phrase("calibration of the force sensor"),
        evidence.certificate.sensor.uncertainty,
    )
    dataset = evidence.calibrated_from
    if stated is None or dataset is None:
        return UncertaintySource(name, "B", None, _NOT_STATED)
    readings = dataset.readings(dataset.joint_names)
    force = float(np.sqrt(np.mean(np.sum(readings.force**2, axis=1))))
    deflection = float(np.sqrt(np.mean(np.sum(readings.deflection**2, axis=1)) / 3.0))
    standard = stated / COVERAGE_FACTOR / force * deflection
    return UncertaintySource(name, "B", standard, _FROM_CERTIFICATE)


_NOT_STATED = phrase("not stated: the cell file gives no uncertainty for it")
_FROM_CERTIFICATE = phrase("as stated by its certificate, halved (k = 2)")
