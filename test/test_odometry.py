# SPDX-License-Identifier: Apache-2.0
"""Odometry as it may come, what the navigation makes of it, and the robot that fakes it."""

import itertools
import math

import numpy as np
import pytest
from arenas import ATTRACTIVE_REPULSIVE, NINE
from hypothesis import given
from hypothesis import strategies as st

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.limits import Limits
from tbot_gradnav.navigation import STUCK_TIME, Navigation, State
from tbot_gradnav.odometry import BadOdometryError, GoalPose, Odometry, Reading
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.plant import Plant, driven
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import STOP, Pose, Twist, quaternion, step

PERIOD = 0.05  # [s]
START = Pose.at(1.0, -2.0, 0.5)
POSES = st.builds(Pose.at, st.floats(-10, 10), st.floats(-10, 10), st.floats(-4, 4))
GOOD = Reading(0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0)


def close(one, other, tolerance=1e-9):
    return np.allclose(np.array(one, float), np.array(other, float), rtol=0.0, atol=tolerance)


def reading(stamp, pose):
    """Return the odometry message of a pose in the odometry frame."""
    q_z, q_w = quaternion(float(pose.theta))
    return Reading(stamp, float(pose.x), float(pose.y), 0.0, 0.0, q_z, q_w)


def decoded(message):
    return Pose.at(message.x, message.y, 2.0 * math.atan2(message.q_z, message.q_w))


def odometry():
    return Odometry(START, Limits())


def kinds(notices):
    return [notice.kind for notice in notices]


def driving(twist, origin=Pose.at(0.0, 0.0, 0.0)):  # noqa: B008 (a constant)
    """Yield the messages of a robot that keeps a twist, from the origin of its odometry on."""
    for i in itertools.count():
        yield reading(i * PERIOD, step(origin, twist, i * PERIOD))


# From messages to the pose in the world


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


# Navigation


def navigation(**parameters):
    start = {"initial_pose": [-3.4, -2.2, 2.0]}
    return Navigation(Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, **start, **parameters}))


TINY, HUGE, UNREAL = (1e-9, 5e-324, 1e-300), (1e9, 1e308, -1e308), (math.nan, math.inf, -math.inf)
AWKWARD = np.array([0.0, -0.0, 1.0, -1.0, 0.5, 1e6, -1e6, *TINY, *HUGE, *UNREAL])


def garbage(n, seed):
    """Yield n messages of awkward and of ordinary numbers, some of them good."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        values = rng.normal(scale=3.0, size=7)
        awkward = rng.random(7) < rng.choice([0.0, 0.1, 0.5])
        values[awkward] = rng.choice(AWKWARD, size=awkward.sum())
        yield Reading(*values.tolist())


def test_10000_messages_of_garbage_end_in_a_command_within_the_limits_or_a_bad_odometry():
    drive, counts = Limits(), {"commands": 0, "bad": 0}
    track = navigation()
    for message in garbage(10_000, seed=0):
        try:
            v, omega = track.update(message).twist
        except BadOdometryError:
            counts["bad"] += 1
            continue
        counts["commands"] += 1
        assert math.isfinite(v)
        assert math.isfinite(omega)
        assert abs(v) <= drive.v
        assert abs(omega) <= drive.omega
        assert abs(v) + 0.08 * abs(omega) <= drive.wheel * (1.0 + 1e-12)
        if track.state is not State.DRIVING:
            track.restart()
    assert min(counts.values()) > 1000


def test_without_a_goal_there_is_no_command():
    track = Navigation(Settings.of({}))
    assert track.update(GOOD).twist is None
    assert track.state is State.IDLE


def test_a_robot_that_arrived_stays_put_and_says_so_once():
    track = navigation(initial_pose=[0.02, 0.0, 0.0])
    told = []
    for place in (0.0, 0.08, 0.3):  # pushed away afterwards, slowly
        outcome = track.update(reading(place * 20.0, Pose.at(place, 0.0, 0.0)))
        assert outcome.twist == STOP
        told += [kind for kind in kinds(outcome.notices) if kind == "arrived"]
    assert track.state is State.ARRIVED
    assert told == ["arrived"]


def test_a_new_goal_starts_a_new_drive_from_where_the_robot_is():
    track = navigation(initial_pose=[0.0, 0.0, 0.0])
    assert track.update(GOOD).twist == STOP
    track.change(Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "goal": [0.5, 0.0]}))
    assert track.state is State.DRIVING
    assert track.update(GOOD._replace(stamp=PERIOD)).twist.v > 0.0


def test_other_settings_for_the_same_goal_do_not_forget_the_arrival():
    track = navigation(initial_pose=[0.0, 0.0, 0.0])
    track.update(GOOD)
    track.change(Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "k_v": 0.4}))
    assert track.state is State.ARRIVED


def test_the_gear_is_kept_for_a_whole_drive():
    """A robot turned round by hand after it set out forward does not change to backward."""
    track = navigation(initial_pose=[0.5, 0.0, math.pi])
    assert track.update(reading(0.0, Pose.at(0.0, 0.0, 0.0))).twist.v > 0.0
    half_round = [Pose.at(0.0, 0.0, angle) for angle in np.arange(0.0, math.pi, 0.2)]
    for i, pose in enumerate(half_round):
        outcome = track.update(reading((1 + i) * 0.2, pose))
        assert outcome.twist.v >= 0.0
        assert outcome.notices == []


def standing(track, seconds, since=0.0):
    """Feed a navigation the odometry of a robot that does not move; return the last outcome."""
    for i in range(round(seconds / PERIOD) + 1):
        outcome = track.update(GOOD._replace(stamp=since + i * PERIOD))
    return outcome


def test_a_robot_that_gets_nowhere_is_stuck_and_stands():
    track = navigation()
    assert standing(track, STUCK_TIME - 1.0).twist != STOP
    assert track.state is State.DRIVING
    assert standing(track, 2.0, since=STUCK_TIME - 1.0).twist == STOP
    assert track.state is State.STUCK


def test_a_robot_that_is_stuck_says_so_once_and_in_one_line():
    track, told = navigation(), []
    for i in range(1000):
        told += track.update(GOOD._replace(stamp=i * PERIOD)).notices
    assert kinds(told) == ["stuck"]
    assert len(told[0].text.splitlines()) == 1


def test_a_robot_that_was_stuck_tries_again_with_other_settings():
    track = navigation()
    standing(track, STUCK_TIME + 1.0)
    other = {**NINE, **ATTRACTIVE_REPULSIVE, "k_v": 0.4, "initial_pose": [-3.4, -2.2, 2.0]}
    track.change(Settings.of(other))
    assert track.state is State.DRIVING
    assert standing(track, 1.0, since=STUCK_TIME + 1.0).twist != STOP


def test_time_without_odometry_is_not_time_spent_stuck():
    track = navigation()
    for i in range(10):
        assert standing(track, 3.0, since=i * 100.0).twist != STOP


# The fake robot


def plant(initial=START, **options):
    return Plant(FakeRobotOptions(**options), initial)


def test_a_command_moves_the_robot_along_its_arc():
    robot, twist = plant(), Twist(0.1, 0.5)
    robot.receive(0.0, twist)
    for i in range(41):
        robot.advance(i * PERIOD)
    assert close(robot.pose, step(START, twist, 2.0))
    assert close(robot.twist, twist)


@given(
    commands=st.lists(
        st.tuples(st.floats(0.0, 0.5), st.floats(-0.2, 0.2), st.floats(-2, 2)), max_size=20
    )
)
def test_without_noise_and_drift_odometry_is_the_truth(commands):
    robot, now = plant(), 0.0
    for dt, v, omega in commands:
        robot.receive(now, Twist(v, omega))
        now += dt
        robot.advance(now)
        assert close(START.compose(decoded(robot.read())), robot.pose)
        assert robot.read().stamp == pytest.approx(now)


@pytest.mark.parametrize(
    ("commanded", "expected"),
    [
        (Twist(0.019, 0.019), Twist(0.01, 0.01)),
        (Twist(-0.019, -0.019), Twist(-0.01, -0.01)),
        (Twist(0.009, -0.009), Twist(0.0, 0.0)),
        (Twist(0.125, 0.0), Twist(0.12, 0.0)),
        (Twist(5.0, 0.0), Twist(0.2108, 0.0)),
        (Twist(0.0, -9.0), Twist(0.0, -2.635)),
        (Twist(1e300, -1e300), Twist(0.2108, -2.635)),
    ],
)
def test_the_driver_cuts_towards_zero_and_clamps(commanded, expected):
    assert close(driven(commanded), expected, 1e-12)


def test_with_quirks_the_robot_drives_what_the_driver_leaves():
    robot = plant(driver_quirks=True)
    robot.receive(0.0, Twist(0.019, -0.519))
    robot.advance(1.0)
    assert close(robot.twist, Twist(0.01, -0.51))


@pytest.mark.parametrize(
    ("v", "moves"), [(0.2, True), (0.209, True), (0.2108, False), (5.0, False)]
)
def test_a_wheel_command_above_the_motors_limit_is_ignored(v, moves):
    robot = plant(driver_quirks=True)
    robot.receive(0.0, Twist(v, 0.0))
    robot.advance(1.0)
    assert (robot.twist.v > 0.0) == moves


def test_a_wheel_whose_command_is_ignored_keeps_its_speed():
    robot = plant(driver_quirks=True)
    robot.receive(0.0, Twist(0.1, 0.0))
    robot.advance(1.0)
    robot.receive(1.0, Twist(0.2, 0.5))  # left 0.16, right 0.24 m/s
    robot.advance(2.0)
    left, right = (robot.twist.v + side * 0.08 * robot.twist.omega for side in (-1.0, 1.0))
    assert (left, right) == (pytest.approx(0.16), pytest.approx(0.1))


def test_no_command_within_the_default_limits_is_ignored():
    rng = np.random.default_rng(0)
    for v, omega in rng.normal(scale=[0.3, 3.0], size=(300, 2)):
        robot, twist = plant(driver_quirks=True), Limits()(v, omega)
        robot.receive(0.0, twist)
        robot.advance(1.0)
        assert close(robot.twist, driven(twist))


def test_a_command_takes_effect_when_its_latency_is_over():
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_latency=0.3)
    robot.receive(0.0, Twist(0.1, 0.0))
    robot.advance(0.25)
    assert robot.pose.x == 0.0
    robot.advance(1.3)
    assert robot.pose.x == pytest.approx(0.1)


def test_every_command_is_late_by_the_same():
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_latency=0.3)
    for i in range(10):
        robot.receive(0.1 * i, Twist(0.01 * i, 0.0))
    robot.advance(1.3)
    assert robot.pose.x == pytest.approx(sum(0.1 * 0.01 * i for i in range(10)))


@pytest.mark.parametrize("tick", [0.01, 0.05, 10.0])
def test_without_commands_the_robot_stops_after_its_timeout(tick):
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_timeout=0.5)
    robot.receive(0.0, Twist(0.1, 0.0))
    for i in range(1 + round(10.0 / tick)):
        robot.advance(i * tick)
    assert robot.pose.x == pytest.approx(0.05)
    assert close(robot.twist, STOP)


@pytest.mark.parametrize("latency", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("tick", [0.05, 10.0])
def test_it_stops_after_its_timeout_however_late_the_last_command_takes_effect(latency, tick):
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_timeout=0.5, command_latency=latency)
    robot.receive(0.0, Twist(0.1, 0.0))
    for i in range(1 + round(10.0 / tick)):
        robot.advance(i * tick)
    assert close(robot.twist, STOP)


def test_commands_that_keep_coming_keep_it_going():
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_timeout=0.5)
    for i in range(41):
        robot.advance(i * PERIOD)
        robot.receive(i * PERIOD, Twist(0.1, 0.0))
    assert robot.pose.x == pytest.approx(0.2)


def test_without_a_timeout_the_last_command_holds():
    robot = plant(Pose.at(0.0, 0.0, 0.0))
    robot.receive(0.0, Twist(0.1, 0.0))
    robot.advance(100.0)
    assert robot.pose.x == pytest.approx(10.0)


def noisy(seed):
    """Return 500 messages of a noisy robot that drives, and its true poses."""
    robot = plant(
        seed=seed, position_noise=0.01, heading_noise=0.03, odometry_drift=0.05, initial=START
    )
    robot.receive(0.0, Twist(0.1, 0.2))
    messages, truth = [], []
    for i in range(500):
        robot.advance(i * PERIOD)
        messages.append(robot.read())
        truth.append(robot.pose)
    return messages, truth


def test_noise_is_repeatable_by_its_seed():
    assert noisy(7) == noisy(7)
    assert noisy(7)[0] != noisy(8)[0]


def test_noise_and_drift_spoil_the_odometry_only():
    _, truth = noisy(7)
    assert close(truth[-1], step(START, Twist(0.1, 0.2), 499 * PERIOD))


def test_noise_is_as_large_as_its_standard_deviation():
    robot = plant(position_noise=0.01, heading_noise=0.03)
    still = [decoded(robot.read()) for _ in range(2000)]
    for values, expected in (
        ([pose.x for pose in still], 0.01),
        ([pose.y for pose in still], 0.01),
        ([pose.theta for pose in still], 0.03),
    ):
        assert np.mean(values) == pytest.approx(0.0, abs=5.0 * expected / math.sqrt(2000))
        assert np.std(values) == pytest.approx(expected, rel=0.1)


def test_the_wheels_turn_as_far_as_their_rims_roll():
    robot = plant()
    robot.receive(0.0, Twist(0.1, 0.5))
    robot.advance(3.0)
    left, right = (0.033 * turned for turned in robot.wheels)
    assert (left + right) / 2.0 == pytest.approx(0.3)
    assert (right - left) / 0.16 == pytest.approx(1.5)


def test_resetting_the_odometry_moves_the_odometry_only():
    robot = plant()
    robot.receive(0.0, Twist(0.1, 0.5))
    robot.advance(3.0)
    before = robot.pose
    robot.reset_odometry()
    assert close(robot.pose, before)
    assert close(decoded(robot.read()), Pose.at(0.0, 0.0, 0.0))


# Both together

HARDSHIPS = {
    "ideal": {},
    "quirks": {"driver_quirks": True},
    "latency": {"driver_quirks": True, "command_latency": 0.3},
    "noise": {"driver_quirks": True, "position_noise": 0.01, "heading_noise": 0.03},
}


def drive(settings, options, seconds=200.0, reset_at=-1.0):
    """Drive the fake robot; return the true poses until the navigation says it arrived."""
    track, robot, truth = Navigation(settings), Plant(options, settings.start), []
    for i in range(round(seconds / PERIOD)):
        robot.advance(i * PERIOD)
        truth.append(robot.pose)
        if i == round(reset_at / PERIOD):
            robot.reset_odometry()
        robot.receive(i * PERIOD, track.update(robot.read()).twist)
        if track.state is State.ARRIVED:
            return truth
        if track.state is State.STUCK:
            break
    raise AssertionError(f"it did not arrive but is {track.state}: {robot.pose} after {i} periods")


def is_home(settings, pose, tolerance):
    return math.dist((pose.x, pose.y), settings.goal) <= tolerance


@pytest.mark.parametrize("options", HARDSHIPS.values(), ids=HARDSHIPS.keys())
def test_the_fake_robot_is_brought_home_untouched(options):
    settings = Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "initial_pose": [-3.4, -2.2, 2.0]})
    truth = drive(settings, FakeRobotOptions(**options))
    assert is_home(settings, truth[-1], 0.1)
    x, y = np.array([pose[:2] for pose in truth], float).T
    assert settings.world.clearance(x, y).min() > 0.0


def test_a_reset_of_the_odometry_on_the_way_costs_no_more_than_one_period_of_motion():
    settings = Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "initial_pose": [-3.4, -2.2, 2.0]})
    truth = drive(settings, FakeRobotOptions(), reset_at=8.0)
    at_reset = truth[round(8.0 / PERIOD)]
    to_go = math.hypot(at_reset.x, at_reset.y)
    lost = PERIOD * (settings.limits.v + settings.limits.omega * to_go)
    assert is_home(settings, truth[-1], settings.xy_goal_tolerance + lost)


SLOW = {
    "gains of the paper": {"k_v": 0.1, "k_omega": 0.5, "limits.wheel_floor": 0.0},
    "crawling robot": {"limits.v": 0.009, "limits.wheel": 0.009, "limits.wheel_floor": 0.0},
}


@pytest.mark.parametrize("slow", SLOW.values(), ids=SLOW.keys())
def test_a_robot_that_is_slow_but_on_its_way_is_not_stuck(slow):
    start = {"goal": [0.0, 0.0], "initial_pose": [0.5, 0.0, 3.0], "xy_goal_tolerance": 0.02}
    law = {"law": "position", "speed_shaping": "exponential"}
    settings = Settings.of({**start, **law, **slow})
    assert is_home(settings, drive(settings, FakeRobotOptions())[-1], 0.02)


@pytest.mark.parametrize("law", ["position", "heading", "descent"])
@pytest.mark.parametrize("auto_reverse", [True, False], ids=["either_way", "one_way"])
def test_the_fake_robot_with_quirks_arrives_though_it_faces_exactly_away(law, auto_reverse):
    """The driver cuts turning speeds below 0.01 rad/s to zero."""
    settings = Settings.of(
        {
            "law": law,
            "auto_reverse": auto_reverse,
            "potential": "quadratic",
            "goal": [0.0, 0.0],
            "initial_pose": [1.0, 0.0, 0.0],
        }
    )
    truth = drive(settings, FakeRobotOptions(driver_quirks=True))
    assert is_home(settings, truth[-1], 0.05)
