"""Formations of bodies: verdicts, trivial motions and flexes against bearing rigidity matrices in plain NumPy.

The matrices are those of the field: the common frame of R^d (Zhao and Zelazo, IEEE Trans. Automatic Control 61 (2016),
the bearing rigidity matrix and its rank dn - d - 1), SE(2) (Zelazo, Robuffo Giordano and Franchi, CDC 2015), R^3 x S^1
(Schiano, Franchi, Zelazo and Robuffo Giordano, IROS 2016), SE(3) (Michieletto, Cenedese and Franchi, CDC 2016): of
beta_ij = R_i^T (p_j - p_i)/d_ij the derivative is R_i^T (P_ij (v_j - v_i)/d_ij + [b_ij]x omega_i).
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, permutations
from pathlib import Path

import numpy as np
import pytest

from hrsynth.analysis.check import check
from hrsynth.analysis.controllability import _find_smallest_sets, legs
from hrsynth.analysis.derive import Derivation, derive
from hrsynth.analysis.pose_requests import observe
from hrsynth.analysis.singularity.singularities import singularities
from hrsynth.certificates import certificate, verify
from hrsynth.description import load, native, save
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.families.formations import MOVES, build_formation
from hrsynth.geometry.vectors import Array, build_pose
from hrsynth.mechanism.cameras import NamedCamera
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.observations.point import ImagePoint
from hrsynth.present.show import text
from hrsynth.present.text.sentences import describe_seen
from hrsynth.present.text.tables import LINE, format_head_rows
from strategies import random_rotation

Pairs = Sequence[tuple[int, int]]


def hat(w: Array) -> Array:
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def rigidity_matrix(places: Array, frame: Array, bodies: str, bearings: Pairs, distances: Pairs = ()) -> Array:
    """Rates of all bearings (in axes that do not turn: the same rank) and distances by the bodies' velocities."""
    slides = frame[:, : 2 if "plane" in bodies else 3]
    spins = np.eye(3) if bodies == "free" else frame[:, 2:] if bodies in ("yaw", "plane") else np.zeros((3, 0))
    width = slides.shape[1] + spins.shape[1]
    rows = []
    for number, (i, j) in enumerate([*bearings, *distances]):
        arm = places[j - 1] - places[i - 1]
        d = np.linalg.norm(arm)
        b = arm / d
        row = np.zeros((3 if number < len(bearings) else 1, width * len(places)))
        by_place = (np.eye(3) - np.outer(b, b)) / d if number < len(bearings) else b[None]
        for body, sign in ((i, -1), (j, 1)):
            at = width * (body - 1)
            row[:, at : at + slides.shape[1]] = sign * by_place @ slides
        if number < len(bearings):
            at = width * (i - 1) + slides.shape[1]
            row[:, at : at + spins.shape[1]] = hat(b) @ spins
        rows.append(row)
    return np.vstack(rows)


def rank(matrix: Array) -> int:
    return int(np.linalg.matrix_rank(matrix, tol=1e-8))


def drawn(n: int, bodies: str, bearings: Pairs, distances: Pairs = (), seed: int = 0) -> tuple[Mechanism, Array, Array]:
    """A random formation in a tilted common frame."""
    rng = np.random.default_rng(seed)
    frame = random_rotation(rng)
    places = rng.normal(size=(n, 3))
    if "plane" in bodies:
        places[:, 2] = 0.3
    places = places @ frame.T
    turns = [random_rotation(rng) for _ in range(n)]
    made = build_formation(places, bearings, distances, bodies=bodies, turns=turns, frame=frame)
    return made, places, frame


TRIVIAL = {"free": 7, "yaw": 5, "position": 4, "plane": 4, "plane position": 3}
"""Translations and scale; the common turn where bodies turn: d + 1 and the turns."""
FREEDOMS = {"free": 6, "yaw": 4, "position": 3, "plane": 3, "plane position": 2}


@cache
def complete(bodies: str, n: int) -> Derivation:
    return derive(drawn(n, bodies, list(permutations(range(1, n + 1), 2)), seed=n)[0])


@pytest.mark.some(1, 4)
@pytest.mark.parametrize("n", [3, pytest.param(4, marks=pytest.mark.slow), pytest.param(5, marks=pytest.mark.slow)])
@pytest.mark.parametrize("bodies", sorted(MOVES))
def test_generic_ranks_of_complete_formations_are_those_of_the_literature(bodies: str, n: int):
    """All see all: rank fn - t, with f freedoms of a body and t trivial motions; SE(3): 6n - 7, R^3 x S^1: 4n - 5,
    common frame: dn - d - 1."""
    found = complete(bodies, n)
    freedoms, trivial = FREEDOMS[bodies], TRIVIAL[bodies]
    _made, places, frame = drawn(n, bodies, list(permutations(range(1, n + 1), 2)), seed=n)
    pairs = list(permutations(range(1, n + 1), 2))
    assert rank(rigidity_matrix(places, frame, bodies, pairs)) == freedoms * n - trivial
    assert (found.verdict.dof, found.verdict.rank) == (freedoms * n, freedoms * n - trivial)
    assert found.verdict.verdict == "rigid"
    assert found.verdict.formation is not None
    assert len(found.verdict.formation.trivial) == trivial
    assert not found.verdict.formation.flexes
    assert found.equivalence.passed
    assert (found.exact.verdict, found.exact.rank, found.exact.trivial) == ("rigid", found.verdict.rank, trivial)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("bodies", "names"),
    [
        pytest.param(
            "position",
            ["translation along x", "translation along y", "translation along z", "scale"],
            marks=pytest.mark.slow,
        ),
        (
            "yaw",
            ["translation along x", "translation along y", "translation along z", "common rotation about z", "scale"],
        ),
        ("plane", ["translation along x", "translation along y", "common rotation about z", "scale"]),
    ],
)
def test_trivial_motions_have_names(bodies: str, names: list[str]):
    rng = np.random.default_rng(1)
    places = rng.normal(size=(3, 3)) * (1, 1, 0 if bodies == "plane" else 1)
    found = derive(build_formation(places, list(permutations((1, 2, 3), 2)), bodies=bodies)).verdict.formation
    assert found is not None
    assert list(found.trivial) == names


LAMAN = [(1, 2), (1, 3), (2, 3), (2, 4), (3, 4), (3, 5), (4, 5)]
"""Two neighbours for each further body: 2n - 3 pairs, minimally rigid in the plane."""
RING = [(1, 2), (2, 3), (3, 4), (4, 5), (5, 1)]


@pytest.mark.parametrize("bodies", ["position", pytest.param("plane position", marks=pytest.mark.slow)])
def test_a_laman_graph_is_rigid_and_minimal(bodies: str):
    """Zhao et al., Laman graphs are generically bearing rigid in arbitrary dimensions (CDC 2017); in the plane none of
    their bearings can be left out."""
    made, places, frame = drawn(5, bodies, LAMAN)
    d = FREEDOMS[bodies]
    assert rank(rigidity_matrix(places, frame, bodies, LAMAN)) == 5 * d - d - 1
    found = derive(made)
    assert (found.verdict.verdict, found.verdict.rank) == ("rigid", 5 * d - d - 1)
    if d == 2:
        assert legs(made).minimal == (tuple(f"{i}-{j}" for i, j in LAMAN),)
    else:
        assert found.exact.verdict == "rigid"


def test_a_ring_of_five_has_one_flex_that_is_named():
    """Ten rows for fifteen freedoms, four trivial motions: one flex; three neighbours move while two rest."""
    made, places, frame = drawn(5, "position", RING)
    assert 15 - rank(rigidity_matrix(places, frame, "position", RING)) - 4 == 1
    found = derive(made)
    formed = found.verdict.formation
    assert formed is not None
    assert found.verdict.verdict == found.exact.verdict == "flexible"
    (flex,) = formed.flexes
    assert flex.count == 1
    assert len(flex.links) == 3
    # plain NumPy: these three move while the others rest, beyond no fewer
    matrix = rigidity_matrix(places, frame, "position", RING)
    for size, unseen in ((2, 0), (3, 1)):
        some = [set(chosen) for chosen in combinations(range(5), size)]
        free = [3 * size - rank(matrix[:, [3 * b + k for b in sorted(chosen) for k in range(3)]]) for chosen in some]
        assert max(free) == unseen
    moving = [int(link[1:]) - 1 for link in flex.links]
    assert 9 - rank(matrix[:, [3 * b + k for b in moving for k in range(3)]]) == 1
    assert "1 motion" in flex.name
    assert flex.name in describe_seen(found.verdict, found.setup.labels, found.setup)
    assert flex.name in text(found)


@pytest.mark.slow
def test_random_graphs_agree_with_the_matrix():
    """Random pairs, bearings and distances mixed, relabelled: the rank is that of the matrix; exact ranks agree."""
    rng = np.random.default_rng(4)
    for seed, bodies in enumerate(("free", "yaw", "position", "plane", "position", "free")):
        n = int(rng.integers(3, 5))
        pairs = [each for each in permutations(range(1, n + 1), 2) if rng.random() < 0.6]
        lengths = [each for each in combinations(range(1, n + 1), 2) if rng.random() < 0.4]
        order = rng.permutation(n) + 1
        pairs, lengths = ([(int(order[i - 1]), int(order[j - 1])) for i, j in each] for each in (pairs, lengths))
        made, places, frame = drawn(n, bodies, pairs, lengths, seed)
        found = derive(made)
        expected = rank(rigidity_matrix(places, frame, bodies, pairs, lengths))
        assert found.verdict.rank == expected == found.exact.rank, (bodies, pairs, lengths)
        formed = found.verdict.formation
        assert formed is not None
        flexes = sum(flex.count for flex in formed.flexes)
        assert flexes + len(formed.trivial) == found.verdict.dof - expected
        assert found.exact.trivial == len(formed.trivial)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("bearings", "distances", "compass", "trivial", "flexes"),
    [
        (
            list(permutations((1, 2, 3), 2)),
            [(1, 2)],
            True,
            4,
            0,
        ),  # a distance fixes the scale, a direction leaves one turn
        ([(1, 2), (1, 3), (2, 1), (2, 3)], [], False, 7, 3),  # the attitude of a body that is only seen
        pytest.param(list(permutations((1, 2, 3), 2)), [(1, 2)], False, 6, 0, marks=pytest.mark.slow),
        pytest.param(list(permutations((1, 2, 3), 2)), [], True, 5, 0, marks=pytest.mark.slow),
        pytest.param([], [(1, 2), (2, 3), (1, 3)], False, 6, 9, marks=pytest.mark.slow),  # points and all attitudes
    ],
)
def test_mixed_cases(bearings: Pairs, distances: Pairs, compass: bool, trivial: int, flexes: int):
    made = drawn(3, "free", bearings, distances)[0]
    if compass:
        up = Direction("up", "ground", np.array([0.0, 0.0, 1.0]), seen_from="b1")
        made = replace(made, observations=(*made.observations, up))
    found = derive(made)
    formed = found.verdict.formation
    assert formed is not None
    assert (len(formed.trivial), sum(flex.count for flex in formed.flexes)) == (trivial, flexes)
    assert found.exact.trivial == trivial
    assert found.exact.rank == found.verdict.rank


@pytest.mark.slow
def test_a_camera_of_the_ground_leaves_a_scale_about_it():
    """The first body moves along its ray, all others with it; the rest scales about the first: no similarity that keeps
    the ground's camera where it is."""
    made, _places, _frame = drawn(3, "position", list(combinations((1, 2, 3), 2)))
    eye = NamedCamera("eye", "ground", build_pose((1.0, 2.0, 3.0)))
    made = replace(
        made,
        cameras=(*made.cameras, eye),
        observations=(*made.observations, ImagePoint("eye", "b1", at=np.zeros(3), camera=eye)),
    )
    formed = derive(made).verdict.formation
    assert formed is not None
    assert formed.trivial == ("scale about (1 2 3)",)
    assert [(flex.links, flex.count) for flex in formed.flexes] == [(("b2", "b3"), 1)]


def test_distances_between_positions_leave_the_rigid_motions_of_points():
    """A tetrahedron of distances: three translations, three turns of the points, though no body turns."""
    made, places, frame = drawn(4, "position", [], list(combinations(range(1, 5), 2)))
    found = derive(made)
    assert 12 - rank(rigidity_matrix(places, frame, "position", [], list(combinations(range(1, 5), 2)))) == 6
    assert found.verdict.verdict == "rigid"
    assert found.verdict.formation is not None
    assert [name.split()[0] for name in found.verdict.formation.trivial] == ["translation"] * 3 + ["common"] * 3


@pytest.mark.parametrize("seed", range(8))
def test_the_search_for_the_smallest_sets_is_that_of_all_sets(seed: int):
    """Ranks of blocks of rows, some of them repeated, against all 255 sets."""
    rng = np.random.default_rng(seed)
    kinds = [rng.integers(-2, 3, size=(rng.integers(1, 3), 7)) for _ in range(6)]
    blocks = {str(i): kinds[k] for i, k in enumerate(rng.integers(0, 6, size=8))}

    def rank_of(chosen: tuple[str, ...]) -> int:
        return rank(np.vstack([blocks[label] for label in chosen]))

    labels, whole = tuple(blocks), rank_of(tuple(blocks))
    sets = [each for size in range(1, 9) for each in combinations(labels, size) if rank_of(each) == whole]
    assert _find_smallest_sets(labels, rank_of) == ([each for each in sets if len(each) == len(sets[0])], True)


@pytest.mark.slow
def test_ten_observations_that_are_all_needed_are_told_without_all_their_sets(page: str):
    found = legs(native.parse(page))
    labels = tuple(each.leg for each in found.setup.observed)
    assert found.minimal == (labels,)
    assert found.minimal_complete
    assert not found.complete
    assert [each.legs for each in found.sets] == [*((each,) for each in labels), labels]
    said = text(found)
    assert said.index("smallest sets") < said.index("verdict")
    assert "no other set of this size" in said


@pytest.mark.slow
def test_smallest_sets_of_bearings_are_those_of_the_matrix():
    """All sets of bearings of three bodies that yaw, against the ranks of rows."""
    pairs = list(permutations((1, 2, 3), 2))
    made, places, frame = drawn(3, "yaw", pairs)
    whole = rank(rigidity_matrix(places, frame, "yaw", pairs))
    found = legs(made)
    for each in found.sets:
        chosen = [pair for pair in pairs if f"{pair[0]}-{pair[1]}" in each.legs]
        assert each.rank == rank(rigidity_matrix(places, frame, "yaw", chosen))
    smallest = next(
        size
        for size in range(1, 7)
        if any(rank(rigidity_matrix(places, frame, "yaw", chosen)) == whole for chosen in combinations(pairs, size))
    )
    expected = {
        tuple(f"{i}-{j}" for i, j in chosen)
        for chosen in combinations(pairs, smallest)
        if rank(rigidity_matrix(places, frame, "yaw", chosen)) == whole
    }
    assert set(found.minimal) == expected


def test_a_formation_on_one_line_is_singular_and_told_so():
    """Collinear bodies in a common frame: bearings see n - 2 motions fewer, and `check` says that this is singular."""
    places = np.array([[0.0, 0, 0], [1.0, 0.2, 0.1], [2.5, 0.5, 0.25]])
    pairs = list(combinations((1, 2, 3), 2))
    lost = 5 - rank(rigidity_matrix(places, np.eye(3), "position", pairs))
    assert lost == 1
    posture = check(build_formation(places, pairs, bodies="position")).postures[0]
    assert posture.hidden.state == "type2"
    assert posture.hidden.singularity_indices is not None
    assert lost == posture.hidden.singularity_indices.RO
    assert posture.formation is not None
    assert posture.formation.verdict == "flexible"
    assert "on one line" in posture.formation.special
    assert len(posture.formation.trivial) == 4
    assert sum(flex.count for flex in posture.formation.flexes) == lost


@pytest.mark.some(2)
@pytest.mark.parametrize("ending", ["urdf", "xml", "sdf", "usda"])
@pytest.mark.parametrize("bodies", ["free", "yaw", "position"])
def test_round_trips(tmp_path, ending: str, bodies: str):
    made = drawn(3, bodies, list(permutations((1, 2, 3), 2)), [(1, 2)])[0]
    if ending == "usda":
        pytest.importorskip("pxr")
    path = tmp_path / f"formation.{ending}"
    save(made, path)
    back = load(path)
    assert back.formation
    assert back.bodies == made.bodies
    assert [(o.leg, o.link, o.seen_from) for o in back.observations] == [
        (o.leg, o.link, o.seen_from) for o in made.observations
    ]
    for link in made.links.keys() & back.links.keys():
        assert np.allclose(made.links[link].pose, back.links[link].pose, atol=1e-9)


@pytest.mark.some(1)
@pytest.mark.parametrize("bodies", ["free", "position"])
def test_the_hidden_robot_of_a_ring_is_read_again(tmp_path, bodies: str):
    """What its file says stands on the ground: it is a robot with the first body as its platform."""
    made = build_formation([(0, 0, 0), (1, 0, 0), (0.5, 0.9, 0.2)], [(1, 2), (2, 3), (3, 1)], bodies=bodies)
    hidden = derive(made).hidden
    assert hidden is not None
    save(hidden, tmp_path / "hidden.urdf")
    back = load(tmp_path / "hidden.urdf")
    assert (back.formation, back.platform) == (False, "b1")
    found = derive(back)
    assert found.equivalence.passed
    assert found.verdict.dof == FREEDOMS[bodies]


def test_a_robot_in_a_formation_and_a_fixed_base():
    """Two arms on one base and a free body: all ends are bodies; what no camera tells of is a flex."""
    found = derive(native.parse(MIXED))
    formed = found.verdict.formation
    assert formed is not None
    assert formed.bodies == ("hand", "other_hand", "drone")
    assert formed.verdict == "flexible"
    assert found.equivalence.passed
    assert any(flex.links == ("other_hand",) and flex.count == 1 for flex in formed.flexes)


MIXED = """<robot name="mixed">
  <link name="base"/> <link name="upper"/> <link name="hand"/> <link name="other_hand"/> <link name="drone"/>
  <joint name="shoulder" type="continuous"> <parent link="base"/> <child link="upper"/> <axis xyz="0 0 1"/> </joint>
  <joint name="elbow" type="continuous"> <parent link="upper"/> <child link="hand"/> <origin xyz="0.5 0 0.1"/>
    <axis xyz="0 1 0"/> </joint>
  <joint name="other" type="continuous"> <parent link="base"/> <child link="other_hand"/> <origin xyz="0 0.5 0"/>
    <axis xyz="1 0 0"/> </joint>
  <joint name="flight" type="floating"> <parent link="base"/> <child link="drone"/> <origin xyz="1 1 1"/> </joint>
  <hrsynth>
    <camera name="eye" link="hand"/>
    <camera name="sky" link="drone"/>
    <observe kind="point" camera="eye" link="drone" at="0 0 0.1"/>
    <observe kind="point" camera="sky" link="base" at="0 0 0"/>
    <observe kind="point" camera="sky" link="base" at="1 0 0"/>
    <observe kind="point" camera="sky" link="base" at="0 1 0"/>
    <observe kind="point" camera="sky" link="base" at="0.3 0.4 0.5"/>
  </hrsynth>
</robot>"""


@pytest.fixture
def page() -> str:
    """The file that docs/pages/control_a_formation.md shows."""
    path = Path(__file__).parents[2] / "docs" / "pages" / "control_a_formation.md"
    return path.read_text(encoding="utf-8").split("```xml\n")[1].split("```")[0]


def test_the_record_of_a_body_and_a_fixed_one(tmp_path):
    """Nothing that is observed is a segment, and the fixed link becomes the base: the file's own mobility is 6."""
    file = tmp_path / "two.urdf"
    file.write_text(
        '<robot name="two"> <link name="ground"/> <link name="b1"/> <link name="b2"/> '
        '<joint name="f1" type="floating"> <parent link="ground"/> <child link="b1"/> </joint> '
        '<joint name="f2" type="fixed"> <parent link="ground"/> <child link="b2"/> '
        '<origin xyz="1 2 0.4"/> </joint> <hrsynth> <camera name="c1" link="b1"/> <camera name="c2" '
        'link="b2"/> <observe kind="point" leg="p" camera="c1" link="b2" at="0 0 0"/> '
        '<observe kind="position" leg="q" camera="c2" link="b1" at="0 0 0"/> </hrsynth> </robot>'
    )
    found = derive(file).to_dict()
    assert found["mobility"]["as_written"] == {"total": 6, "internal": 0}
    assert found["rank"] == 5


def test_the_file_of_the_page_is_a_formation(page: str):
    found = native.parse(page)
    assert found.formation
    assert found.bodies == ("b1", "b2", "b3", "b4")
    assert len(found.observations) == 10
    observed = dict(format_head_rows(observe(found)))["observed"]
    assert len(observed) > 1
    assert max(map(len, observed)) <= LINE
    assert all(line.endswith(",") for line in observed[:-1])


def test_a_file_without_a_platform_must_be_a_formation():
    with pytest.raises(BadRobotFile, match="no formation"):
        native.parse(
            MIXED.replace('<observe kind="point" camera="eye" link="drone" at="0 0 0.1"/>', "").replace(
                '<camera name="eye" link="hand"/>', ""
            )
        )


def test_drones_that_observe_nothing_are_told_what_a_formation_needs(page: str):
    with pytest.raises(BadRobotFile, match="a <platform>, or <observe> between the bodies of a formation"):
        native.parse(re.sub("<observe .*?/>", "", page))


def test_poses_of_a_formation_are_refused():
    """They would be those of the first body, while all others stay where they are."""
    made = drawn(3, "position", [(1, 2), (2, 3), (1, 3)])[0]
    for asked in (
        lambda: check(made, at=["x=1"]),
        lambda: check(made, grid="x=0:1:3,y=0:1:3"),
        lambda: derive(made, at="x=1"),
        lambda: legs(made, at="x=1"),
    ):
        with pytest.raises(BadRequest, match=r"is a formation .*, without one platform"):
            asked()


def test_other_questions_refuse_formations_in_one_line():
    with pytest.raises(BadRequest, match="formation"):
        singularities(drawn(3, "position", [(1, 2), (2, 3), (1, 3)])[0])
    with pytest.raises(BadRequest, match="two of 1 to 3"):
        build_formation(np.eye(3), [(1, 4)])
    with pytest.raises(BadRequest, match="yaw"):
        build_formation(np.eye(3), bodies="round")


def test_the_certificate_of_ranks_holds():
    """[A; X] is six rows a body; a checker that knows nothing of formations counts what is seen."""
    found = complete("free", 3)
    record = json.loads(json.dumps(certificate(found)))
    assert "11 of 18 dof" in verify(record)
    assert verify(record, found.robot)
