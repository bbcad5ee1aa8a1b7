# SPDX-License-Identifier: Apache-2.0
"""Fake robot and navigator: ros2 launch tbot_gradnav demo.launch.py config:=FILE."""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return both nodes with the same parameter file."""
    shipped = PathJoinSubstitution([FindPackageShare("tbot_gradnav"), "config", "demo.yaml"])
    nodes = [
        Node(
            package="tbot_gradnav",
            executable=name,
            parameters=[LaunchConfiguration("config")],
            output="screen",
        )
        for name in ("fake_robot", "navigator")
    ]
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=shipped, description="parameter file"),
            *nodes,
        ]
    )
