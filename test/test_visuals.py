# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove are shown."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from arenas import ATTRACTIVE_REPULSIVE, NAVIGATION_FUNCTION, NINE
from conftest import CONFIG

pytest.importorskip("rclpy", reason="needs ROS 2")

import yaml
from nav_msgs.msg import OccupancyGrid, Path
from remote import LATCHED, Remote
from robot import Robot
from visualization_msgs.msg import Marker, MarkerArray

from tbot_gradnav import markers, raster
from tbot_gradnav.parameter_file import read
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import Pose

ROOM = """
goal: [0.5, 0, 0.0]
initial_pose: [0, 0, 0]
boundary: {shape: polygon, points: [-3, -3, 3, -3, 3, 3, -3, 3]}
obstacles:
  names: [pillar, crate, plant, shelf]
  pillar: {x: -1.5, y: -1.2, radius: 0.3}
  crate: {shape: box, x: -1.2, y: 1.2, width: 0.6, height: 0.3, yaw: 0.2}
  plant: {shape: ellipse, x: 1.7, y: -1.2, semi_x: 0.5, semi_y: 0.3, yaw: 0.9}
  shelf: {shape: polygon, points: [1.2, 1.4, 1.8, 1.4, 1.4, 2.0]}
"""


def inside(marker, x, y):
    """Return whether a point lies in the footprint of an obstacle's marker."""
    if marker.type == Marker.TRIANGLE_LIST:
        corners = [(p.x, p.y) for p in marker.points]
        triangles = [corners[i : i + 3] for i in range(0, len(corners), 3)]
        return any(in_triangle(x, y, *t) for t in triangles)
    q = marker.pose.orientation
    yaw = 2.0 * math.atan2(q.z, q.w)
    dx, dy = x - marker.pose.position.x, y - marker.pose.position.y
    along = (math.cos(yaw) * dx + math.sin(yaw) * dy) / (marker.scale.x / 2.0)
    across = (math.cos(yaw) * dy - math.sin(yaw) * dx) / (marker.scale.y / 2.0)
    if marker.type == Marker.CUBE:
        return max(abs(along), abs(across)) <= 1.0
    return math.hypot(along, across) <= 1.0


def in_triangle(x, y, a, b, c):
    def side(p, q):
        return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0.0

    return side(a, b) == side(b, c) == side(c, a)


def test_markers_of_obstacles_cover_what_the_shapes_do():
    settings = Settings.of(read(CONFIG / "room.yaml"))
    obstacles = [m for m in markers.of_world(settings) if m.ns == "obstacles"]
    shapes = list(settings.obstacles.values())
    assert len(obstacles) == len(shapes) == 4
    rng = np.random.default_rng(0)
    for marker, shape in zip(obstacles, shapes, strict=True):
        points = rng.uniform(-1.0, 1.0, (300, 2)) + shape.centre
        d = shape.distance(*points.T).d
        covered = np.array([inside(marker, x, y) for x, y in points])
        sure = np.abs(d) > 0.01
        assert np.array_equal(covered[sure], d[sure] < 0.0)
        assert covered.any()


@pytest.mark.parametrize("potential", [NAVIGATION_FUNCTION, ATTRACTIVE_REPULSIVE, {}])
def test_attraction_and_repulsion_add_up_and_only_obstacles_repel(potential):
    settings = Settings.of({**NINE, **potential})
    x, y = np.random.default_rng(1).uniform(-2.0, 2.0, (2, 200))
    free = settings.world.clearance(x, y) > 0.1
    x, y = x[free], y[free]
    a_x, a_y = settings.chosen_potential.attraction(x, y)
    assert np.all(a_x * x + a_y * y > 0.0)  # away from the goal, as a gradient
    assert a_x * y == pytest.approx(a_y * x)
    arrows = markers.of_robot(settings.chosen_potential, Pose.at(-2.4, -1.8, 0.0), True)
    tips = {m.ns: np.array([m.points[1].x + 2.4, m.points[1].y + 1.8]) for m in arrows}
    assert tips["attractive"] + tips["repulsive"] == pytest.approx(tips["total"])
    assert max(math.hypot(*tip) for tip in tips.values()) == pytest.approx(markers.LONGEST)


def test_a_raster_falls_towards_the_goal_and_is_full_where_the_robot_cannot_be():
    settings = Settings.of({**NINE, **NAVIGATION_FUNCTION})
    found = raster.raster(settings.chosen_potential)
    rows, columns = np.unravel_index(np.arange(found.levels.size), found.levels.shape)
    x = found.x + (columns + 0.5) * found.resolution
    y = found.y + (rows + 0.5) * found.resolution
    taken = settings.world.clearance(x, y) <= 0.0
    levels = found.levels.ravel()
    assert np.array_equal(levels == raster.TAKEN, taken)
    assert levels.min() == 0
    assert levels[~taken].max() == 99
    lowest = np.flatnonzero(levels == 0)
    assert math.hypot(x[lowest].mean(), y[lowest].mean()) < 0.1
    phi = settings.chosen_potential(x[~taken], y[~taken]).phi
    order = np.argsort(phi, kind="stable")
    assert np.all(np.diff(levels[~taken][order].astype(int)) >= 0)


def test_a_drive_is_shown_to_whoever_looks_also_later(graph, parameter_file):
    robot, remote = Robot(graph, 0.0, 0.0, 0.0), Remote(graph)
    graph.start("navigator", "--ros-args", "--params-file", parameter_file(ROOM))
    remote.until("arrived", patience=30.0)
    shown = graph.listen(MarkerArray, "markers")
    driven = graph.listen(Path, "driven_path")
    grids = graph.listen(OccupancyGrid, "potential", LATCHED)
    graph.until(lambda: shown and driven and grids, "picture")
    first = {(m.ns, m.id) for m in shown[0].markers}
    assert {ns for ns, _ in first} == {"obstacles", "boundary", "goal"}
    assert len(first) == 4 + 1 + 2
    assert {m.header.frame_id for m in shown[0].markers} == {"map"}
    places = [p.pose.position for p in driven[-1].poses]
    assert math.hypot(places[0].x, places[0].y) < 0.1
    assert robot.distance(places[-1].x, places[-1].y) < 0.15
    assert len(places) > 5
    assert all(math.dist((a.x, a.y), (b.x, b.y)) < 0.3 for a, b in pairwise(places))

    assert not remote.set_one("obstacles.names", ["pillar", "crate", "shelf"])
    graph.until(lambda: len(grids) == 2, "potential of the new world")
    gone = [m for array in shown for m in array.markers if m.action == Marker.DELETE]
    assert {m.ns for m in gone} == {"obstacles"}
    assert len(gone) == 1
    remote.set_one("goal", [-0.5, 0.0])
    remote.until("driving")
    names = {"attractive", "repulsive", "total"}
    graph.until(lambda: {m.ns for m in shown[-1].markers} >= names, "vectors")
    graph.until(lambda: len(grids) == 3, "potential of the new goal")
    late = graph.listen(OccupancyGrid, "potential", LATCHED)
    graph.until(lambda: late, "latched potential")
    assert (late[0].info.width, late[0].info.height) == (raster.CELLS, raster.CELLS)


def test_the_layouts_show_the_topics_that_there_are():
    topics = {"/markers", "/driven_path", "/potential"}
    rviz = yaml.safe_load((CONFIG / "tbot_gradnav.rviz").read_text())
    displays = rviz["Visualization Manager"]["Displays"]
    assert topics <= {d["Topic"]["Value"] for d in displays if "Topic" in d}
    assert rviz["Visualization Manager"]["Global Options"]["Fixed Frame"] == "map"
    tools = rviz["Visualization Manager"]["Tools"]
    assert "/goal_pose" in {t["Topic"]["Value"] for t in tools if "Topic" in t}
    layout = json.loads((CONFIG / "foxglove_layout.json").read_text())
    shown = layout["configById"]["3D!drive"]
    assert topics <= {name for name, topic in shown["topics"].items() if topic["visible"]}
    assert shown["publish"]["poseTopic"] == "/goal_pose"

    def panels(tree):
        return [tree] if isinstance(tree, str) else panels(tree["first"]) + panels(tree["second"])

    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
