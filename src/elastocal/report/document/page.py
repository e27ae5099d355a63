"""The whole document: verdict, contents, sections, a place to sign."""

from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from plotly.offline import get_plotlyjs

from elastocal import __version__
from elastocal.files import write_text
from elastocal.report.document.heading import verdict_html
from elastocal.report.document.markup import stamp
from elastocal.report.document.section import Content
from elastocal.report.document.sections import SECTIONS
from elastocal.report.pages.templating import POLICY, embedded, template
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.judgement import Verdict, advised, judge


@dataclass(frozen=True)
class Written:
    """A report that was written."""

    path: Path
    verdict: Verdict


def write_report(path: Path, evidence: Evidence) -> Written:
    """Write the report, atomically.

    Parameters
    ----------
    path : Path
        An HTML file.
    evidence : Evidence
        Whatever is there.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    contents = {section.identifier: section.body(evidence) for section in SECTIONS}
    findings = [finding for content in contents.values() for finding in content.findings]
    verdict = judge(evidence, findings, tuple(advised(evidence)))
    write_text(path, _page(evidence, verdict, contents))
    return Written(Path(path), verdict)


def _page(evidence: Evidence, verdict: Verdict, contents: dict[str, Content]) -> str:
    data: dict[str, Any] = {key: each.data for key, each in contents.items() if each.data}
    return Template(template("report.html")).substitute(
        policy=escape(POLICY),
        title=escape(f"Calibration report: {evidence.name}"),
        subtitle=escape(_subtitle(evidence)),
        css=template("report.css"),
        verdict=verdict_html(evidence, verdict),
        contents="".join(
            f'<li><a href="#{section.identifier}">{escape(section.title)}</a></li>'
            for section in SECTIONS
        ),
        sections="".join(
            f'<section aria-labelledby="{section.identifier}"><h2 id="{section.identifier}">'
            f"{number}. {escape(section.title)}</h2>{contents[section.identifier].html}</section>"
            for number, section in enumerate(SECTIONS, start=1)
        ),
        footer=f"Made by elastocal {escape(__version__)}, {stamp(evidence.made)}.",
        data=embedded(data),
        # Four and a half megabytes that only the view in three dimensions needs.
        plotly=get_plotlyjs() if "poses" in data else "",
        script=template("view.js") + template("report.js"),
    )


def _subtitle(evidence: Evidence) -> str:
    robot = evidence.robot or "robot not known"
    return f"Elastic calibration of {robot}{', simulated cell' if evidence.simulated else ''}"
