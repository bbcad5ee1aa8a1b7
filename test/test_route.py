# SPDX-License-Identifier: Apache-2.0
"""Waypoints, pauses and lost odometry, without ROS."""

import math
from dataclasses import replace

import pytest
from arenas import ATTRACTIVE_REPULSIVE, NAVIGATION_FUNCTION, NINE, obstacles

from tbot_gradnav.errors import GradnavError, ParameterError
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.odometry import BadOdometryError, Reading
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.plant import Plant
from tbot_gradnav.settings import MOST_WAYPOINTS, Settings
from tbot_gradnav.unicycle import STOP

PERIOD = 0.05
ROUTE = [-0.4, 0.6, 1.2, -0.9]  # two waypoints among the nine obstacles
START = {"initial_pose": [-3.4, -2.2, 2.0]}


def route(**more):
    return Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, **START, "waypoints": ROUTE, **more})


class Drive:
    """A navigation with the fake robot; each tick is one odometry message."""

    def __init__(self, settings):
        self.navigation, self.now = Navigation(settings), 0.0
        self.plant = Plant(FakeRobotOptions(), settings.start)
        self.path, self.twists, self.words = [], [], []

    def tick(self):
        self.plant.advance(self.now)
        _, twist, notices = self.navigation.update(self.plant.read())
        self.plant.receive(self.now, twist)
        self.path.append((float(self.plant.pose.x), float(self.plant.pose.y)))
        self.twists.append(twist)
        self.words += [notice.text for notice in notices]
        self.now += PERIOD

    def until(self, condition, seconds=120.0):
        for _ in range(round(seconds / PERIOD)):
            self.tick()
            if condition():
                return
        raise AssertionError(f"not within {seconds} s: {self.navigation.state}, {self.words}")

    def first_near(self, x, y, tolerance):
        return next(i for i, p in enumerate(self.path) if math.dist(p, (x, y)) <= tolerance)


@pytest.mark.parametrize("potential", [ATTRACTIVE_REPULSIVE, NAVIGATION_FUNCTION])
@pytest.mark.parametrize("tolerance", [0.05, 0.3])
def test_waypoints_are_passed_in_order_untouched_and_in_one_gear(potential, tolerance):
    drive = Drive(route(**potential, waypoint_tolerance=tolerance))
    drive.until(lambda: drive.navigation.state is State.ARRIVED)
    passed = [drive.first_near(x, y, tolerance) for x, y in (ROUTE[:2], ROUTE[2:])]
    assert passed == sorted(passed)
    assert math.hypot(*drive.path[-1]) <= 0.05
    assert min(drive.navigation.settings.world.clearance(*p) for p in drive.path) > 0.0
    assert len({math.copysign(1.0, t.v) for t in drive.twists if t.v}) == 1
    assert STOP not in drive.twists[:-1]
    assert [w for w in drive.words if "passed" in w] == [
        f"passed waypoint {i} of 2" for i in (1, 2)
    ]


def test_a_goal_with_an_orientation_comes_after_the_waypoints():
    drive = Drive(route(goal=[0.0, 0.0, 1.0], xy_goal_tolerance=0.02))
    drive.until(lambda: drive.navigation.state is State.ARRIVED)
    assert abs(float(drive.plant.pose.theta) - 1.0) <= 0.051


def test_an_obstacle_that_moves_does_not_send_the_robot_back_to_the_first_waypoint():
    drive = Drive(route())
    drive.until(lambda: "passed waypoint 1 of 2" in drive.words)
    moved = {"obstacles.o6.x": -0.5}
    drive.navigation.change(route(**moved))
    drive.until(lambda: drive.navigation.state is State.ARRIVED)
    assert sum("passed" in word for word in drive.words) == 2


def test_other_waypoints_start_a_new_drive():
    drive = Drive(route())
    drive.until(lambda: drive.navigation.state is State.ARRIVED)
    drive.navigation.change(route(waypoints=[0.5, 0.6]))
    drive.until(lambda: drive.navigation.state is State.ARRIVED)
    assert "passed waypoint 1 of 1" in drive.words


@pytest.mark.parametrize(
    ("waypoints", "complaint"),
    [
        ([1.6, 0.2], "inside obstacles.o0"),
        ([9.0, 0.0], "outside the boundary"),
        ([1.0], "n times 2"),
        ([0.0, math.nan], "finite"),
        ([0.0, 0.5] * (MOST_WAYPOINTS + 1), f"at most {MOST_WAYPOINTS}"),
    ],
)
def test_waypoints_where_no_robot_can_be_are_refused(waypoints, complaint):
    with pytest.raises(ParameterError, match="waypoints") as caught:
        route(waypoints=waypoints)
    assert complaint in str(caught.value)


def test_waypoints_without_a_goal_wait_for_one():
    track = Navigation(route(goal=[]))
    assert track.update(Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)).twist is None
    assert track.state is State.IDLE


def test_a_stuck_robot_says_on_which_leg():
    wall = obstacles([(1.0, 0.1 * i - 0.35, 0.04) for i in range(8)])
    settings = Settings.of(
        {"goal": [3.0, 0.0], "waypoints": [2.0, 0.0], **wall, "robot_radius": 0.1}
    )
    drive = Drive(settings)
    drive.until(lambda: drive.navigation.state is State.STUCK)
    assert "from waypoint 1: no progress" in drive.words[-1]


def test_a_pause_outlasts_every_goal_and_the_lack_of_one():
    track = Navigation(replace(route(), waypoints=()))
    track.pause()
    reading = Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert track.update(reading).twist == STOP
    assert track.state is State.PAUSED
    track.change(route(goal=[0.5, 0.5]))
    assert track.update(reading._replace(stamp=0.05)).twist == STOP
    assert track.state is State.PAUSED
    track.resume()
    assert track.update(reading._replace(stamp=0.1)).twist != STOP
    track.pause()
    track.change(route(goal=[]))
    assert track.state is State.PAUSED
    track.change(route(goal=[0.5, 0.5]))
    assert track.update(reading._replace(stamp=0.15)).twist == STOP


def test_a_pause_is_no_lack_of_progress():
    drive = Drive(route())
    drive.until(lambda: drive.now > 2.0)
    drive.navigation.pause()
    drive.until(lambda: drive.now > 60.0)
    drive.navigation.resume()
    drive.until(lambda: drive.navigation.state is State.ARRIVED)


def test_a_drive_can_be_held_before_odometry_comes():
    drive = Drive(route())
    drive.navigation.pause()
    assert drive.navigation.state is State.PAUSED
    drive.until(lambda: drive.now > 2.0)
    assert set(drive.twists) == {STOP}
    drive.navigation.resume()
    drive.until(lambda: drive.navigation.state is State.ARRIVED)


def test_what_makes_no_sense_is_refused_with_the_state():
    track = Navigation(Settings.of({}))
    with pytest.raises(GradnavError, match="no odometry"):
        track.resume()
    track.pause()
    with pytest.raises(GradnavError, match="paused already"):
        track.pause()


def test_bad_odometry_is_no_odometry_until_a_good_one_comes():
    track, good = Navigation(route()), Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert track.state is State.NO_ODOMETRY
    track.update(good)
    assert track.state is State.DRIVING
    with pytest.raises(BadOdometryError):
        track.update(good._replace(x=math.nan))
    assert track.state is State.NO_ODOMETRY
    track.update(good._replace(stamp=0.05))
    assert track.state is State.DRIVING
    track.lose_odometry()
    assert track.state is State.NO_ODOMETRY
