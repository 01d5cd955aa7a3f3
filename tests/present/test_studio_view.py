"""A view through the server, with the processes that answer: any coordinates together, loops closed; what is uploaded
cannot harm."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hrsynth.mechanism import JointType
from hrsynth.present.view.view import View, view
from patience import allow
from present.studio_client import Page, opened, posted, status_of
from present.views import miss, moved, seen, serving
from strategies import planar

pytest.importorskip("uvicorn")
pytestmark = pytest.mark.slow

FIVE_BAR = "rrrrr_m1"


def told(page: Page, kind: str, **fields: Any) -> dict[str, Any]:
    """An answer about the robot of the view, watched as the page was told."""
    start = page.start
    answer = page.ask(kind, **{"robot": start["start"], "watch": start["watch"], "camera": start["camera"], **fields})
    assert "answer" in answer, answer
    return answer["answer"]


def law_closed(found: View, state: dict) -> None:
    mechanism = found.setup.mechanism
    places = dict(zip(mechanism.links, np.array(state["real"]), strict=True))
    assert (
        max(
            miss(joint, *(places[link] for link in joint.links))
            for joint in mechanism.joints.values()
            if joint.type is not JointType.FREE
        )
        < 1e-6
    )


@pytest.mark.parametrize("name", [FIVE_BAR, "quattro"])
def test_several_coordinates_at_once_with_closed_loops(name: str):
    found = seen(name)
    mechanism = found.setup.mechanism
    with serving(found) as server, opened(server) as page:
        assert (page.start["panels"], page.start["hidden"]) == (False, True)
        scene = told(page, "open")
        home = np.array([slider["home"] for slider in scene["sliders"]])
        assert len(home) == len(found.sliders)
        wanted = home + [0.1 * (slider["max"] - slider["min"]) for slider in scene["sliders"]]
        reply = told(page, "move", values=wanted.tolist(), here=scene["here"], hidden=True)
        assert not reply["stopped"]
        assert reply["residual"] < 1e-9
        law_closed(found, reply["state"])
        place = np.array(reply["state"]["real"][list(mechanism.links).index(mechanism.platform)])
        point = moved(place, mechanism.links[mechanism.platform].pose[:3, 3])
        for slider, value in zip(scene["sliders"], wanted, strict=True):
            if slider["name"] in "xyz":
                assert point["xyz".index(slider["name"])] == pytest.approx(value, abs=1e-6)
        assert reply["state"]["hidden"]
        beyond = told(page, "move", values=[5.0] * len(home), here=reply["here"])
        assert beyond["stopped"]
        law_closed(found, beyond["state"])
        back = told(page, "move", values=None, here=None)
        assert np.array(back["state"]["real"]) == pytest.approx(found.home.places["real"], abs=1e-6)
        assert "file" not in str(page.start)


def test_a_robot_of_no_file_is_served_and_turns_by_the_angle_that_its_slider_shows():
    found = view(planar(["RPR"] * 3, np.random.default_rng(1), [{1}] * 3))
    link = list(found.setup.mechanism.links).index(found.setup.mechanism.platform)
    normal = found.setup.motion.normal
    with serving(found) as server, opened(server) as page:
        scene = told(page, "open")
        slider = scene["sliders"][2]
        assert (slider["name"], slider["unit"]) == ("phi", "rad")
        home, here = [each["home"] for each in scene["sliders"]], scene["here"]
        for value in (0.4, -0.3, 0.4 - 2 * np.pi):
            reply = told(page, "move", values=[*home[:2], value], here=here)
            assert not reply["stopped"]
            x, y, z, w = reply["state"]["real"][link][3:]
            turn = 2 * np.arctan2([x, y, z] @ normal, w) - value
            assert (turn + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0, abs=1e-5)
    assert not Path(server.folder.name).exists()


LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "'
    + "ha" * 500
    + '">'
    + "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True))
    + ']><robot name="x"><link name="&j;"/></robot>'
)
BOMBS = {
    "laughs.urdf": LAUGHS,
    "laughs.xml": LAUGHS.replace("robot", "mujoco"),
    "outside.urdf": '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    '<robot name="&x;"><link name="a"/></robot>',
    "deep.urdf": '<robot name="x">' + "<a>" * 200_000 + "</a>" * 200_000 + "</robot>",
    "many.urdf": '<robot name="x">' + '<link name="a"/>' * 400_000 + "</robot>",
    "laughs.yaml": "a: &a [x,x,x,x,x,x,x,x,x]\n"
    + "".join(f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "xacro.xacro": '<robot xmlns:xacro="http://ros.org/wiki/xacro" name="x">'
    '<xacro:include filename="/etc/passwd"/>'
    "<link name=\"${open('/etc/passwd').read()}\"/></robot>",
}


def test_bombs_in_robot_files_are_refused_in_lines_and_cost_nothing():
    """Nor does a file lead to others: of the machine, of another tab."""
    from hrsynth import studio

    server = studio(open_=False)
    try:
        with opened(server) as page, opened(server) as other:
            for name, text in BOMBS.items():
                assert status_of(posted(server, page.start["tab"], name, text.encode())) == 200
                begin = time.monotonic()
                answer = page.ask("open", robot={"source": f"file:{name}", "options": {}}, watch=None, camera=None)
                assert time.monotonic() - begin < allow(20), name
                assert set(answer) == {"n", "error", "kind"} or answer["answer"]["failed"], name
                assert answer.get("kind") not in ("Defect", "Ended", "TooSlow"), (name, answer)
                assert "root:" not in str(answer)
                assert all(len(line) < 1000 for line in str(answer.get("error", "")).splitlines())
            os.symlink("/etc", Path(server.folder.name, page.start["tab"], "link"))
            for source in (
                "file:../x",
                "file:/etc/passwd",
                "file:link/passwd",
                "folder:x",
                "file:",
                "file:laughs.urdf",
                f"file:../{page.start['tab']}/laughs.urdf",
                "/etc/passwd",
                "given",
            ):
                asked = other if "laughs" in source else page
                answer = asked.ask("open", robot={"source": source, "options": {}}, watch=None, camera=None)
                assert answer["kind"] == "BadRequest", (source, answer)
                assert "\n" not in answer["error"]
    finally:
        server.stop()
