# SPDX-License-Identifier: Apache-2.0
"""Records a drive: ros2 launch tbot_gradnav bag.launch.py out:=FOLDER; see gradnav replay."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

OF_THE_ROBOT = ("odom", "cmd_vel", "goal_pose", "waypoints", "scan", "state", "status")
OF_ALL = ("/parameter_events", "/diagnostics", "/tf", "/tf_static", "/clock")


def generate_launch_description() -> LaunchDescription:
    """Return `ros2 bag record` of what goes in and out of the navigator."""
    topics = [[LaunchConfiguration("namespace"), "/", topic] for topic in OF_THE_ROBOT]
    record = ExecuteProcess(
        cmd=[
            *("ros2", "bag", "record", "--output"),
            LaunchConfiguration("out"),
            *("--topics", *topics, *OF_ALL),
        ],
        output="screen",
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("out", description="folder of the new bag"),
            DeclareLaunchArgument(
                "namespace", default_value="", description="of the robot, with its slash: /tb1"
            ),
            record,
        ]
    )
