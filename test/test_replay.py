# SPDX-License-Identifier: Apache-2.0
"""gradnav replay: recorded odometry through the controller, whatever the bag is like."""

import json
import math
import subprocess
import sys

import pytest
from conftest import ROOT

pytest.importorskip("rosbags", reason="needs rosbags")

from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from test_recordings import COUNTS, RECORDINGS

from tbot_gradnav import bags
from tbot_gradnav.cli import main
from tbot_gradnav.odometry import Reading
from tbot_gradnav.recording import Recorder, recording
from tbot_gradnav.replay import Comparison, Replay
from tbot_gradnav.unicycle import Twist, quaternion

sys.path.insert(0, str(ROOT / "tools"))
import reference_bags

OK, NO, WRONG = 0, 1, 2
DRIVE = "goal: [4, 0]\npotential: quadratic"
DURATIONS = {
    "tb3_waffle_pi_gazebo_walker": 18.43,
    "tb3_waffle_gazebo_contact": 27.57,
    "neato_real_square": 41.30,
}


def drive(n=40, period=0.05):
    """Return readings of a robot that drives along x at 0.2 m/s."""
    return [Reading(1.0 + i * period, 0.2 * i * period, 0.0, 0, 0, 0.0, 1.0) for i in range(n)]


def write(path, readings, commands=()):
    """Write a bag of readings at their stamps (or a growing time) and (time, v, omega)."""
    with recording(path) as recorder:
        for i, reading in enumerate(readings):
            recorder.write_odometry(round((1.0 + 0.05 * i) * 1e9), reading)
        for seconds, v, omega in commands:
            recorder.write_command(round(seconds * 1e9), Twist(v, omega))
    return path


@pytest.fixture
def replayed(tmp_path, parameter_file, capsys):
    """Give a function that replays a bag and returns exit status, JSON and both outputs."""

    def run(bag, text=DRIVE, *more):
        out = tmp_path / "figures.json"
        out.unlink(missing_ok=True)
        file = parameter_file(text)
        status = main(["replay", str(bag), str(file), "--json", str(out), *map(str, more)])
        said = capsys.readouterr()
        return status, json.loads(out.read_text()) if out.exists() else None, said.out, said.err

    return run


@pytest.mark.parametrize("name", reference_bags.scenarios())
def test_the_controller_does_what_it_did(name):
    text = reference_bags.scenarios()[name]
    found = reference_bags.compared(reference_bags.DATA / name, text)
    assert found.equal, (
        reference_bags.verdict(name, found)
        + "; if that is meant, look at it, then run tools/reference_bags.py --accept"
    )
    assert found.matched > 100


def test_a_change_of_a_gain_is_found_and_located():
    name = "descent_navigation_function"
    text = reference_bags.scenarios()[name].replace("k_omega: 3", "k_omega: 3.001")
    found = reference_bags.compared(reference_bags.DATA / name, text)
    assert not found.equal
    assert found.max_omega > 1e-6
    assert "differs from" in reference_bags.verdict(name, found)


def test_the_node_replays_the_same(graph, tmp_path):
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from geometry_msgs.msg import Twist as TwistMessage
    from nav_msgs.msg import Odometry
    from rclpy.serialization import deserialize_message

    name = "descent_attractive_repulsive"
    text = reference_bags.scenarios()[name]
    file = tmp_path / "parameters.yaml"
    file.write_text(text)
    heard = graph.listen(TwistMessage, "cmd_vel")
    publisher = graph.node.create_publisher(Odometry, "odom", 10)
    graph.start("navigator", "--ros-args", "--params-file", file)
    graph.until(lambda: publisher.get_subscription_count() == 1, "navigator")
    graph.until(lambda: graph.node.count_publishers("cmd_vel") == 1, "cmd_vel")
    with bags.opened(reference_bags.DATA / name) as bag:
        replay = Replay(reference_bags.configured(text), bag, Comparison(0.0, 0.0))
        for sample in replay.samples():
            if sample.recorded is not None:
                continue
            before = len(heard)
            publisher.publish(deserialize_message(sample.event.cdr, Odometry))
            graph.until(lambda before=before: len(heard) > before, "command")
            assert heard[-1].linear.x == float(sample.computed.v)
            assert heard[-1].angular.z == float(sample.computed.omega)


@pytest.mark.parametrize("name", COUNTS)
def test_recordings_of_others_replay(replayed, name):
    if not (RECORDINGS / name).is_dir():
        pytest.skip("GRADNAV_RECORDINGS names no folder")
    status, figures, _, _ = replayed(RECORDINGS / name)
    assert status == NO  # they were driven by something else
    assert figures["odometry"] == COUNTS[name]
    assert figures["duration"] == pytest.approx(DURATIONS[name], abs=0.01)
    assert figures["commands"] > 0


def test_what_is_written_replays_equal_and_keeps_the_odometry(replayed, tmp_path):
    bag, out, picture = write(tmp_path / "in", drive()), tmp_path / "out", tmp_path / "out.png"
    status, figures, said, _ = replayed(bag, DRIVE, "--out", out, "--plot", picture)
    assert status == OK
    assert "no recorded commands" in said
    assert (figures["odometry"], figures["commands"]) == (40, 0)
    assert picture.read_bytes().startswith(b"\x89PNG")
    status, figures, _, _ = replayed(out)
    assert status == OK
    assert (figures["odometry"], figures["commands"]) == (40, 40)
    assert figures["max_v_difference"] == figures["max_omega_difference"] == 0.0
    with bags.opened(bag) as a, bags.opened(out) as b:
        written = [e.cdr for e in b.events() if isinstance(e.content, Reading)]
        assert [e.cdr for e in a.events()] == written


def test_differences_are_measured_and_located(replayed, tmp_path):
    bag = write(tmp_path / "bag", drive(), [(1.52, 0.2097, 0.0), (2.02, 0.1, 0.5)])
    status, figures, said, _ = replayed(bag)
    assert status == NO
    assert figures["max_v_difference"] == pytest.approx(0.1097)
    assert figures["max_omega_difference"] == pytest.approx(0.5)
    assert figures["rms_v_difference"] == pytest.approx(0.1097 / math.sqrt(2))
    assert figures["first_divergence"] == pytest.approx(1.02)
    assert "NOT equal" in said
    status, figures, _, _ = replayed(bag, DRIVE, "--tolerance-v", "0.2", "--tolerance-omega", "1")
    assert status == OK
    assert figures["equal"]


def pose_stamped(types, x, y, frame):
    time = types["builtin_interfaces/msg/Time"](0, 0)
    pose = types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](x, y, 0.0),
        types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 0.0),
    )
    header = types["std_msgs/msg/Header"](time, frame)
    return types["geometry_msgs/msg/PoseStamped"](header, pose)


def path_of(types, points):
    poses = [pose_stamped(types, x, y, "") for x, y in points]
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "map")
    return types["nav_msgs/msg/Path"](header, poses)


def write_with(path, said, commands):
    """Write a bag with messages (time, topic, function of the types) between the odometry."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with recording(path) as recorder:
        for reading in drive():
            recorder.write_odometry(round(reading.stamp * 1e9), reading)
        for seconds, topic, make in said:
            message = make(store.types)
            kind = message.__msgtype__
            data = bytes(store.serialize_cdr(message, kind))
            recorder.write(topic, kind, round(seconds * 1e9), data)
        for seconds, v in commands:
            recorder.write_command(round(seconds * 1e9), Twist(v, 0.0))
    return path


def said(state):
    return lambda types: types["std_msgs/msg/String"](state)


def test_a_goal_in_the_bag_is_obeyed(replayed, tmp_path):
    goal = (1.98, "/goal_pose", lambda types: pose_stamped(types, -4.0, 0.0, "map"))
    # the robot stands while the navigator looks whether it can go there
    commands = [(1.96, 0.2097), (1.981, 0.0), (2.96, -0.2097)]
    bag = write_with(tmp_path / "bag", [goal], commands)
    assert replayed(bag)[0] == OK


def test_waypoints_in_the_bag_are_obeyed(replayed, tmp_path):
    """The first waypoint is passed where the robot is, the second is behind it."""
    behind = lambda types: path_of(types, [(0.2, 0.0), (-1.0, 0.0), (4.0, 0.0)])  # noqa: E731
    bag = write_with(
        tmp_path / "bag", [(1.98, "/waypoints", behind)], [(1.96, 0.2097), (2.06, -0.2097)]
    )
    assert replayed(bag)[0] == OK


def test_a_path_that_the_navigator_refuses_is_refused(replayed, tmp_path):
    empty = (1.98, "/waypoints", lambda types: path_of(types, []))
    status, figures, _, _ = replayed(
        write_with(tmp_path / "bag", [empty], [(1.96, 0.2097), (2.96, 0.2097)])
    )
    assert status == OK
    assert any("without poses" in warning for warning in figures["warnings"])


def test_a_pause_in_the_bag_is_kept(replayed, tmp_path):
    states = [(1.0, "driving"), (1.98, "paused"), (1.99, "paused"), (2.48, "driving")]
    bag = write_with(
        tmp_path / "bag",
        [(seconds, "/state", said(state)) for seconds, state in states],
        # a pause stops the robot at once, before the state is told
        [(1.96, 0.2097), (1.97, 0.0), (2.21, 0.0), (2.46, 0.0), (2.96, 0.2097)],
    )
    assert replayed(bag)[0] == OK


def test_a_stop_that_nothing_explains_is_a_difference(replayed, tmp_path):
    bag = write_with(tmp_path / "bag", [], [(1.96, 0.2097), (1.97, 0.0), (2.96, 0.2097)])
    status, figures, _, _ = replayed(bag)
    assert status == NO
    assert figures["first_divergence"] == pytest.approx(0.97)


def test_a_robot_in_a_namespace_is_found(replayed, tmp_path):
    path = write_with(tmp_path / "bag", [], [(1.96, 0.2097)])
    renamed = Writer(tmp_path / "renamed", version=9, storage_plugin=StoragePlugin.MCAP)
    with renamed, bags.opened(path) as bag:
        recorder = Recorder(renamed, get_typestore(Stores.ROS2_JAZZY))
        for event in bag.events():
            name, kind = ("odom", "nav_msgs/msg/Odometry")
            if isinstance(event.content, Twist):
                name, kind = ("cmd_vel", "geometry_msgs/msg/Twist")
            recorder.write(f"/tb1/{name}", kind, event.recorded, event.cdr)
    assert replayed(tmp_path / "renamed")[:2] == replayed(path)[:2]


def test_what_is_replayed_is_not_replaced(replayed, tmp_path):
    bag = write(tmp_path / "bag", drive())
    (file,) = bag.glob("*.mcap")
    for source in (bag, file):
        status, _, _, said = replayed(source, DRIVE, "--out", bag)
        assert status == WRONG
        assert "left alone" in said
    assert replayed(bag)[1]["odometry"] == 40


def test_without_goal_or_map_it_says_what_is_missing(replayed, tmp_path):
    bag = write_with(tmp_path / "bag", [], [(1.96, 0.2097)])
    status, figures, _, _ = replayed(bag, "potential: quadratic")
    assert status == NO
    assert any("no goal in the file or the bag" in warning for warning in figures["warnings"])
    status, _, _, said = replayed(bag, "potential: map\ngoal: [1, 1]")
    assert status == WRONG
    assert "map.file is missing" in said


def test_what_others_say_under_names_like_ours_is_ignored(replayed, tmp_path):
    others = [
        (1.5, "/state", said("armed")),
        (1.6, "/waypoints", said("north, then east")),
    ]
    assert replayed(write_with(tmp_path / "bag", others, [(2.96, 0.2097)]))[0] == OK
    number = (1.5, "/state", lambda types: types["std_msgs/msg/Int32"](3))
    assert replayed(write_with(tmp_path / "number", [number], [(2.96, 0.2097)]))[0] == OK


def ros1(path, readings):
    """Write a ROS 1 bag."""
    store = get_typestore(Stores.ROS1_NOETIC)
    types, kind = store.types, "nav_msgs/msg/Odometry"
    import numpy as np

    with Ros1Writer(path) as writer:
        connection = writer.add_connection("/odom", kind, typestore=store)
        for i, r in enumerate(readings):
            time = types["builtin_interfaces/msg/Time"](int(r.stamp), round(r.stamp % 1 * 1e9))
            zero = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
            pose = types["geometry_msgs/msg/Pose"](
                types["geometry_msgs/msg/Point"](r.x, r.y, 0.0),
                types["geometry_msgs/msg/Quaternion"](*r[3:7]),
            )
            message = types[kind](
                types["std_msgs/msg/Header"](i, time, "odom"),
                "base_footprint",
                types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
                types["geometry_msgs/msg/TwistWithCovariance"](
                    types["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36)
                ),
            )
            writer.write(connection, round(r.stamp * 1e9), store.serialize_ros1(message, kind))
    return path


def ros2(path, readings, storage, mode=CompressionMode.NONE):
    writer = Writer(path, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        recorder = Recorder(writer, get_typestore(Stores.ROS2_JAZZY))
        for reading in readings:
            recorder.write_odometry(round(reading.stamp * 1e9), reading)
    return path


def without_metadata(path):
    (path / "metadata.yaml").unlink()
    return path


def misnamed(path):
    (file,) = path.glob("*.db3")
    file.rename(path / "renamed_0.db3")
    return path


KINDS = {
    "mcap": lambda p: ros2(p, drive(), StoragePlugin.MCAP),
    "mcap without metadata": lambda p: without_metadata(ros2(p, drive(), StoragePlugin.MCAP)),
    "mcap alone": lambda p: next(ros2(p, drive(), StoragePlugin.MCAP).glob("*.mcap")),
    "sqlite3": lambda p: ros2(p, drive(), StoragePlugin.SQLITE3),
    "sqlite3 alone": lambda p: next(ros2(p, drive(), StoragePlugin.SQLITE3).glob("*.db3")),
    "sqlite3 misnamed": lambda p: misnamed(ros2(p, drive(), StoragePlugin.SQLITE3)),
    "file compressed": lambda p: ros2(p, drive(), StoragePlugin.SQLITE3, CompressionMode.FILE),
    "message compressed": lambda p: ros2(
        p, drive(), StoragePlugin.SQLITE3, CompressionMode.MESSAGE
    ),
    "chunk compressed": lambda p: ros2(p, drive(), StoragePlugin.MCAP, CompressionMode.STORAGE),
    "ros 1": lambda p: ros1(p.with_suffix(".bag"), drive()),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_bag_replays_alike(replayed, tmp_path, kind):
    expected = replayed(write(tmp_path / "plain", drive()), DRIVE, "--out", tmp_path / "a")[1]
    status, figures, _, _ = replayed(KINDS[kind](tmp_path / "bag"), DRIVE, "--out", tmp_path / "b")
    assert status == OK
    assert figures == expected
    with bags.opened(tmp_path / "a") as a, bags.opened(tmp_path / "b") as b:
        assert [e.content for e in a.events()] == [e.content for e in b.events()]


def of_wrong_type(path):
    with recording(path) as recorder:
        recorder.write_text("/odom", 1, "I am at home")
    return path


def truncated(path, storage):
    file = next(f for f in ros2(path, drive(400), storage).iterdir() if f.suffix != ".yaml")
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    return path


def with_text(path, text):
    path.write_text(text)
    return path


def empty_folder(path):
    path.mkdir()
    return path


def without_odometry(path):
    with recording(path) as recorder:
        recorder.write_command(1, Twist(0.1, 0.0))
    return path


REFUSED = {
    "missing": (lambda p: p, "no such bag"),
    "empty folder": (empty_folder, "no bag"),
    "empty bag": (lambda p: write(p, []), "/odom"),
    "no odometry": (without_odometry, "no messages on topic /odom (topics: /cmd_vel)"),
    "wrong type": (of_wrong_type, "std_msgs/msg/String; must be nav_msgs/msg/Odometry"),
    "truncated mcap": (lambda p: truncated(p, StoragePlugin.MCAP), "damaged"),
    "truncated sqlite3": (lambda p: truncated(p, StoragePlugin.SQLITE3), "damaged"),
    "text named mcap": (lambda p: with_text(p.with_suffix(".mcap"), "hello"), "damaged"),
    "text named bag": (lambda p: with_text(p.with_suffix(".bag"), "hello"), "damaged"),
    "another kind of file": (lambda p: with_text(p.with_suffix(".txt"), "hello"), "no bag"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_no_bag_is_refused_in_one_line(replayed, tmp_path, kind):
    make, word = REFUSED[kind]
    path = make(tmp_path / "bag")
    status, figures, _, said = replayed(path, DRIVE, "--out", tmp_path / "out")
    assert status == WRONG
    assert figures is None
    assert len(said.splitlines()) == 1
    assert word in said
    assert path.name in said
    assert not (tmp_path / "out").exists()


def spoilt(change, at=20, until=21):
    return [change(r) if at <= i < until else r for i, r in enumerate(drive())]


def turned(angle, axis):
    half_sin, half_cos = math.sin(angle / 2), math.cos(angle / 2)
    return {"q_x": half_sin if axis == "x" else 0.0, "q_w": half_cos}


AWKWARD = {
    "zero stamps": (lambda: [r._replace(stamp=0.0) for r in drive()], "repeated", 39),
    "time going backward": (lambda: spoilt(lambda r: r._replace(stamp=r.stamp - 0.5)), "back", 1),
    "a duplicate": (lambda: [*drive()[:20], *drive()[19:]], "repeated", 1),
    "a hole": (lambda: [*drive()[:20], *(r._replace(stamp=r.stamp + 2) for r in drive()[20:])],
               "no odometry for 2.05 s", 1),
    "a pose that is no number": (lambda: spoilt(lambda r: r._replace(x=math.nan)), "finite", 1),
    "infinite poses": (lambda: spoilt(lambda r: r._replace(y=math.inf), 5, 9), "finite", 4),
    "a quaternion of zero": (lambda: spoilt(lambda r: r._replace(q_w=0.0)), "no heading", 1),
    "a reset": (lambda: [*drive(), *(r._replace(x=r.x - 0.5) for r in drive())], "jumped", 1),
    "a tilt of 45 degrees": (
        lambda: spoilt(lambda r: r._replace(**turned(math.pi / 4, "x")), 10, 13), "tilted", 3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", AWKWARD)
def test_what_stands_out_is_warned_of_with_its_count(replayed, tmp_path, kind):
    make, word, count = AWKWARD[kind]
    readings = make()
    status, figures, _, _ = replayed(write(tmp_path / "bag", readings))
    assert status == OK
    assert figures["odometry"] == len(readings)
    (warning,) = [w for w in figures["warnings"] if word in w]
    assert (f"and {count - 1} more" in warning) == (count > 1)


def test_an_unnormalised_quaternion_is_no_matter(replayed, tmp_path):
    q_z, q_w = quaternion(0.7)
    plain = [r._replace(q_z=q_z, q_w=q_w) for r in drive()]
    scaled = [r._replace(q_z=1e3 * q_z, q_w=1e3 * q_w) for r in plain]
    replayed(write(tmp_path / "plain", plain), DRIVE, "--out", tmp_path / "a")
    status, figures, _, _ = replayed(
        write(tmp_path / "scaled", scaled), DRIVE, "--out", tmp_path / "b"
    )
    assert status == OK
    assert figures["warnings"] == []
    with bags.opened(tmp_path / "a") as a, bags.opened(tmp_path / "b") as b:
        for one, other in zip(a.events(), b.events(), strict=True):
            if isinstance(one.content, Twist):
                assert one.content == pytest.approx(other.content, abs=1e-12)


def peak_memory(bag):
    """Return the peak memory [MiB] of a replay in a process of its own."""
    code = (
        "import resource, sys; from tbot_gradnav.cli import main; main(sys.argv[1:]);"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)"
    )
    command = [sys.executable, "-c", code, "replay", str(bag), "nine_navigation_function.yaml"]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(result.stderr.split()[-1]) / 1024


def test_a_long_bag_needs_no_more_memory_than_a_short_one(tmp_path):
    short = peak_memory(write(tmp_path / "short", drive(200)))
    long = peak_memory(write(tmp_path / "long", drive(20_000, period=0.0005)))
    assert long < short + 30.0
