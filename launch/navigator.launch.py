# SPDX-License-Identifier: Apache-2.0
"""The navigator on a robot that is already up: ros2 launch tbot_gradnav navigator.launch.py ..."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, SetParameter

REMAPPED = ("odom", "cmd_vel", "scan", "goal_pose")
SETTABLE = {  # where the parameter file does not say otherwise
    "use_sim_time": "the clock is /clock, as in Gazebo",
    "publish_tf": "publish where odometry is in the world; not if AMCL or SLAM does",
}


def generate_launch_description() -> LaunchDescription:
    """Return the navigator with its parameter file."""
    navigator = Node(
        package="tbot_gradnav",
        executable="navigator",
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("config")],
        remappings=[(topic, LaunchConfiguration(topic)) for topic in REMAPPED],
        output="screen",
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", description="parameter file"),
            DeclareLaunchArgument("namespace", default_value="", description="of the robot"),
            *(
                DeclareLaunchArgument(topic, default_value=topic, description="name of the topic")
                for topic in REMAPPED
            ),
            *(
                DeclareLaunchArgument(name, default_value="false", description=about)
                for name, about in SETTABLE.items()
            ),
            *(SetParameter(name, LaunchConfiguration(name)) for name in SETTABLE),
            navigator,
        ]
    )
