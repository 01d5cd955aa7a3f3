"""The site: every record has its page and its robot file, links lead somewhere, a folder is replaced as a whole."""

from __future__ import annotations

import errno
import json
import re
from collections.abc import Iterator
from html import unescape
from html.parser import HTMLParser
from itertools import chain
from pathlib import Path

import pytest
from lxml import etree

import hrsynth
from catalog.stub import WORKERS
from hrsynth.catalog import Catalog
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.entry import build_entry
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.jsonl import format_line, parse_record
from hrsynth.catalog.site import Site, build, folder, write_site
from hrsynth.catalog.site.index import LISTS, NUMBERS, TEXTS, build_columns, format_notation
from hrsynth.catalog.site.pages import Study, derive_study, render_page, write_pages
from hrsynth.catalog.site.structures import Structure, group_structures, hash_name
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest, BuildInterruption

REFUSED = "3(Ra*!-Rb-Ra-Ph)"
WORDS = (
    "3(Rz*-Rz-Rz)",
    "3(Rz-Rz*-Rz)",
    "(Rz!-Rz-Rz*)+2(Rz*!-Rz-Rz)",
    "point:2(Rz*-Rz-Rz)",
    "2(Rt*-2SSt)",
    "3(Ro-Ro*-Ro)",
    "3(Ra*-Ro-Ro-Ro)",
    "3(Ra-Ro*-Ro-Ro)",
    REFUSED,
)
VOID = {"meta", "link", "br", "input"}


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog(tuple(parse_record(format_line({"group": "none", **build_entry(word)})) for word in WORDS))


@pytest.fixture(scope="module")
def few() -> Catalog:
    """Three structures, four architectures, without derivations: what a folder does with them is quick to see."""
    return Catalog(
        tuple(
            {"key": word, "group": "none", "legs": len(parse(word).legs), "refused": "to be quick"}
            for word in WORDS[:4]
        )
    )


@pytest.fixture(scope="module")
def made(catalog: Catalog, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Site]:
    target = tmp_path_factory.mktemp("site") / "new"
    return target, write_site(catalog, target)


class Page(HTMLParser):
    """Links, table rows and the drawings of a page; fails where tags are not closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.names: list[str] = []
        self.feed(text)
        assert self.open == [], self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("href", "src")]
        self.names += [value or "" for name, value in attrs if name == "data-name"]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def pages(target: Path) -> Iterator[tuple[Path, str]]:
    for file in sorted(target.rglob("*.html")):
        yield file, file.read_text(encoding="utf-8")


def everything(target: Path) -> dict[str, bytes]:
    return {str(file.relative_to(target)): file.read_bytes() for file in target.rglob("*") if file.is_file()}


@pytest.mark.slow
def test_every_record_has_its_page_and_its_robot_file(made, catalog):
    target, done = made
    assert (done.architectures, done.differ) == (len(WORDS), ())
    assert done.pages == len(list((target / "p").iterdir())) == len(group_structures(catalog))
    for each in group_structures(catalog):
        page = (target / "p" / f"{each.name}.html").read_text(encoding="utf-8")
        for word in (known["key"] for known in each.records):
            assert f'data-name="{hash_name(word)}"' in page
            assert word in page
            assert (target / "r" / f"{hash_name(word)}.urdf").is_file() == (word != REFUSED)
    assert len(list((target / "r").iterdir())) == len(WORDS) - 1


def test_links_lead_somewhere_and_never_to_the_network(made):
    target, _ = made
    for file, text in pages(target):
        for link in Page(text).links:
            path, _, place = link.partition("#")
            if path.startswith("data:"):
                continue
            found = (file.parent / path).resolve() if path else file
            assert found.is_file(), f"{file}: {link}"
            assert not place or place in Page(found.read_text(encoding="utf-8")).names
    for name, content in everything(target).items():
        assert not re.search(rb"https?://(?!www\.w3\.org/2000/svg)|//cdn|fetch\(|XMLHttp|import ", content), name


def test_drawings_are_well_formed_and_show_the_motors_and_the_virtual_actuators(made, catalog):
    target, _ = made
    for each in group_structures(catalog):
        text = (target / "p" / f"{each.name}.html").read_text(encoding="utf-8")
        drawn = [etree.fromstring(svg) for svg in re.findall(r"<svg.*?</svg>", text, flags=re.DOTALL)]
        drawn = [svg for svg in drawn if svg.get("role") == "img"]
        assert drawn.pop(0).get("aria-label").startswith("Drawing of")
        assert len(drawn) == 1 + bool(each.fact.get("hidden"))
        motors = [g for g in drawn[0].iter("{*}g") if g.get("class") == "motor"]
        assert len(motors) == sum(joint.motor for leg in parse(each.fact["key"]).legs for joint in leg.joints)
        for hidden in drawn[1:]:
            assert [g for g in hidden.iter("{*}g") if g.get("class") == "virtual"]


def test_a_page_says_what_the_record_says(made, catalog):
    target, _ = made
    for each in group_structures(catalog):
        text = unescape((target / "p" / f"{each.name}.html").read_text(encoding="utf-8"))
        if "refused" in each.fact:
            assert f"Refused: {each.fact['refused']}" in text
            continue
        assert f">{each.fact['verdict'].capitalize()}.<" in text
        assert f" shows {each.fact['rank']} of {each.fact['dof']} platform dof" in text
        assert ("Proved in exact arithmetic" in text) == (each.fact["instances"] == 1)
        assert f"confirmed at {each.fact['confirmed']} closed configurations" in text
        for step in each.fact["steps"]:
            assert f">{re.sub(' [0-9,]+$', '', step)}<" in text or f">{re.sub(' [0-9,]+$', '', step)} <small" in text
        if each.fact.get("condition"):
            assert each.fact["condition"] in text
        for legs in each.fact["minimal"]:
            assert "{" + ", ".join(legs) + "}" in text


@pytest.mark.some(1)
@pytest.mark.parametrize("word", [word for word in WORDS if word != REFUSED])
def test_the_robot_file_is_what_save_writes_and_derives_as_the_record(made, catalog, word, tmp_path):
    target, _ = made
    file = target / "r" / f"{hash_name(word)}.urdf"
    hrsynth.save(build_mechanism(parse(word)), tmp_path / "robot.urdf")
    assert file.read_bytes() == (tmp_path / "robot.urdf").read_bytes()
    derivation = hrsynth.derive(hrsynth.load(file))
    known = catalog[word]
    assert (derivation.architecture.ascii, derivation.verdict.verdict, derivation.verdict.rank) == (
        known["notation"],
        known["verdict"],
        known["rank"],
    )
    assert (derivation.hidden_architecture and derivation.hidden_architecture.ascii) == known.get("hidden")


def test_columns_hold_what_the_records_hold(catalog):
    every = group_structures(catalog)
    held = build_columns(every)
    records = [each for structure in every for each in structure.records]
    assert sorted(held["key"]) == sorted(WORDS)
    for i, each in enumerate(records):
        assert held["key"][i] == each["key"]
        assert each in every[held["page"][i]].records
        assert held["name"][i] == hash_name(each["key"])
        for field in NUMBERS:
            assert held[field][i] == each.get(field)
        for field in TEXTS + LISTS:
            place = held[field]["at"][i]
            own = each.get(field) if field in TEXTS else "; ".join(each.get(field) or ()) or None
            assert (None if place < 0 else held[field]["values"][place]) == own
    assert held["pages"] == [structure.name for structure in every]
    assert json.loads(json.dumps(held)) == held


def unmarked(word: str) -> set[str]:
    """The chains of a word without motors and observed links."""
    return {str(leg.canonical).translate({ord("*"): None, ord("!"): None}) for leg in parse(word).legs}


def test_structures_part_the_records_and_kin_differ_by_what_is_watched(catalog):
    every = group_structures(catalog)
    assert sorted(each["key"] for each in chain.from_iterable(s.records for s in every)) == sorted(WORDS)
    words = {each.word: each for each in every}
    assert len(words) == len(every)
    for each in every:
        assert Structure.unpack(each.pack()) == each
        assert {str(parse(record["key"]).unmoved) for record in each.records} == {str(parse(each.word).unmoved)}
        for other, verdict in each.kin:
            assert unmarked(other) == unmarked(each.word)
            assert verdict == words[other].fact.get("verdict", "refused")
            assert each.word in [word for word, _ in words[other].kin]
    assert [word for word, _ in words["3(Rz-Rz-Rz)"].kin] == ["3(Rz!-Rz-Rz)"]


def test_motors_that_change_what_is_known_part_a_structure():
    facts = [
        {"key": word, "group": "none", "rank": rank} for word, rank in (("3(Ra*-Ro-Ro-Ro)", 0), ("3(Ra-Ro*-Ro-Ro)", 3))
    ]
    assert [(each.word, each.fact["rank"]) for each in group_structures(facts)] == [
        ("3(Ra-Ro*-Ro-Ro)", 3),
        ("3(Ra-Ro-Ro-Ro)", 0),
    ]
    assert len(group_structures([{**fact, "rank": 0} for fact in facts])) == 1


def test_names_are_stable_and_distinct():
    assert hash_name("3(Rz*-Rz-Rz)") == "338940699ed1"
    assert len({hash_name(word) for word in WORDS}) == len(WORDS)


def test_what_stands_in_a_page_is_made_safe():
    fact = {"key": "3(S-S)", "group": "none", "refused": "<b>1 < 2 & 'so'"}
    shown = render_page(Structure("3(S-S)<u>", (fact,)), Study(0, differs="<i>"), {}, None)
    assert not [tag for tag in ("<b>", "<i>", "<u>") if tag in shown]
    assert Page(shown).links[:2] == ["data:,", "../report.css"]
    assert format_notation("2-Pi-{2-U*U}") == "2-Π-{2-<u>U</u>U}"


def test_a_derivation_that_does_not_end_in_the_record_is_told(catalog):
    fact = {**catalog.records[0], "hidden": "3-R*R", "rank": 2}
    found = derive_study(fact)
    assert found.derivation is not None
    assert found.differs == "3-PiR*R, controllable, rank 3"
    assert not derive_study(catalog.records[0]).differs


def refused(target: Path, catalog: Catalog) -> str:
    """What is said of a folder in which no site can be written; nothing in it changes, nothing comes beside it."""
    before = everything(target.parent)
    with pytest.raises(BadRequest) as caught:
        write_site(catalog, target)
    assert everything(target.parent) == before
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_other_folders_are_left_alone(few, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years")
    assert "thesis.tex" in refused(tmp_path / "mine", few)
    assert "not a folder" in refused(tmp_path / "mine" / "thesis.tex", few)
    assert "no such folder" in refused(tmp_path / "none" / "site", few)
    assert "no architecture fits" in refused(tmp_path / "new", Catalog(()))
    (tmp_path / ".new.part").mkdir()
    (tmp_path / ".new.part" / "thesis.tex").write_text("years")
    assert "thesis.tex" in refused(tmp_path / "new", few)


def test_a_site_replaces_an_older_one_and_nothing_else(few, tmp_path):
    target = tmp_path / "site"
    target.mkdir()
    write_site(few, target)
    older = everything(target)
    one = Catalog(few.records[3:])
    assert write_site(one, target).pages == 1
    assert everything(target).keys() < older.keys()
    assert [file.name for file in tmp_path.iterdir()] == ["site"]
    (target / "notes.txt").write_text("mine")
    assert "notes.txt" in refused(target, few)


def test_a_build_that_was_broken_off_goes_on_and_gives_the_same_bytes(few, tmp_path, monkeypatch):
    done = write_site(few, tmp_path / "whole")
    assert (done.now, done.pages) == (3, 3)
    write, count = write_pages, []

    def breaks(folder, parts):
        count.append(1)
        if len(count) == 2:
            raise KeyboardInterrupt
        return write(folder, parts)

    monkeypatch.setattr(build, "write_pages", breaks)
    with pytest.raises(KeyboardInterrupt):
        write_site(few, tmp_path / "site")
    assert not (tmp_path / "site").exists()
    again = write_site(few, tmp_path / "site")
    assert (again.now, again.pages) == (2, 3)
    assert everything(tmp_path / "site") == everything(tmp_path / "whole")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["site", "whole"]


def test_a_full_disk_stops_the_build_and_keeps_the_older_site(few, tmp_path, monkeypatch):
    target = tmp_path / "site"
    write_site(Catalog(few.records[3:]), target)
    before = everything(target)
    full = OSError(errno.ENOSPC, "No space left on device", "page.html")
    for place in (
        "hrsynth.catalog.site.pages._write",
        "hrsynth.catalog.site.index.write",
        "hrsynth.catalog.site.folder._prepare",
    ):
        with monkeypatch.context() as patched:
            patched.setattr(place, lambda *_: (_ for _ in ()).throw(full))
            with pytest.raises(BuildInterruption, match="No space left") as caught:
                write_site(few, target)
        assert caught.value.exit_status == 3
        assert "\n" not in str(caught.value)
        assert everything(target) == before
    write_site(few, target)
    assert len(list((target / "p").iterdir())) == 3


def test_one_build_at_a_time(few, tmp_path):
    with folder.open_draft(tmp_path / "site", {"site": "other"}), pytest.raises(BadRequest, match="another build"):
        write_site(few, tmp_path / "site")
    assert (tmp_path / "site" / "site.json").is_file()


@pytest.mark.slow
@pytest.mark.skipif(WORKERS == 1, reason="joblib is not installed")
def test_two_workers_give_the_same_bytes(few, tmp_path):
    told = []
    write_site(few, tmp_path / "one")
    write_site(few, tmp_path / "two", workers=2, tell=lambda *each: told.append(each))
    assert everything(tmp_path / "one") == everything(tmp_path / "two")
    assert (told[0], told[-1]) == (("pages", 0, 3), ("pages", 3, 3))


def test_on_the_command_line(few, tmp_path, capsys, monkeypatch):
    monkeypatch.delenv("HRSYNTH_DEBUG", raising=False)
    kept = tmp_path / "kept"
    kept.mkdir()
    lines = sorted(map(format_line, few), key=lambda text: json.loads(text)["key"])
    head = json.dumps({"format": 2, "catalog": 1, "group": "none", "count": len(lines)})
    (kept / "none.jsonl").write_text("\n".join([head, *lines]) + "\n")
    common = ["catalog", "site", "--catalog", str(kept)]
    assert run_command([*common, "-o", str(tmp_path / "site"), "--legs", "2", "--json"]) == 0
    out, err = capsys.readouterr()
    said = json.loads(out)
    assert (said["command"], said["architectures"], said["pages"], err) == ("catalog site", 1, 1, "")
    assert Path(said["index"]).is_file()
    assert run_command([*common, "-o", str(tmp_path / "site"), "--legs", "2"]) == 0
    assert str(tmp_path / "site" / "index.html") in capsys.readouterr().out
    for arguments in (["-o", str(tmp_path / "kept")], ["-o", str(tmp_path / "site"), "--dof", "17"]):
        assert run_command([*common, *arguments]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert re.fullmatch(r"hrsynth: [^\n]+\n", err)
