"""A page as one HTML file that needs nothing else: pictures are in it, and no script."""

import base64
import html
import io
import re
from string import Formatter

from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import (
    Cell,
    Element,
    Number,
    Page,
    Paragraph,
    Picture,
    Row,
    Section,
    Table,
    Verdict,
)

_DPI = 110
_MINUS = "\N{MINUS SIGN}"


def render(page: Page, figures: Figures) -> str:
    """The HTML; every number that the page names is in a <data> element with its name as title.

    Raises:
        KeyError: the page names a figure that there is not.
    """
    writer = _Writer(figures)
    introduction = "".join(map(writer.element, page.introduction))
    contents = "".join(
        f'<li><a href="#{_anchor(s.title)}">{html.escape(s.title)}</a></li>' for s in page.sections
    )
    sections = "".join(map(writer.section, page.sections))
    return _FRAME.format(
        title=html.escape(page.title),
        style=_STYLE,
        introduction=introduction,
        contents=contents,
        sections=sections,
        footer=html.escape(page.footer),
    )


def number_text(value: float | None, spec: str) -> str:
    """A figure as it is written: a dash where there is none, a true minus, never minus zero."""
    if value is None:
        return "\N{EN DASH}"
    text = format(value, spec)
    if not any(digit in text for digit in "123456789"):
        text = text.replace("-", "").replace("+", "")
    return text.replace("-", _MINUS)


class _Writer:
    """Writes a page's elements, with the figures that they name."""

    def __init__(self, figures: Figures) -> None:
        self._figures = figures

    def section(self, section: Section) -> str:
        body = "".join(map(self.element, section.elements))
        title, anchor = html.escape(section.title), _anchor(section.title)
        return f'<section id="{anchor}"><h2>{title}</h2>{body}</section>'

    def element(self, element: Element) -> str:
        if isinstance(element, Table):
            return self._table(element)
        if isinstance(element, Picture):
            return self._picture(element)
        return f"<p>{self._prose(element)}</p>"

    def _table(self, table: Table) -> str:
        classes = ["paper" if k in table.paper_columns else "" for k in range(len(table.columns))]
        words = ["", *("words" if _is_prose(table, k) else "" for k in range(1, len(classes)))]
        head = "".join(
            f'<th scope="col" class="{kind} {of}">{html.escape(heading)}</th>'
            for heading, kind, of in zip(table.columns, classes, words, strict=True)
        )
        rows = "".join(self._row(row, classes) for row in table.rows)
        caption = self._prose(Paragraph(table.caption))
        return (
            f'<div class="table"><table><caption>{caption}</caption>'
            f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
        )

    def _row(self, row: Row, classes: list[str]) -> str:
        cells = "".join(
            f'<td class="{kind} {_KINDS[type(cell)]}">{self._cell(cell)}</td>'
            for cell, kind in zip(row.cells, classes[1:], strict=True)
        )
        kind = f"{'stressed' if row.stressed else ''} {'paper' if row.from_paper else ''}"
        return f'<tr class="{kind}"><th scope="row">{html.escape(row.heading)}</th>{cells}</tr>'

    def _cell(self, cell: Cell) -> str:
        if isinstance(cell, Number):
            return self._number(cell)
        if isinstance(cell, tuple):
            return "".join(map(self._cell, cell))
        if isinstance(cell, Verdict):
            return self._verdict(cell)
        return html.escape(cell)

    def _verdict(self, verdict: Verdict) -> str:
        value = self._figures[verdict.key]
        if value is None:
            return number_text(None, "")
        kind, words = ("holds", verdict.holds) if value else ("fails", verdict.fails)
        return f'<span class="{kind}" title="{verdict.key}">{html.escape(words)}</span>'

    def _number(self, number: Number) -> str:
        sign, kind = "+" if number.signed else "", "e" if number.scientific else "f"
        return self._figure(number.key, f"{sign}.{number.digits}{kind}")

    def _figure(self, key: str, spec: str) -> str:
        value = self._figures[key]
        text = number_text(value, spec)
        return f'<data value="{"" if value is None else value}" title="{key}">{text}</data>'

    def _prose(self, paragraph: Paragraph) -> str:
        parts = []
        for words, key, spec, _ in Formatter().parse(paragraph.text):
            parts.append(html.escape(words))
            if key is not None:
                parts.append(self._figure(key, spec or ".1f"))
        return "".join(parts)

    def _picture(self, picture: Picture) -> str:
        data = io.BytesIO()
        picture.figure.savefig(data, format="png", dpi=_DPI)
        encoded = base64.b64encode(data.getvalue()).decode("ascii")
        caption = self._prose(Paragraph(picture.caption))
        return (
            f'<figure><img alt="" src="data:image/png;base64,{encoded}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )


_KINDS: dict[type, str] = {str: "words", Number: "", tuple: "", Verdict: "verdict"}


def _is_prose(table: Table, column: int) -> bool:
    return all(isinstance(row.cells[column - 1], str) for row in table.rows)


def _anchor(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


_FRAME = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<main>
<h1>{title}</h1>
{introduction}
<nav><ol>{contents}</ol></nav>
{sections}
</main>
<footer>{footer}</footer>
</body>
</html>
"""

_STYLE = """
:root { --ink: #1c2430; --soft: #5b6675; --line: #d9dee5; --paper: #f6efe0; --link: #0b5cad; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink);
  font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", Helvetica, Arial, sans-serif; }
main { max-width: 66rem; margin: 0 auto; padding: 2.5rem 1.5rem 1rem; }
h1 { font-size: 1.9rem; line-height: 1.25; margin: 0 0 1rem; }
h2 { font-size: 1.3rem; margin: 2.8rem 0 .6rem; padding-top: .9rem;
  border-top: 1px solid var(--line); }
p { max-width: 50rem; margin: .6rem 0; }
a { color: var(--link); }
nav ol { columns: 2; padding-left: 1.4rem; margin: 1.2rem 0; font-size: .95rem; }
.table { overflow-x: auto; margin: 1.1rem 0; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: var(--soft); padding: 0 0 .5rem; }
th, td { padding: .32rem .5rem; text-align: right; border-bottom: 1px solid var(--line);
  vertical-align: baseline; }
data, .holds, .fails { white-space: nowrap; }
th { font-weight: 600; }
thead th { border-bottom: 2px solid var(--ink); vertical-align: bottom; }
th[scope=row], thead th:first-child { text-align: left; min-width: 9rem; }
td.words, th.words { text-align: left; }
.paper { background: var(--paper); }
tr.stressed { font-weight: 600; }
td.verdict { text-align: center; }
.holds, .fails { border-radius: .6rem; padding: .05rem .6rem; font-weight: 600; font-size: .84rem; }
.holds { background: #d7efdc; color: #14532d; }
.fails { background: #fbdcd7; color: #8c1d0f; }
figure { margin: 1.3rem 0; }
figure img { max-width: 100%; height: auto; }
figcaption { color: var(--soft); font-size: .9rem; max-width: 50rem; }
footer { max-width: 66rem; margin: 2rem auto 0; padding: 1rem 1.5rem 2.5rem; color: var(--soft);
  font-size: .88rem; }
@media print { .table { overflow: visible; } section { break-inside: avoid-page; } }
"""
