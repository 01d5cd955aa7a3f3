"""Reports: one page, nothing outside of it, every step of the derivation, readable for everyone."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from itertools import pairwise, permutations
from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from hrsynth.analysis.controllability import legs
from hrsynth.analysis.derive import Derivation, derive
from hrsynth.cli import run_command
from hrsynth.description import load
from hrsynth.errors import BadRequest, NoReachablePose
from hrsynth.families.formations import build_formation
from hrsynth.present import palette
from hrsynth.present.drawings import svg
from hrsynth.present.report import figures, pages, parts
from hrsynth.present.report.answer import set_rows
from hrsynth.present.report.formulas import collect_symbols, format_formula, lower_indices, underline_motors

FAST = ("uranesx", None)
SLOW = [("quattro", "1,4"), ("rrrrr_m1", None), ("3ppr_m1", None)]
PAGES = pytest.mark.parametrize(
    ("name", "legs"),
    [pytest.param(*FAST, id="uranesx"), *(pytest.param(*each, id=each[0], marks=pytest.mark.slow) for each in SLOW)],
)
CSS = (files("hrsynth.present.report") / "style.css.j2").read_text()


@cache
def made(name: str, legs: str | None) -> tuple[Derivation, str]:
    observe = None if legs is None else legs.split(",")
    found = derive(load(name), observe)
    return found, report(found)


def report(found: Derivation) -> str:
    return pages.render_report(found, parts.collect_report_parts(found, 0)).decode()


def read(page: str) -> Any:
    """The page as XML: it is written so that both kinds of parser can read it."""
    root = etree.fromstring(page.strip().encode(), etree.XMLParser(huge_tree=True))
    for element in root.iter(etree.Element):
        element.tag = etree.QName(element).localname
    return root


def text_of(element: Any) -> str:
    return " ".join("".join(element.itertext()).split())


@PAGES
def test_a_page_needs_nothing_beside_itself(name: str, legs: str | None):
    page = made(name, legs)[1]
    root = read(page)
    assert page.lstrip().startswith("<!DOCTYPE html>")
    assert root.get("lang") == "en"
    for element in root.iter():
        for key, value in element.attrib.items():
            if etree.QName(key).localname in ("href", "src", "action", "srcset", "data"):
                assert value.startswith(("#", "data:image/png;base64,"))
    bare = re.sub(r'xmlns="[^"]*"|base64,[^"]*', "", page)
    assert not re.findall(r"https?:|//|@import|url\(|<script", bare)


@PAGES
def test_every_step_stands_there_with_its_rule_and_reason_and_drawing(name: str, legs: str | None):
    found, page = made(name, legs)
    root = read(page)
    rows = root.xpath("//tr[@data-step]")
    assert [int(row.get("data-step")) for row in rows] == list(range(1, len(found.steps) + 1))
    for row, step in zip(rows, found.steps, strict=True):
        assert step.rule in text_of(row)
        assert " ".join(step.reason.split()).replace("\u0332", "") in text_of(row).replace("\u0332", "")
        assert step.largest_angle is None or f"{step.largest_angle:.1e}" in text_of(row)
    drawn = [int(n) for scene in root.xpath("//*[@data-steps]") for n in scene.get("data-steps").split()]
    assert sorted(drawn) == [n for n, step in enumerate(found.steps, 1) if step.state is not None]
    assert len(drawn) == len(set(drawn))
    for scene in root.xpath("//*[@data-steps]"):
        assert [text_of(each) for each in scene.iter("figcaption")] == ["before", "after"]


@PAGES
def test_figures_have_words_headings_order_and_tables_scope(name: str, legs: str | None):
    root = read(made(name, legs)[1])
    for image in root.iter("img"):
        assert len(image.get("alt")) > 20
    for drawing in root.iter("svg"):
        if drawing.get("aria-hidden") != "true":
            assert drawing.get("role") == "img"
            assert drawing.get("aria-label")
            assert [child.tag for child in drawing[:2]] == ["title", "desc"]
    levels = [int(e.tag[1]) for e in root.iter() if re.fullmatch("h[1-6]", str(e.tag))]
    assert levels.count(1) == 1
    assert levels[0] == 1
    assert all(b <= a + 1 for a, b in pairwise(levels))
    for table in root.iter("table"):
        assert table[0].tag == "caption"
        assert all(cell.get("scope") in ("row", "col") for cell in table.iter("th"))
    named = [each.get("id") for each in root.xpath("//*[@id]")]
    assert len(named) == len(set(named))
    assert {a.get("href")[1:] for a in root.iter("a")} <= set(named)
    assert all(each.get("aria-label") for each in root.iter("math"))


@PAGES
def test_what_the_program_says_is_on_the_page(name: str, legs: str | None):
    found, page = made(name, legs)
    words = text_of(read(page))
    assert found.verdict.verdict in words
    assert f"{found.equivalence.largest_angle:.1e}" in words
    assert found.architecture.unicode.replace("\u0332", "") in words
    if found.hidden_architecture is not None:
        assert found.hidden_architecture.unicode.replace("\u0332", "") in words
    for freedom in found.verdict.unobserved:
        assert freedom.name in words


@PAGES
def test_picture_and_plain_answer_come_first_and_the_derivation_is_folded(name: str, legs: str | None):
    found, page = made(name, legs)
    root = read(page)
    first = root.xpath("//header//*[@class='hero']")[0]
    assert [each.get("aria-label") for each in first.iter("svg")] == [f"Drawing of {name}"]
    said = text_of(first.xpath(".//ul")[0])
    assert f"shows {found.verdict.rank} of {found.dof} platform dof" in said
    folded = root.xpath("//details//*[@data-steps or @data-step]")
    assert folded == root.xpath("//*[@data-steps or @data-step]") != []
    assert all(each[0].tag == "summary" and each.get("open") is None for each in root.iter("details"))


def test_sets_that_show_all_alike_are_one_row():
    found = derive(load("gough_stewart"))
    rows = list(set_rows(legs(found.setup), 63))
    assert sum(len(sets) for sets, *_ in rows) == 63
    assert [len(sets) for sets, each, _, _ in rows if not each.unobserved] == [20, 15, 6, 1]
    assert all(len(sets) == 1 for sets, each, _, _ in rows if each.unobserved)


@pytest.mark.slow
def test_sets_that_see_less_at_zero_are_told_in_their_row():
    """As `legs` tells them, at a pose that is singular with the smallest sets watched."""
    told = legs("rrrrr_m1", at="x=0,y=0.3332050807568877")
    fewer = [each for each in told.sets if each.rank_at_zero is not None]
    assert fewer
    page = read(report(derive(told.setup)))
    cells = [text_of(row[2]) for row in page.findall(".//table[@class='sets']/tbody/tr")]
    assert sorted({cell for cell in cells if "at the zero" in cell}) == sorted(
        {f"{each.rank} of {each.dof} ({each.rank_at_zero} at the zero configuration)" for each in fewer}
    )


def test_what_is_refused_is_one_sentence():
    page = read(made(*FAST)[1])
    told = [text_of(each) for each in page.xpath("//*[@class='refused']")]
    assert told == [
        "The measured values leave 1 of the platform's dof undetermined: a continuous family of dimension 1.",
        "There is no accuracy map. The error is infinite at every pose, the legs do not determine translation along z "
        "(at the zero configuration).",
    ]


def test_a_part_that_fails_leaves_its_reason():
    def fails() -> None:
        raise NoReachablePose("r", "the plane z=1", "too high")

    assert parts.ask("r", fails) == parts.RefusedPart("no pose of the plane z=1 is reached: too high")
    with pytest.raises(ZeroDivisionError):
        parts.ask("r", lambda: 1 // 0)


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "legs"), [FAST, SLOW[0]])
def test_each_drawn_step_starts_where_the_last_ended(name: str, legs: str | None):
    """The first drawing shows the real robot's motors, the last one the virtual actuators of the hidden robot."""
    found = derive(load(name), None if legs is None else legs.split(","))
    drawn = figures.step_figures(found)
    assert [n for scene in drawn for n in scene.steps] == sorted(n for scene in drawn for n in scene.steps)
    assert 'class="motor"' in drawn[0].before
    assert 'class="motor"' not in drawn[0].after
    assert 'class="virtual"' in drawn[-1].after
    for scene in drawn:
        assert (scene.before == scene.after) is False


# ---- accessibility of the colours


def luminance(colour: str) -> float:
    """Relative luminance of an sRGB colour (WCAG 2)."""
    digits = colour.lstrip("#")
    digits = "".join(2 * c for c in digits) if len(digits) == 3 else digits
    parts_of = [int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts_of)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(one: str, other: str) -> float:
    """The contrast ratio of two colours (WCAG 2)."""
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def colours() -> dict[str, str]:
    return dict(re.findall(r"--(\w+): (#[0-9a-f]+);", palette.format_css()))


def rules() -> Iterator[tuple[str, str]]:
    """Colour of text and of what it stands on, for each rule; those without a ground stand on paper or a pale box."""
    of = colours()
    for body in re.findall(r"\{([^{}]*)\}", CSS):
        text = re.search(r"(?<![-\w])color: var\(--(\w+)\)", body)
        ground = re.search(r"background: var\(--(\w+)\)", body)
        if text:
            for name in [ground[1]] if ground else ["face", "ground"]:
                yield of[text[1]], of[name]


def test_the_formula_of_contrast_is_that_of_wcag():
    assert contrast("#fff", "#000") == pytest.approx(21)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


def test_text_stands_out_from_its_ground():
    found = list(rules())
    assert len(found) >= 8
    assert all(contrast(*pair) >= 4.5 for pair in found), found


def test_letters_and_lines_of_drawings_stand_out():
    for ground in (svg.EMPTY, svg.PALE, *svg.FILLS.values()):
        assert contrast(svg.INK, ground) >= 4.5
    assert contrast(svg.EMPTY, svg.VIRTUAL) >= 4.5
    assert contrast(svg.VIRTUAL, svg.PALE) >= 4.5
    assert luminance(svg.VIRTUAL) > 2 * luminance(svg.MOTOR)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pairs", "color"),
    [(list(permutations((1, 2, 3), 2)), "good"), pytest.param([(1, 2), (2, 3)], "bad", marks=pytest.mark.long)],
)
def test_a_formation_is_as_good_in_the_table_as_in_the_headline(pairs: list[tuple[int, int]], color: str):
    made = build_formation([(0, 0, 0), (1, 0.1, 0), (0.5, 0.9, 0.2)], pairs, bodies="position")
    root = read(report(derive(made)))
    (headline,) = root.xpath("//p[contains(@class, 'verdict')]")
    assert headline.get("class") == f"verdict {color}"
    cells = root.xpath("//table[@class='sets']//td[1]")
    assert {text_of(cell).split()[0]: cell.get("class") for cell in cells} == {
        word: f"tight {shown}"
        for word, shown in (("flexible", "bad"), ("rigid", "good"))
        if word == "flexible" or color == "good"
    }
    assert text_of(root.xpath("//table[@class='sets']//tr[2]/td[last()]")[0]).split()[1] == "trivial;"
    assert "directions of the legs" not in text_of(root.xpath("//p[@class='lead']")[0])


# ---- formulas


def test_formulas_are_mathml_without_old_elements_or_entities():
    import sympy

    from hrsynth.constraints.vector_algebra import load_products, make_vector

    dot, cross, det = load_products()
    a, b, n = make_vector("B1"), make_vector("tau2"), make_vector("n")
    J = sympy.MatrixSymbol("J1", 3, 3)
    for expression in (det(n, a, b) * dot(a, b) - dot(a, cross(b, n)), sympy.Determinant(J.T * J)):
        text = format_formula(expression, 'said "so"')
        root = etree.fromstring(text.encode())
        known = {"math", "mrow", "mi", "mo", "mn", "msub", "msup", "msubsup"}
        assert {etree.QName(e).localname for e in root.iter()} <= known
        assert root.get("aria-label") == 'said "so"'
        assert set(re.findall(r"&(\w+);", text)) <= {"quot"}


def test_products_keep_their_brackets():
    """Three points seen of a Gough-Stewart platform: · binds sums and products no closer than in print."""
    from hrsynth.constraints.vector_algebra import load_products, make_vector

    dot, cross, _det = load_products()
    (b1, b2, b3), (r1, r2, r3) = ([make_vector(f"{name}{i}") for i in (1, 2, 3)] for name in "Br")
    for expression, printed in (
        (
            dot(r1, b2 - b1) * dot(r2, b3 - b2) * dot(r3, b1 - b3)
            - dot(r1, b1 - b3) * dot(r2, b2 - b1) * dot(r3, b3 - b2),
            "(r1·(-B1+B2))(r2·(-B2+B3))(r3·(B1-B3))-(r1·(B1-B3))(r2·(-B1+B2))(r3·(-B2+B3))=0",
        ),
        (dot(b1, b2 - r1) ** 2 - dot(b1, cross(r1, b2)), "(B1·(B2-r1))2-B1·(r1×B2)=0"),
    ):
        assert re.sub("<[^>]*>|\u2062", "", html.unescape(format_formula(expression, "said"))) == printed


def test_names_are_set_as_in_print():
    assert lower_indices("τ1, B2 and ui of rod_1a <x>") == (
        "τ<sub>1</sub>, B<sub>2</sub> and u<sub>i</sub> of rod_1a &lt;x&gt;"
    )
    assert underline_motors("2-Π-{2-U\u0332U}") == "2-Π-{2-<u>U</u>U}"


def test_symbols_that_differ_in_their_index_are_told_once():
    where = {"B1": "centre of wrist_1", "B2": "centre of wrist_2", "e": "tangent", "u3": "seen in leg 3"}
    assert collect_symbols(where) == [("Bi", "centre of wrist_i (i = 1, 2)"), ("e", "tangent"), ("u3", "seen in leg 3")]


def test_an_index_is_not_read_as_a_letter_of_a_name():
    """``tip1, tip2`` are not ``tipi``, nor are the symbols of a formula names."""
    where = {
        "B1": "centre of tip1",
        "B2": "centre of tip2",
        "N1": "I - u1 u1^T",
        "N2": "I - u2 u2^T",
        "u1": "direction watched in leg 1 (knee1a)",
        "u2": "direction watched in leg 2 (knee2a)",
    }
    told = [(lower_indices(symbol), lower_indices(meaning)) for symbol, meaning in collect_symbols(where)]
    assert told == [
        ("B<sub>i</sub>", "centre of tip<sub>i</sub> (i = 1, 2)"),
        ("N<sub>i</sub>", "I - u<sub>i</sub> u<sub>i</sub><sup>T</sup> (i = 1, 2)"),
        ("u<sub>i</sub>", "direction watched in leg i (knee<sub>i</sub>a) (i = 1, 2)"),
    ]


# ---- the command


def test_the_command_writes_a_page_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    page = tmp_path / "report.html"
    assert run_command(["derive", "3prp", "--report", str(page)]) == 0
    assert f"The report is written to {page}." in capsys.readouterr().out
    assert read(page.read_text(encoding="utf-8")).xpath("//tr[@data-step]")
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.parametrize(("file", "words"), [("report.pdf", ".html"), ("none/report.html", "no such folder")])
def test_a_page_that_cannot_be_written_is_refused_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, words: str
):
    assert run_command(["derive", "quattro", "--report", str(tmp_path / file)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert words in said.err
    assert list(tmp_path.iterdir()) == []


def test_accuracy_is_about_directions_that_see_everything():
    found = made(*FAST)[0]
    with pytest.raises(BadRequest, match="infinite"):
        parts.map_error_plane(found.setup, 0)


@pytest.mark.long
def test_a_report_speaks_of_what_is_seen_whatever_kind_it_is(tmp_path: Path):
    """A leg and two kinds besides on a planar robot: sets, condition, modes and accuracy are of all three."""
    page = tmp_path / "report.html"
    assert (
        run_command(
            [
                "derive",
                "3rrr_m1",
                "--observe",
                "1",
                "--camera",
                "eye=base@0.1,0.05,-0.4",
                "--sensor",
                "point:platform@0.05,0,0",
                "--sensor",
                "distance:platform@0,0.1,0",
                "--report",
                str(page),
            ]
        )
        == 0
    )
    said = text_of(read(page.read_text(encoding="utf-8")))
    asked = legs(
        "3rrr_m1",
        "eye=base@0.1,0.05,-0.4",
        observe="1",
        sensor=["point:platform@0.05,0,0", "distance:platform@0,0.1,0"],
    )
    assert asked.minimal == (("1", "point_1"), ("point_1", "distance_1"))
    assert "Fewest observations that show 3 of 3: 1, point_1; point_1, distance_1." in said
    assert "movesB1alongτ1,B4alongr4andB5normaltor5" in said.replace(" ", "")
    assert "At the zero configuration, 1 pose has the same measurements" in said
    assert "Measurement errors of 0.1°, 1mm move the platform" in said
