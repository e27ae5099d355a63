"""The whole document: verdict, contents, sections, a place to sign."""

from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from plotly.offline import get_plotlyjs

from elastocal import __version__
from elastocal.files import write_text
from elastocal.report.document.advice import advised
from elastocal.report.document.heading import verdict_html
from elastocal.report.document.markup import stamp
from elastocal.report.document.parts import Parts
from elastocal.report.document.section import Content
from elastocal.report.document.sections import SECTIONS
from elastocal.report.document.verdict import Verdict, judge
from elastocal.report.pages.templating import POLICY, embedded, template


@dataclass(frozen=True)
class Written:
    """A report that was written."""

    path: Path
    verdict: Verdict


def write_report(path: Path, parts: Parts) -> Written:
    """Write the report, atomically.

    Parameters
    ----------
    path : Path
        An HTML file.
    parts : Parts
        Whatever is there.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    contents = {section.identifier: section.body(parts) for section in SECTIONS}
    findings = [finding for content in contents.values() for finding in content.findings]
    verdict = judge(parts, findings, tuple(advised(parts)))
    write_text(path, _page(parts, verdict, contents))
    return Written(Path(path), verdict)


def _page(parts: Parts, verdict: Verdict, contents: dict[str, Content]) -> str:
    data: dict[str, Any] = {key: each.data for key, each in contents.items() if each.data}
    return Template(template("report.html")).substitute(
        policy=escape(POLICY),
        title=escape(f"Calibration report: {parts.name}"),
        subtitle=escape(_subtitle(parts)),
        css=template("report.css"),
        verdict=verdict_html(parts, verdict),
        contents="".join(
            f'<li><a href="#{section.identifier}">{escape(section.title)}</a></li>'
            for section in SECTIONS
        ),
        sections="".join(
            f'<section aria-labelledby="{section.identifier}"><h2 id="{section.identifier}">'
            f"{number}. {escape(section.title)}</h2>{contents[section.identifier].html}</section>"
            for number, section in enumerate(SECTIONS, start=1)
        ),
        footer=f"Made by elastocal {escape(__version__)}, {stamp(parts.made)}.",
        data=embedded(data),
        # Four and a half megabytes that only the view in three dimensions needs.
        plotly=get_plotlyjs() if "poses" in data else "",
        script=template("view.js") + template("report.js"),
    )


def _subtitle(parts: Parts) -> str:
    robot = parts.robot or "robot not known"
    return f"Elastic calibration of {robot}{', simulated cell' if parts.simulated else ''}"
