# SPDX-License-Identifier: Apache-2.0
"""The launch files, where launch can be imported; it is not to be had from PyPI."""

import os
import signal
import subprocess
import sys

import pytest
from conftest import ROOT, heed_signals

pytest.importorskip("launch", reason="needs ROS 2 launch")
pytest.importorskip("launch_ros", reason="needs ROS 2 launch")

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.launch_context import LaunchContext
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.utilities import perform_substitutions
from remote import Remote
from robot import Robot

FOLDER = ROOT / "launch"
LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
arguments = [word.split(":=") for word in sys.argv[2:]]
source = PythonLaunchDescriptionSource(sys.argv[1])
service = LaunchService()
included = IncludeLaunchDescription(source, launch_arguments=arguments)
service.include_launch_description(LaunchDescription([included]))
sys.exit(service.run())
"""


@pytest.fixture
def start(graph, tmp_path):
    """Give a function that launches a file, as `ros2 launch` does, and returns what ends it."""
    try:
        get_package_prefix("tbot_gradnav")
    except PackageNotFoundError:
        pytest.skip("the package is not installed where the ament index sees it")
    log = tmp_path / "launch.log"

    def start(name, *arguments):
        with log.open("w") as file:
            process = subprocess.Popen(
                [sys.executable, "-c", LAUNCH, FOLDER / name, *arguments],
                start_new_session=True, preexec_fn=heed_signals, stdout=file, stderr=file,
                env=os.environ | {"ROS_DOMAIN_ID": str(graph.domain)},
            )  # fmt: skip

        def end():
            process.send_signal(signal.SIGINT)
            assert process.wait(20.0) == 0
            words = log.read_text()
            assert "Traceback" not in words
            return words

        return end

    return start


def entities(name):
    source = PythonLaunchDescriptionSource(str(FOLDER / name))
    return source.try_get_launch_description_without_context().entities


def test_every_argument_is_described():
    for file in FOLDER.glob("*.launch.py"):
        arguments = [e for e in entities(file.name) if isinstance(e, DeclareLaunchArgument)]
        assert arguments
        assert all(argument.description for argument in arguments)


def test_demo_drives_to_the_goal_and_ends_cleanly(graph, start):
    remote = Remote(graph)
    end = start("demo.launch.py")
    remote.until("arrived", patience=40.0)
    words = end()
    assert words.count("process started") == 2  # no RViz unless it is asked for
    assert words.count("finished cleanly") == 2


def test_navigator_has_its_namespace_topics_and_file(graph, start, parameter_file):
    robot = Robot(graph, 0.0, 0.0, 0.0, namespace="/tb1/", odom="odometry", cmd_vel="drive")
    remote = Remote(graph, "/tb1/")
    file = parameter_file("goal: [0.5, 0]\nuse_sim_time: false")
    end = start(
        "navigator.launch.py", f"config:={file}", "namespace:=tb1", "odom:=odometry",
        "cmd_vel:=drive", "use_sim_time:=true",
    )  # fmt: skip
    remote.until("arrived")
    assert robot.distance(0.5, 0.0) <= 0.05
    assert remote.get("use_sim_time") is False  # the file has the last word
    end()


def test_bag_records_what_a_replay_needs():
    (record,) = [e for e in entities("bag.launch.py") if isinstance(e, ExecuteProcess)]
    context = LaunchContext()
    context.launch_configurations.update({"out": "drive", "namespace": "/tb1"})
    command = [perform_substitutions(context, word) for word in record.cmd]
    assert command[:3] == ["ros2", "bag", "record"]
    topics = command[command.index("--topics") + 1 :]
    assert {"/tb1/odom", "/tb1/cmd_vel", "/tb1/goal_pose"} <= set(topics)
    assert command[command.index("--output") + 1] == "drive"
