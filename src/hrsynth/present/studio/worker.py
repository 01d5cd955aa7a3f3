"""Worker processes: one loads all modules and forks on request; each of its children serves a tab.

Both sides of a channel write frames: four bytes, the length of what follows. The first frame names the folders that a
child may read; then each frame is a request of the page, and its answer, in order. A child whose channel is closed at
the other end is killed with all that it started, whatever it is doing; so are all of them where the first process's own
channel is closed: none outlives the server, however that ends.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import resource
import select
import signal
import socket
import struct
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from ...characters import name_steering, restore_steering
from ...errors import HrsynthError
from ...tolerances import LARGEST_ANSWER

WORKER_BYTES = 4 * 1024**3
"""Address space of such a process (bytes)."""

FRAME = struct.Struct("!I")
READY = b"{}"
"""First message of a child."""
SMALL = "rrrrr_m1"
"""Robot with short analyses."""
WARMING, WARMING_PAUSE = ("watch", "open"), 3000
"""Analyses whose modules are loaded before there is a child: the last one at once, the others after this time (ms)
without a child."""


def start_children(control: socket.socket, desk: Callable[..., Any]) -> None:
    """Fork a child for each channel that comes, until ``control`` is closed at the other end."""
    children: dict[int, socket.socket] = {}
    woken, waker = socket.socketpair()
    for each in (woken, waker):
        each.setblocking(False)
    signal.set_wakeup_fd(waker.fileno(), warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    warming = [*WARMING]
    _load_answerers(desk, warming.pop())
    while True:
        poll = select.poll()
        for each in (control, woken):
            poll.register(each, select.POLLIN)
        left = {channel.fileno(): pid for pid, channel in children.items()}
        for number in left:
            poll.register(number, 0)  # reports only that the other end is closed
        events = {number for number, _ in poll.poll(WARMING_PAUSE if warming else None)}
        if not events:
            _load_answerers(desk, warming.pop())
        for number in events & left.keys():
            _kill(left[number])
        if woken.fileno() in events:
            with contextlib.suppress(BlockingIOError):
                woken.recv(4096)
        for pid in [*children]:
            if os.waitpid(pid, os.WNOHANG)[0]:
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.killpg(pid, signal.SIGKILL)  # what it started, where that is left
                children.pop(pid).close()
        if control.fileno() in events:
            mark, numbers, _, _ = socket.recv_fds(control, 1, 1)
            if not mark:
                for pid in children:
                    _kill(pid)
                return
            for number in numbers:
                _start_child(socket.socket(fileno=number), children, [control, woken, waker], desk)


def _load_answerers(desk: Callable[..., Any], kind: str) -> None:
    """Run an analysis, so that all its modules are loaded once, here."""
    with contextlib.suppress(Exception):
        desk(None, None, None).answer({"n": 0, "ask": kind, "robot": {"source": "shipped:" + SMALL}})
    gc.freeze()


def _start_child(
    channel: socket.socket, children: dict[int, socket.socket], others: list[socket.socket], desk: Callable[..., Any]
) -> None:
    """A child at a channel; where no process is to be had the other end sees the channel closed."""
    try:
        pid = os.fork()
    except OSError:
        channel.close()
        return
    if pid == 0:
        _serve_child(channel, [*others, *children.values()], desk)
    children[pid] = channel
    with contextlib.suppress(OSError):  # it may have done so itself
        os.setpgid(pid, pid)


def _kill(pid: int) -> None:
    """End a child that was not waited for yet, with its process group."""
    for end in (os.killpg, os.kill):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            end(pid, signal.SIGKILL)


def _serve_child(channel: socket.socket, others: list[socket.socket], desk: Callable[..., Any]) -> None:
    """Serve a channel as a child, then exit."""
    status = 1
    try:
        os.setpgid(0, 0)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for each in others:
            each.close()
        for limit, amount in ((resource.RLIMIT_AS, WORKER_BYTES), (resource.RLIMIT_CORE, 0)):
            with contextlib.suppress(ValueError, OSError):  # less is allowed already, or the system has no such limit
                resource.setrlimit(limit, (amount, amount))
        answer_all(channel, desk)
        status = 0
    finally:
        os._exit(status)


def answer_all(channel: socket.socket, desk: Callable[..., Any]) -> None:
    """Answer what comes until there is no more."""
    with channel.makefile("rwb") as stream:
        setup = json.loads(_read(stream) or b"{}")
        folder, uploads = (None if setup[each] is None else Path(setup[each]) for each in ("folder", "uploads"))
        found = desk(folder, uploads, setup["given"])
        place = b"" if uploads is None else f"{uploads.resolve()}/".encode()  # what was dropped in is named alone
        _write(stream, READY)
        while asked := _read(stream):
            _write(stream, answer_message(found, json.loads(restore_steering(asked.decode()))).replace(place, b""))


def answer_message(desk: Any, asked: dict[str, Any]) -> bytes:
    """Return the message to the page: the answer, or the error as on the command line."""
    reply: dict[str, Any] = {"n": asked["n"]}
    try:
        told = _encode({**reply, "answer": desk.answer(asked)})
        if len(told) <= LARGEST_ANSWER:
            return told
        reply |= describe_failure(f"the answer has {len(told)} bytes, at most {LARGEST_ANSWER} are sent", "TooLarge")
    except HrsynthError as error:
        reply |= describe_failure("\n".join(error.lines()), type(error).__name__)
    except (MemoryError, RecursionError) as error:
        reply |= describe_failure(
            f"the analysis needs more memory than the limit ({WORKER_BYTES >> 30} GB)", type(error).__name__
        )
    except Exception as error:
        if os.environ.get("HRSYNTH_DEBUG"):
            traceback.print_exc()
        what = " ".join(f"{type(error).__name__}: {error}".split())
        reply |= describe_failure(f"a defect of hrsynth itself, please report it: {what}", "Defect")
    return _encode(reply)


def _encode(message: dict[str, Any]) -> bytes:
    return name_steering(json.dumps(message, ensure_ascii=False, allow_nan=False)).encode()


def describe_failure(error: str, kind: str) -> dict[str, str]:
    """Return the fields of a message without an answer."""
    return {"error": error, "kind": kind}


def _read(stream: Any) -> bytes:
    head = stream.read(FRAME.size)
    return stream.read(FRAME.unpack(head)[0]) if len(head) == FRAME.size else b""


def _write(stream: Any, text: bytes) -> None:
    stream.write(FRAME.pack(len(text)) + text)
    stream.flush()


def main(control: int, desk: str) -> None:
    """The first process; ``desk`` is where the class that answers is, as ``package.module:Class``."""
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    gc.set_threshold(50_000)
    module, _, name = desk.partition(":")
    answers = getattr(import_module(module), name)
    start_children(socket.socket(fileno=control), answers)
    os._exit(0)  # no need to take all these modules down
