# SPDX-License-Identifier: Apache-2.0
"""The navigator on a robot that is already up: ros2 launch tbot_gradnav navigator.launch.py ..."""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return the navigator with its parameter file."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", description="parameter file"),
            DeclareLaunchArgument("namespace", default_value="", description="of the robot"),
            Node(
                package="tbot_gradnav",
                executable="navigator",
                namespace=LaunchConfiguration("namespace"),
                parameters=[LaunchConfiguration("config")],
                output="screen",
            ),
        ]
    )
