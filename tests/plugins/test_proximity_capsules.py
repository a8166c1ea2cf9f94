"""Capsules around collision shapes: they enclose, merged ones over the whole range, and the cache never lies."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock_detectors.proximity._bodies import BodyCapsule, body_capsules, body_points
from foreshock_detectors.proximity._cache import cached, content_digest
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._files import cache_folder, package_folders, talos_files
from foreshock_detectors.proximity._fit import bounding_capsule, hull_vertices, outside_m, quick_capsule
from foreshock_detectors.proximity._robot import Robot

INSIDE_M = 1e-6  # a micrometre: rounding of a fit to metres, far below any mesh's own accuracy


@pytest.fixture(scope="module")
def talos():
    urdf, _ = talos_files()
    model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    folders = package_folders(ProximityConfig(), urdf)
    return model, pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.COLLISION, package_dirs=folders)


def distance_from_segment(points, a, b):
    """Independent of the fit: least distance over the segment by its two regions."""
    a, b = np.asarray(a), np.asarray(b)
    length = np.linalg.norm(b - a)
    if length == 0.0:
        return np.linalg.norm(points - a, axis=1)
    u = (b - a) / length
    along = (points - a) @ u
    line = np.linalg.norm(np.cross(points - a, u), axis=1)
    ends = np.minimum(np.linalg.norm(points - a, axis=1), np.linalg.norm(points - b, axis=1))
    return np.where((along > 0.0) & (along < length), line, ends)


def test_every_mesh_vertex_of_talos_lies_inside_its_joints_capsule(talos):
    model, geometry = talos
    capsules = {c.joint: c for c in body_capsules(model, geometry, 0)}
    assert len(capsules) == 33
    for shape in geometry.geometryObjects:
        if not hasattr(shape.geometry, "vertices"):
            continue
        points = np.array([shape.placement.act(v) for v in np.asarray(shape.geometry.vertices())])
        capsule = capsules[model.names[shape.parentJoint]]
        assert distance_from_segment(points, capsule.a, capsule.b).max() <= capsule.radius + INSIDE_M


def test_twenty_merged_capsules_enclose_talos_in_every_posture(talos):
    model, geometry = talos
    capsules = body_capsules(model, geometry, 20)
    assert len(capsules) == 20
    home = {c.joint: c for c in capsules} | {s.joint: c for c in capsules for s in c.swept}
    points = body_points(model, geometry)
    assert {model.names[j] for j in points} == set(home)
    rng, data = np.random.default_rng(20), model.createData()
    q = pin.neutral(model)
    for _ in range(40):
        share = rng.choice([0.0, 1.0, rng.uniform()], model.nq - 7)  # the ends of the ranges, too
        q[7:] = model.lowerPositionLimit[7:] * (1 - share) + model.upperPositionLimit[7:] * share
        pin.forwardKinematics(model, data, q)
        for joint, hull in points.items():
            capsule = home[model.names[joint]]
            place = data.oMi[model.getJointId(capsule.joint)].actInv(data.oMi[joint])
            seen = hull @ place.rotation.T + place.translation
            assert distance_from_segment(seen, capsule.a, capsule.b).max() <= capsule.radius + INSIDE_M


def test_merging_adds_little_to_talos(talos):
    """Volume of 20 against 33 capsules: merged joints are coaxial or small, or merging would be of no use."""

    def volume(capsules):
        return sum(
            math.pi * c.radius**2 * (math.dist(c.a, c.b) + 4 / 3 * c.radius) for c in capsules if "leg" not in c.joint
        )

    assert volume(body_capsules(*talos, 20)) < 1.15 * volume(body_capsules(*talos, 0))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(0.01, 1.0), st.floats(0.0, 1.0))
def test_a_capsule_encloses_any_cloud(seed, n, length, flat):
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(n, 3)) * (length, 0.1, 0.1 * flat) @ pin.utils.rotate("z", 0.7) + rng.normal(size=3)
    hull = hull_vertices(cloud)
    best, quick = bounding_capsule(hull), quick_capsule(hull)
    for capsule in (best, quick):
        assert distance_from_segment(cloud, capsule.a, capsule.b).max() <= capsule.radius + INSIDE_M
        assert outside_m(capsule, cloud) <= INSIDE_M
    assert best.volume_m3 <= quick.volume_m3 * (1 + 1e-9)


def test_points_on_a_capsule_are_fitted_by_that_capsule():
    """8000 points on the surface of a tilted capsule of radius 0.1 and length 0.4: the minimum is known."""
    rng = np.random.default_rng(3)
    turn = pin.rpy.rpyToMatrix(0.3, 0.8, -0.2)
    z = rng.choice([-0.2, 0.2], 8000)
    ball = rng.normal(size=(8000, 3))
    ball = 0.1 * ball / np.linalg.norm(ball, axis=1)[:, None]
    ball[:, 2] = np.abs(ball[:, 2]) * np.sign(z)
    points = (ball + np.column_stack([0 * z, 0 * z, z])) @ turn.T
    found = bounding_capsule(hull_vertices(points))
    assert found.radius == pytest.approx(0.1, rel=0.01)
    assert math.dist(found.a, found.b) == pytest.approx(0.4, rel=0.02)


URDF = """<robot name="probe">
  <link name="base"><collision><geometry><box size="0.2 0.3 0.1"/></geometry></collision></link>
  <link name="wheel"><collision><origin xyz="0 0.1 0" rpy="0.2 0 0"/>
    <geometry><cylinder radius="0.05" length="0.2"/></geometry></collision></link>
  <link name="slide"><collision><origin xyz="0.1 0 0"/><geometry><sphere radius="0.04"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 0 1"/></joint>
  <joint name="push" type="prismatic"><parent link="wheel"/><child link="slide"/><origin xyz="0 0 0.1"/>
    <axis xyz="1 0 0"/><limit lower="-0.1" upper="0.3" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.fixture
def probe(tmp_path):
    urdf = tmp_path / "probe.urdf"
    urdf.write_text(URDF)
    return ProximityConfig(urdf=str(urdf), cache_dir=str(tmp_path / "cache"), capsules=1)


def test_any_urdf_with_solids_an_endless_and_a_sliding_joint(probe):
    """One capsule around points on the solids' own surfaces, wherever the joints are."""
    robot = Robot(probe)
    (capsule,) = robot.capsules
    assert capsule.joint == "root_joint"
    rng, data = np.random.default_rng(8), robot.model.createData()
    angle = rng.uniform(0, 2 * math.pi, 200)
    rim = np.column_stack([0.05 * np.cos(angle), 0.05 * np.sin(angle), rng.choice([-0.1, 0.1], 200)])
    rim = rim @ pin.utils.rotate("x", 0.2).T + (0, 0.1, 0)
    ball = rng.normal(size=(200, 3))
    ball = 0.04 * ball / np.linalg.norm(ball, axis=1)[:, None] + (0.1, 0, 0)
    for turn, push in zip(rng.uniform(-9, 9, 50), rng.uniform(-0.1, 0.3, 50), strict=True):
        pin.forwardKinematics(robot.model, data, np.array([0, 0, 0, 0, 0, 0, 1, math.cos(turn), math.sin(turn), push]))
        for joint, points in (("turn", rim), ("push", ball)):
            place = data.oMi[robot.model.getJointId(joint)]
            seen = points @ place.rotation.T + place.translation
            assert distance_from_segment(seen, capsule.a, capsule.b).max() <= capsule.radius + INSIDE_M


def test_the_second_start_reads_what_the_first_has_fitted(probe):
    first = Robot(probe).capsules
    (file,) = Path(probe.cache_dir).iterdir()
    before = file.read_bytes()
    assert Robot(probe).capsules == first
    assert [f.read_bytes() for f in Path(probe.cache_dir).iterdir()] == [before]


CAPSULES = (BodyCapsule("root_joint", (0.0, 0.0, 0.0), (0.0, 0.0, 0.5), 0.1),)


@pytest.mark.parametrize(
    "damage",
    [
        lambda b: b[: len(b) // 2],
        lambda b: b"",
        lambda b: b.replace(b"0.5", b"0.4"),
        lambda b: b.replace(b'"radius":0.1', b'"radius":-0.1'),
        lambda b: b.replace(b"root_joint", b"leaf_joint"),
        lambda b: b"\xff\xfe" + b,
    ],
)
def test_a_damaged_cache_is_fitted_anew_and_repaired(tmp_path, damage):
    fits = []

    def fit():
        fits.append(1)
        return CAPSULES

    assert cached(tmp_path, "digest", fit) == CAPSULES
    assert cached(tmp_path, "digest", fit) == CAPSULES
    assert len(fits) == 1
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    assert file.read_bytes() != whole
    assert cached(tmp_path, "digest", fit) == CAPSULES
    assert len(fits) == 2
    assert file.read_bytes() == whole


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("a file where the folder should be")
    assert cached(blocked, "digest", lambda: CAPSULES) == CAPSULES
    assert cached(None, "digest", lambda: CAPSULES) == CAPSULES


def test_the_digest_changes_with_content_and_parameters(tmp_path):
    a, b = tmp_path / "a", tmp_path / "b"
    a.write_text("xy")
    b.write_text("z")
    digests = {content_digest([a, b], 20), content_digest([a, b], 21), content_digest([b, a], 20)}
    a.write_text("x")
    b.write_text("yz")
    digests.add(content_digest([a, b], 20))
    assert len(digests) == 4


def test_the_cache_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("FORESHOCK_CACHE", str(tmp_path))
    assert cache_folder(ProximityConfig()) == tmp_path / "capsules"
    assert cache_folder(ProximityConfig(cache_dir="here")) == Path("here")
    monkeypatch.delenv("FORESHOCK_CACHE")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder(ProximityConfig()) == tmp_path / ".cache/foreshock/capsules"


def test_a_file_that_is_no_robot_or_is_not_there(tmp_path, probe):
    with pytest.raises(ConfigError, match=r"did you mean 'probe\.urdf'"):
        Robot(ProximityConfig(urdf=str(tmp_path / "prob.urdf")))
    (tmp_path / "bad.urdf").write_text("<robot")
    with pytest.raises(ConfigError, match="not a URDF"):
        Robot(ProximityConfig(urdf=str(tmp_path / "bad.urdf")))
    (tmp_path / "bare.urdf").write_text('<robot name="bare"><link name="base"/></robot>')
    with pytest.raises(ConfigError, match="no collision geometry"):
        Robot(ProximityConfig(urdf=str(tmp_path / "bare.urdf"), cache_dir=str(tmp_path / "c")))
    mesh = '<collision><geometry><mesh filename="package://nowhere/x.stl"/></geometry></collision>'
    (tmp_path / "lost.urdf").write_text(f'<robot name="lost"><link name="base">{mesh}</link></robot>')
    with pytest.raises(ConfigError, match="package_dirs"):
        Robot(ProximityConfig(urdf=str(tmp_path / "lost.urdf"), cache_dir=str(tmp_path / "c")))
    with pytest.raises(ConfigError, match="did you mean 'head_1_joint'"):
        Robot(ProximityConfig(held_joints=("head_1_jont",), cache_dir=str(tmp_path / "c")))
    with pytest.raises(ConfigError, match="did you mean 'half_sitting'"):
        Robot(ProximityConfig(reference="half_siting", cache_dir=str(tmp_path / "c")))
