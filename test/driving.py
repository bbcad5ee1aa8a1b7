# SPDX-License-Identifier: Apache-2.0
"""Fake robot and navigation in one loop without ROS, as fast as they go."""

from typing import NamedTuple

import numpy as np

from tbot_gradnav.fake_lidar import LIDARS, SWEEP_PERIOD, FakeLidar
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.odometry import BadOdometryError
from tbot_gradnav.plant import Plant


class Drive(NamedTuple):
    """How a drive ended: state, robot's time [s], smallest true clearance [m], notices."""

    state: State
    time: float
    clearance: float
    distance: float
    notices: list
    path: np.ndarray


def drive(configuration, time_limit=200.0, worlds=None):
    """Drive once; `worlds` gives the world, true size apart, at a time [s]: it may move."""
    settings, options = configuration.settings, configuration.fake_robot
    plant = Plant(options, settings.start)
    navigation = Navigation(settings)
    noise = options.range_noise, options.range_dropout
    lidar = FakeLidar(settings.world, settings.lidar_x, LIDARS[options.lidar], *noise, options.seed)
    period, next_sweep, nearest, notices, path = 1.0 / options.rate, 0.0, np.inf, [], []
    for tick in range(round(time_limit / period)):
        now = tick * period
        plant.advance(now)
        world = worlds(now) if worlds else settings.world
        x, y = float(plant.pose.x), float(plant.pose.y)
        path.append((x, y))
        nearest = min(nearest, float(world.clearance(x, y)))
        if now >= next_sweep and navigation.settings.chosen_potential.looks:
            next_sweep += SWEEP_PERIOD
            lidar.see_in(world)
            navigation.see(lidar.sweep(now, plant.pose))
        try:
            _, twist, words = navigation.update(plant.read()._replace(stamp=now))
        except BadOdometryError:
            continue
        notices += words
        if navigation.state in (State.ARRIVED, State.STUCK) or nearest < 0.0:
            break
        plant.receive(now, twist)
    goal_x, goal_y = settings.world.goal
    distance = float(np.hypot(x - goal_x, y - goal_y))
    return Drive(navigation.state, now, nearest, distance, notices, np.array(path).T)
