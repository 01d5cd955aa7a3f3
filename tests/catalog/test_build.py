"""Builds: the same bytes whoever builds, in whatever order, however often killed; nothing lost that was built."""

from __future__ import annotations

import contextlib
import errno
import gzip
import os
import random
import signal
import subprocess
import sys
import time
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catalog.stub import REFUSED, broken, died, entry, source, without_checksum
from hrsynth.catalog import load
from hrsynth.catalog.build import build, check, list_architectures
from hrsynth.catalog.journal import Journal
from hrsynth.catalog.jsonl import decode_lines, encode_lines, format_line
from hrsynth.catalog.store import store
from hrsynth.description.files import add_checksum
from hrsynth.errors import BadRequest, BuildInterruption, HrsynthError

TESTS = Path(__file__).resolve().parent.parent


def content(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The bytes of a build that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    build(folder, source=source())
    return content(folder)


def started(target: Path, delay: float, workers: int = 1) -> subprocess.Popen[bytes]:
    found = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": found, "STUB_DELAY": str(delay)}
    command = [sys.executable, "-m", "catalog.stub", str(target), str(workers)]
    return subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL, start_new_session=True)


def lines_in(journals: list[Path]) -> int:
    return sum(file.read_bytes().count(b"\n") for file in journals if file.exists())


def members(group: int) -> list[str]:
    """The processes of a process group that still run."""
    listing = subprocess.run(["ps", "-A", "-o", "pgid=,stat=,pid="], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in listing.splitlines()]
    return [pid for found, state, pid in rows if int(found) == group and not state.startswith("Z")]


def killed_after(
    process: subprocess.Popen[bytes], folder: Path, records: int, kill: Callable[[], None] | None = None
) -> None:
    """Kill a build (and what it started) when its journals have grown by so many lines."""
    end = time.monotonic() + 60
    before = lines_in(list(folder.glob("*.part")))
    while process.poll() is None and time.monotonic() < end:
        if lines_in(list(folder.glob("*.part"))) >= before + records:
            break
        time.sleep(0.002)
    (kill or (lambda: os.killpg(process.pid, signal.SIGKILL)))()
    process.wait()


def test_a_group_is_one_file_sorted_compact_and_ascii(whole: dict[str, bytes]):
    assert list(whole) == ["c.jsonl", "d.jsonl"]
    for group, data in zip("cd", whole.values(), strict=True):
        head, *lines = data.decode("ascii").splitlines()
        crc = zlib.crc32(data.partition(b"\n")[2])
        assert head == f'{{"format":2,"catalog":1,"group":"{group}","count":{len(lines)},"crc32":"{crc:08x}"}}'
        assert lines == [
            format_line({**entry_or_refused(word), "key": word, "group": group})
            for word in sorted(source().groups[group]())
        ]
        assert b"null" not in data


def entry_or_refused(word: str) -> dict:
    try:
        return entry(word)
    except HrsynthError:
        return {"refused": f"{REFUSED}: refused on two lines"}


def test_what_a_build_says_is_what_it_did(tmp_path: Path):
    told: list[tuple[str, int, int]] = []
    done = build(tmp_path / "new", ["d"], source=source(), tell=lambda *step: told.append(step))
    assert [each.to_dict() for each in done] == [
        {"group": "d", "keys": 18, "now": 18, "before": 0, "file": str(tmp_path / "new" / "d.jsonl")}
    ]
    assert told == [("d", i, 18) for i in range(19)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_build_killed_again_and_again_gives_the_same_bytes(seed: int, tmp_path: Path, whole: dict[str, bytes]):
    draw, kills = random.Random(seed), 0
    for _ in range(4):
        process = started(tmp_path, delay=0.02)
        killed_after(process, tmp_path, draw.randint(1, 9))
        kills += process.returncode == -signal.SIGKILL
    assert kills == 4
    left = lines_in(list(tmp_path.glob("*.part"))) + sum(data.count(b"\n") for data in content(tmp_path).values())
    assert left > 8
    build(tmp_path, source=source())
    assert content(tmp_path) == whole


@pytest.mark.parametrize("moment", ["writing", "all written", "one journal gone"])
def test_a_kill_while_groups_are_finished_loses_nothing(
    moment: str, tmp_path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
):
    """The states that a kill can leave there, set up one by one."""
    removed = Journal.remove
    monkeypatch.setattr(Journal, "remove", lambda journal: None)
    build(tmp_path, source=source())
    monkeypatch.setattr(Journal, "remove", removed)
    assert sorted(content(tmp_path)) == ["c.jsonl", "c.jsonl.part", "d.jsonl", "d.jsonl.part"]
    if moment == "writing":
        (tmp_path / "d.jsonl").rename(tmp_path / ".d.jsonl.4711.tmp")
    if moment == "one journal gone":
        (tmp_path / "c.jsonl.part").unlink()
    done = build(tmp_path, source=source())
    assert [each.now for each in done] == [24 if moment == "one journal gone" else 0, 0]
    assert content(tmp_path) == whole


def test_records_in_the_journal_are_not_made_again(tmp_path: Path):
    made: list[str] = []

    def counted(word: str) -> dict:
        made.append(word)
        return entry(word)

    noted = replace(source(), entry=counted)
    limits = [5, 0, 20, 30]
    done = [build(tmp_path, source=noted, limit=limit) for limit in limits]
    assert [sum(each.now for each in groups) for groups in done] == [5, 0, 20, 17]
    assert len(made) == len(set(made)) == 42
    assert done[2][0].file is not None
    assert done[2][1].file is None


@settings(max_examples=60, deadline=None)
@given(cut=st.integers(min_value=0, max_value=4000), tail=st.binary(max_size=12), broken=st.integers(0, 12))
def test_a_torn_journal_is_read_up_to_where_it_is_whole(
    cut: int, tail: bytes, broken: int, tmp_path_factory: pytest.TempPathFactory
):
    """Cut anywhere, with rubbish at the end or zeros in a line: what is whole is kept, and appended to."""
    path = tmp_path_factory.mktemp("torn") / "x.part"
    lines = [format_line({**entry(f"(w{i})"), "key": f"(w{i})", "group": "x"}) for i in range(8)]
    with Journal(path, "x") as journal:
        head = path.stat().st_size
        journal.add((f"(w{i})", text) for i, text in enumerate(lines))
    data = path.read_bytes()[: head + cut]
    if 0 < broken < len(data.splitlines()) - 1:
        parts = data.splitlines(keepends=True)
        data = b"".join([*parts[:broken], b"\0" * (len(parts[broken]) - 1) + b"\n", *parts[broken + 1 :]])
    path.write_bytes(data + tail.replace(b"\n", b" "))
    whole = [text for text in lines if f"{add_checksum(text)}\n".encode() in data]
    with Journal(path, "x") as journal:
        found = [f"(w{i})" for i, text in enumerate(lines) if text in whole]
        assert [f"(w{i})" in journal for i in range(8)] == [text in whole for text in lines]
        assert list(journal.lines(found)) == whole
        journal.add([("(new)", new := format_line({**entry("(new)"), "group": "x"}))])
    with Journal(path, "x") as journal:
        assert len(journal) == len(whole) + 1
        assert list(journal.lines(["(new)"])) == [new]


def test_a_record_is_on_the_disk_before_the_next_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    safe: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda file: safe.append(os.fstat(file).st_size))
    sizes: list[int] = []
    with Journal(tmp_path / "x.part", "x") as journal:
        for word in source().groups["c"]():
            journal.add([(word, format_line({"key": word, "group": "x"}))])
            sizes.append((tmp_path / "x.part").stat().st_size)
    assert safe[1:] == sizes == sorted(set(sizes))


def test_a_journal_of_something_else_is_refused(tmp_path: Path):
    path = tmp_path / "c.jsonl.part"
    for text, said in [
        ("a list\nof words\n", "journal without checksums"),
        ('{"format":2,"catalog":1,"group":"c"}\n', "journal without checksums .* Remove the file or use --anew"),
        (add_checksum("keys") + "\n", "not a head"),
        (add_checksum('{"format":2,"catalog":99}') + "\n", "another version"),
    ]:
        path.write_text(text)
        with pytest.raises(BadRequest, match=said):
            build(tmp_path, ["c"], source=source())
        assert path.read_text() == text
    build(tmp_path, ["c"], source=source(), anew=True)
    assert len(load(tmp_path)) == 24


@settings(max_examples=30, deadline=None)
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_bit_that_flips_in_a_journal_is_found(
    place: float, bit: int, whole: dict[str, bytes], tmp_path_factory: pytest.TempPathFactory
):
    """Its record is made again; in the first line the journal is refused."""
    folder = tmp_path_factory.mktemp("flipped")
    build(folder, ["c"], source=source(), limit=10)
    path = folder / "c.jsonl.part"
    data = bytearray(path.read_bytes())
    data[at := int(place * len(data))] ^= 1 << bit
    path.write_bytes(data)
    if at <= bytes(data).index(b"\n"):
        with pytest.raises(BadRequest):
            build(folder, ["c"], source=source())
    else:
        (done,) = build(folder, ["c"], source=source())
        assert done.now > 14
        assert content(folder) == {"c.jsonl": whole["c.jsonl"]}


@settings(max_examples=100, deadline=None)
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7), packed=st.booleans())
def test_a_bit_that_flips_in_a_finished_file_is_found(
    place: float, bit: int, packed: bool, whole: dict[str, bytes], tmp_path_factory: pytest.TempPathFactory
):
    """Either the file is refused or its lines are what they were, as after a change of the time in gzip's head."""
    data = whole["c.jsonl"]
    lines = decode_lines(data, "c")
    data = bytearray(gzip.compress(encode_lines("c", lines, checksum=False), mtime=0) if packed else data)
    data[int(place * len(data))] ^= 1 << bit
    folder = tmp_path_factory.mktemp("flipped")
    (folder / ("c.jsonl.gz" if packed else "c.jsonl")).write_bytes(data)
    with contextlib.suppress(BadRequest):
        assert store(folder).lines(["c"], {}) == lines


def test_one_build_at_a_time(tmp_path: Path):
    with Journal(tmp_path / "c.jsonl.part", "c"), pytest.raises(BadRequest, match="another build"):
        build(tmp_path, ["c"], source=source())


@pytest.mark.parametrize("workers", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_any_number_of_workers_gives_the_same_bytes(workers: int, tmp_path: Path, whole: dict[str, bytes]):
    pytest.importorskip("joblib")
    build(tmp_path, source=source(), workers=workers)
    assert content(tmp_path) == whole


@pytest.mark.slow
def test_a_build_with_workers_is_killed_and_goes_on(tmp_path: Path, whole: dict[str, bytes]):
    """Its workers end with it."""
    pytest.importorskip("joblib")
    process = started(tmp_path, delay=0.1, workers=2)
    killed_after(process, tmp_path, 10, lambda: os.kill(process.pid, signal.SIGKILL))
    assert process.returncode == -signal.SIGKILL
    end = time.monotonic() + 60
    while (left := members(process.pid)) and time.monotonic() < end:
        time.sleep(0.1)
    assert left == []
    build(tmp_path, source=source(), workers=2)
    assert content(tmp_path) == whole


def test_kin_are_made_in_one_process():
    chunks = list(source().chunks(source().groups["c"](), 5))
    assert sorted(word for chunk in chunks for word in chunk) == sorted(source().groups["c"]())
    assert all(len(chunk) == 6 for chunk in chunks)
    homes = {word.replace("*", ""): i for i, chunk in enumerate(chunks) for word in chunk}
    assert all(homes[word.replace("*", "")] == i for i, chunk in enumerate(chunks) for word in chunk)


def test_a_worker_that_dies_stops_the_build_in_one_line(tmp_path: Path, whole: dict[str, bytes]):
    pytest.importorskip("joblib")
    with pytest.raises(BuildInterruption, match=r"a worker process died; finished work is kept in .*d\.jsonl\.part"):
        build(tmp_path, source=replace(source(), entry=died), workers=2)
    assert (tmp_path / "c.jsonl").read_bytes() == whole["c.jsonl"]
    (first, _) = build(tmp_path, source=source())
    assert (first.now, first.before) == (0, 24)
    assert content(tmp_path) == whole


@pytest.mark.some(1)
@pytest.mark.parametrize("workers", [1, 2])
def test_a_defect_names_its_word_and_loses_nothing(workers: int, tmp_path: Path):
    if workers > 1:
        pytest.importorskip("joblib")
    with pytest.raises(
        BuildInterruption, match=r"\(c05\): internal error: IndexError: list index.*; finished work is kept in"
    ):
        build(tmp_path, source=replace(source(), entry=broken), workers=workers)
    assert (tmp_path / "c.jsonl.part").exists()


@pytest.mark.parametrize("room", [10, 700, 3000])
def test_a_full_disk_stops_the_build_and_keeps_the_journal(
    room: int, tmp_path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
):
    """Only so many bytes can be written, the last write being cut short."""
    left, write = [room], os.write

    def full(file: int, data: bytes) -> int:
        if left[0] == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        done = write(file, data[: left[0]])
        left[0] -= done
        return done

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(BuildInterruption, match="No space left on device") as stopped:
        build(tmp_path, source=source())
    assert stopped.value.exit_status == 3
    assert len(stopped.value.lines()) == 1
    monkeypatch.undo()
    journal = tmp_path / "c.jsonl.part"
    kept = journal.read_bytes()
    assert len(kept) <= room
    assert kept == b"" or kept.endswith(b"\n")
    (done, _) = build(tmp_path, source=source())
    assert done.before == max(0, kept.count(b"\n") - 1)
    assert content(tmp_path) == whole


@pytest.mark.parametrize("name", ["folder", "big.sqlite"])
def test_a_disk_full_at_the_end_keeps_the_journal(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(BuildInterruption, match=r"No space left on device; finished work is kept in .*\.part"):
        build(tmp_path / name, ["d"], source=source())
    monkeypatch.undo()
    assert not list(tmp_path.rglob("*.tmp"))
    (done,) = build(tmp_path / name, ["d"], source=source())
    assert (done.now, done.before) == (0, 18)


@pytest.mark.parametrize(
    ("target", "groups", "said"),
    [("there", ["nothing"], "unknown group"), ("no/such/folder", [], "cannot write"), ("file", [], "cannot write")],
)
def test_bad_requests_are_one_line_before_any_work(target: str, groups: list[str], said: str, tmp_path: Path):
    (tmp_path / "file").write_text("a file")
    with pytest.raises(BadRequest, match=said) as refused:
        build(tmp_path / target, groups, source=source())
    assert len(refused.value.lines()) == 1
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_files_round_trip_and_cut_off_ones_are_refused(whole: dict[str, bytes]):
    data = whole["c.jsonl"]
    lines = decode_lines(data, "c")
    assert encode_lines("c", random.Random(3).sample(lines, len(lines))) == data
    for cut in range(0, len(data), 37):
        with pytest.raises(BadRequest):
            decode_lines(data[:cut], "c")
    with pytest.raises(BadRequest, match=r"another version: got 'format 2, keys 9', expected .*Build it again"):
        decode_lines(data.replace(b'"catalog":1', b'"catalog":9', 1), "c")


def test_a_large_group_is_packed_and_holds_the_same(
    tmp_path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
):
    """The same lines, whichever of the two files a group had before; a file that is cut off is refused."""
    monkeypatch.setattr("hrsynth.catalog.store.UNCOMPRESSED_ENTRIES_MAX", 20)
    build(tmp_path, source=source())
    assert sorted(content(tmp_path)) == ["c.jsonl.gz", "d.jsonl"]
    packed = gzip.decompress((tmp_path / "c.jsonl.gz").read_bytes())
    assert packed.decode() == without_checksum(whole["c.jsonl"].decode())
    kept = store(tmp_path)
    assert kept.groups() == ["c", "d"]
    assert kept.lines(["c"], {}) == decode_lines(whole["c.jsonl"], "c")
    assert check(tmp_path, source=source()) == ()
    monkeypatch.setattr("hrsynth.catalog.store.UNCOMPRESSED_ENTRIES_MAX", 1000)
    build(tmp_path, source=source())
    assert content(tmp_path) == whole
    packed = gzip.compress(whole["c.jsonl"], mtime=0)
    for cut in (0, 1, 9, len(packed) // 2, len(packed) - 1):
        (tmp_path / "c.jsonl.gz").write_bytes(packed[:cut])
        with pytest.raises(BadRequest):
            kept.lines(["c"], {})


@pytest.mark.long
@pytest.mark.parametrize("words_each", [2, 4])
def test_the_catalog_itself_has_the_same_bytes_from_two_workers(words_each: int, tmp_path: Path):
    """A few words of every group: that they are made here or elsewhere, alone or after others, changes nothing."""
    pytest.importorskip("joblib")
    every = list_architectures()
    few = {group: random.Random(5).sample(every.words(group), words_each) for group in every.groups}
    some = replace(every, groups={group: few[group].copy for group in few})
    build(tmp_path / "one", source=some)
    build(tmp_path / "two", source=some, workers=2)
    assert content(tmp_path / "one") == content(tmp_path / "two")
    assert all(record["group"] in few for record in load(tmp_path / "one"))
    for group, words in few.items():
        (first, *_) = load(tmp_path / "one", group=group)
        assert format_line(first) == format_line({**every.entry(min(words)), "group": group})
