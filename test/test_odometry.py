# SPDX-License-Identifier: Apache-2.0
"""Odometry as it may come: from messages to the pose in the world, and what stands out."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from readings import GOOD, PERIOD, START, close, driving, kinds, reading

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.limits import Limits
from tbot_gradnav.odometry import BadOdometryError, GoalPose, Odometry
from tbot_gradnav.unicycle import Pose, Twist, quaternion, step

POSES = st.builds(Pose.at, st.floats(-10, 10), st.floats(-10, 10), st.floats(-4, 4))


def odometry():
    return Odometry(START, Limits())


@given(first=POSES)
def test_the_first_message_is_the_initial_pose_wherever_odometry_starts(first):
    pose, notices = odometry().update(reading(12.3, first))
    assert close(pose, START)
    assert notices == []


@given(first=POSES, v=st.floats(-0.2, 0.2), omega=st.floats(-2.0, 2.0))
def test_afterwards_the_robot_moves_from_there_as_odometry_says(first, v, omega):
    track, twist = odometry(), Twist(v, omega)
    for i, message in enumerate(itertools.islice(driving(twist, first), 20)):
        pose, notices = track.update(message)
        assert close(pose, step(START, twist, i * PERIOD))
        assert notices == []


@given(first=POSES, flips=st.lists(st.sampled_from([1.0, -1.0, 1e-3, -1e3]), min_size=5))
def test_the_sign_and_the_size_of_the_quaternion_do_not_matter(first, flips):
    track = odometry()
    for i, flip in enumerate(flips):
        plain = reading(i * PERIOD, first)
        pose, notices = track.update(plain._replace(q_z=flip * plain.q_z, q_w=flip * plain.q_w))
        assert close(pose, START)
        assert notices == []


@pytest.mark.parametrize("size", [1e-200, 1e-9, 1e9, 1e200])
def test_a_quaternion_of_absurd_size_still_has_a_heading(size):
    pose, _ = odometry().update(GOOD._replace(q_z=0.0, q_w=size))
    assert close(pose, START)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["stamp", "x", "y", "q_x", "q_y", "q_z", "q_w"])
def test_a_message_that_is_not_finite_is_bad(field, value):
    with pytest.raises(BadOdometryError):
        odometry().update(GOOD._replace(**{field: value}))


BAD = {
    "zero quaternion": GOOD._replace(q_w=0.0),
    "upside down": GOOD._replace(q_x=1.0, q_w=0.0),
    "far in x": GOOD._replace(x=1e7),
    "far in y": GOOD._replace(y=-1e300),
}


@pytest.mark.parametrize("message", BAD.values(), ids=BAD.keys())
def test_a_message_without_a_pose_is_bad_in_one_line(message):
    with pytest.raises(BadOdometryError) as caught:
        odometry().update(message)
    assert len(str(caught.value).splitlines()) == 1


def test_a_bad_message_in_between_is_forgotten():
    track = odometry()
    messages = list(itertools.islice(driving(Twist(0.2, 1.0)), 10))
    for message in messages[:5]:
        track.update(message)
    with pytest.raises(BadOdometryError):
        track.update(messages[5]._replace(x=math.nan))
    for message in messages[6:]:
        pose, notices = track.update(message)
        assert notices == []
    assert close(pose, step(START, Twist(0.2, 1.0), 9 * PERIOD))


@given(first=POSES, point=POSES)
def test_a_point_of_the_odometry_frame_is_the_same_point_of_the_world(first, point):
    """A robot that odometry says is at a point stands there in the world as well."""
    track = odometry()
    track.update(reading(0.0, first))
    ahead, _ = track.update(reading(1e6, point))  # late enough not to be a jump
    goal = GoalPose("odom", point.x, point.y, *quaternion(point.theta))
    (x, y, yaw), waypoints = track.in_world([goal])
    assert waypoints == ()
    assert close((x, y), ahead[:2], 1e-8)
    assert close((math.cos(yaw), math.sin(yaw)), ahead[2:], 1e-8)
    for frame in ("map", ""):
        unturned = GoalPose(frame, float(point.x), float(point.y), 0.0, 0.0)
        place = (point.x, point.y)
        assert track.in_world([unturned] * 3) == (place, place * 2)


@pytest.mark.parametrize("frame", ["base_link", "Map", "odom "])
def test_a_point_of_another_frame_is_refused(frame):
    track = odometry()
    track.update(GOOD)
    with pytest.raises(GradnavError, match="unknown"):
        track.in_world([GoalPose(frame, 0.0, 0.0, 0.0, 1.0)])


@pytest.mark.parametrize("q_z", [90.0, -1.2, math.nan, math.inf])
def test_a_goal_with_degrees_for_a_quaternion_is_refused(q_z):
    with pytest.raises(GradnavError, match="must be a quaternion"):
        odometry().in_world([GoalPose("map", 1.0, 0.0, q_z, 0.0)])


def test_before_the_first_message_the_odometry_frame_is_unknown():
    with pytest.raises(GradnavError, match="unknown"):
        odometry().in_world([GoalPose("odom", 0.0, 0.0, 0.0, 1.0)])


# What stands out


def test_a_reset_leaves_the_robot_where_it_is_and_is_noticed_once():
    track, twist = odometry(), Twist(0.2, 0.3)
    for message in itertools.islice(driving(twist), 100):
        before, notices = track.update(message)
        assert notices == []
    reset, notices = track.update(reading(100 * PERIOD, Pose.at(0.0, 0.0, 0.0)))
    assert kinds(notices) == ["jump"]
    assert close(reset, before)
    later = step(Pose.at(0.0, 0.0, 0.0), twist, PERIOD)
    pose, notices = track.update(reading(101 * PERIOD, later))
    assert close(pose, step(before, twist, PERIOD))
    assert notices == []


@given(places=st.lists(POSES, min_size=2, max_size=10))
def test_however_often_the_odometry_frame_jumps_the_robot_stays(places):
    track = odometry()
    for i, place in enumerate(places):
        pose, notices = track.update(reading(i * PERIOD, place))
        moved = math.hypot(pose.x - START.x, pose.y - START.y)
        assert moved < 0.2 * (i + 1)  # what is too short for a jump may be the robot's
        assert set(kinds(notices)) <= {"jump"}


def test_a_turn_too_quick_for_the_robot_is_a_jump_too():
    track = odometry()
    track.update(reading(0.0, Pose.at(1.0, 1.0, 0.0)))
    pose, notices = track.update(reading(PERIOD, Pose.at(1.0, 1.0, 3.0)))
    assert kinds(notices) == ["jump"]
    assert close(pose, START)


def test_a_jump_is_seen_whatever_the_limits():
    """With infinite limits any motion in time is possible, but none in no time."""
    track = Odometry(START, Limits(v=math.inf, omega=math.inf, wheel=math.inf))
    track.update(reading(1.0, Pose.at(1.0, 1.0, 0.0)))
    _, notices = track.update(reading(1.0, Pose.at(5.0, 1.0, 0.0)))
    assert "jump" in kinds(notices)


@pytest.mark.parametrize("twist", [Twist(0.2097, 0.0), Twist(-0.2097, 0.0), Twist(0.0, 2.6)])
@pytest.mark.parametrize("period", [0.001, 0.05, 0.5, 1.0])
def test_driving_at_top_speed_is_not_a_jump(twist, period):
    track = odometry()
    for i in range(50):
        pose, notices = track.update(
            reading(i * period, step(Pose.at(0.0, 0.0, 0.0), twist, i * period))
        )
        assert notices == []
    assert close(pose, step(START, twist, 49 * period))


def test_a_hole_is_noticed_and_the_robot_is_where_odometry_says():
    track = odometry()
    track.update(reading(0.0, Pose.at(0.0, 0.0, 0.0)))
    pose, notices = track.update(reading(3.0, Pose.at(0.5, 0.0, 0.0)))
    assert kinds(notices) == ["hole"]
    assert close(pose, START.compose(Pose.at(0.5, 0.0, 0.0)))


@pytest.mark.parametrize("gap", [1.1, 8.0, 100.0])
@pytest.mark.parametrize("end", [(0.2, 0.0, 0.0), (1.5, 0.6, 0.4), (0.0, 0.0, 2.0)])
def test_a_driver_that_begins_anew_leaves_the_robot_where_it_is(gap, end):
    """It begins at the origin of its frame, wherever the robot is."""
    track = odometry()
    for i in range(200):
        pose = Pose.at(*(0.005 * i * value for value in end))
        before, _ = track.update(reading(0.05 * i, pose))
    after, notices = track.update(reading(0.05 * 199 + gap, Pose.at(0.0, 0.0, 0.0)))
    assert kinds(notices) == ["hole", "jump"]
    assert close(after, before)
    on, notices = track.update(reading(0.05 * 200 + gap, Pose.at(0.01, 0.0, 0.0)))
    assert notices == []
    assert close(on, before.compose(Pose.at(0.01, 0.0, 0.0)))


def test_poses_are_kept_for_as_long_however_fast_they_come():
    track = odometry()
    for i in range(2001):
        track.update(reading(0.001 * i, Pose.at(0.0002 * i, 0.0, 0.0)))
    pose = track.at(1.0)
    assert pose is not None
    assert close(pose, START.compose(Pose.at(0.2, 0.0, 0.0)), 1e-9)
    assert track.at(-0.1) is None


def test_a_stamp_that_goes_back_is_noticed():
    track = odometry()
    track.update(reading(1.0, Pose.at(0.0, 0.0, 0.0)))
    pose, notices = track.update(reading(0.9, Pose.at(0.01, 0.0, 0.0)))
    assert kinds(notices) == ["backward"]
    assert close(pose, START.compose(Pose.at(0.01, 0.0, 0.0)))


def test_a_stamp_that_is_repeated_is_noticed():
    track = odometry()
    track.update(GOOD)
    pose, notices = track.update(GOOD)
    assert kinds(notices) == ["repeated"]
    assert close(pose, START)


@pytest.mark.parametrize(
    ("degrees", "noticed"), [(0, []), (25, []), (35, ["tilt"]), (90, ["tilt"])]
)
def test_a_robot_that_lies_on_its_side_is_noticed(degrees, noticed):
    half = math.radians(degrees) / 2.0
    track = odometry()
    for message in (GOOD, GOOD._replace(stamp=PERIOD, q_x=math.sin(half), q_w=math.cos(half))):
        pose, notices = track.update(message)
    assert kinds(notices) == noticed
    assert close(pose, START)
