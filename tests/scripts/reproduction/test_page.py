"""A page shows figures that it is given and no others, and one file is all of it."""

from html.parser import HTMLParser

import pytest

from grouser.scripts.reproduction.drawing import new_figure
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.html import number_text, render
from grouser.scripts.reproduction.page import (
    Element,
    Number,
    Page,
    Paragraph,
    Picture,
    Row,
    Section,
    Table,
    Verdict,
    plus_minus,
)


def page(*elements: Element) -> Page:
    return Page("A <page>", [], [Section("First & last", elements)], "the end")


FIGURES: Figures = {"a": 1.234, "b": -0.02, "none": None, "yes": 1.0, "no": 0.0}


class _Data(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[dict[str, str | None], str]] = []
        self._open: dict[str, str | None] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._open = dict(attrs) if tag == "data" else None

    def handle_data(self, data: str) -> None:
        if self._open is not None:
            self.found.append((self._open, data))
            self._open = None


def data_of(html: str) -> list[tuple[dict[str, str | None], str]]:
    parser = _Data()
    parser.feed(html)
    return parser.found


def test_numbers_are_shown_with_their_names_and_full_values() -> None:
    row = Row("row", [Number("a", 2), plus_minus(Number("b", 1, signed=True), Number("none"))])
    html = render(page(Table("of {a:.0f}", ["", "x", "y"], [row])), FIGURES)
    assert data_of(html) == [
        ({"value": "1.234", "title": "a"}, "1"),
        ({"value": "1.234", "title": "a"}, "1.23"),
        ({"value": "-0.02", "title": "b"}, "0.0"),
        ({"value": "", "title": "none"}, "\N{EN DASH}"),
    ]


def test_prose_is_escaped_and_its_figures_filled_in() -> None:
    html = render(page(Paragraph("a < b & {b:+.2f}")), FIGURES)
    assert "a &lt; b &amp; <data" in html and "\N{MINUS SIGN}0.02</data>" in html
    assert "A &lt;page&gt;" in html and 'id="first-last"' in html


def test_verdicts() -> None:
    row = Row("", [Verdict("yes"), Verdict("no", fails="larger"), Verdict("none")])
    html = render(page(Table("", ["", "", "", ""], [row])), FIGURES)
    assert ">reached</span>" in html and ">larger</span>" in html and "\N{EN DASH}</td>" in html


def test_a_figure_that_there_is_not_is_an_error() -> None:
    with pytest.raises(KeyError, match="missing"):
        render(page(Paragraph("{missing}")), FIGURES)


def test_pictures_are_in_the_file() -> None:
    figure, _ = new_figure(1, 1)
    html = render(page(Picture("a picture", figure)), FIGURES)
    assert 'src="data:image/png;base64,' in html and "<figcaption>a picture" in html
    assert "http" not in html and "<script" not in html


@pytest.mark.parametrize(
    ("value", "spec", "text"),
    [
        (None, ".1f", "\N{EN DASH}"),
        (-0.001, ".1f", "0.0"),
        (-0.001, "+.1f", "0.0"),
        (2.0, "+.1f", "+2.0"),
        (-1.6e-16, ".0e", "\N{MINUS SIGN}2e\N{MINUS SIGN}16"),
    ],
)
def test_numbers_as_text(value: float | None, spec: str, text: str) -> None:
    assert number_text(value, spec) == text


def test_what_is_no_finite_number_does_not_exist() -> None:
    values = {"x": float("nan"), "y": float("inf"), "z": 1, "n": None}
    assert named("of", values) == {"of.x": None, "of.y": None, "of.z": 1.0, "of.n": None}
