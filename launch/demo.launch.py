# SPDX-License-Identifier: Apache-2.0
"""Fake robot and navigator: ros2 launch tbot_gradnav demo.launch.py config:=FILE rviz:=true."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node, SetParameter
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return both nodes with the same parameter file, and RViz where it is asked for."""
    shipped = PathJoinSubstitution([FindPackageShare("tbot_gradnav"), "config"])
    demo = PathJoinSubstitution([shipped, "demo.yaml"])
    sim_time = LaunchConfiguration("use_sim_time")
    nodes = [
        Node(
            package="tbot_gradnav",
            executable=name,
            parameters=[LaunchConfiguration("config")],
            output="screen",
        )
        for name in ("fake_robot", "navigator")
    ]
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", PathJoinSubstitution([shipped, "tbot_gradnav.rviz"])],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=demo, description="parameter file"),
            DeclareLaunchArgument("rviz", default_value="false", description="start RViz too"),
            DeclareLaunchArgument(
                "use_sim_time",
                default_value="true",
                description="the clock is the fake robot's; it has one where real_time_factor is "
                "not 1",
            ),
            # Both hold where the parameter file does not say otherwise.
            SetParameter("use_sim_time", sim_time),
            SetParameter("publish_tf", True),
            *nodes,
            rviz,
        ]
    )
