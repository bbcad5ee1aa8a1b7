# SPDX-License-Identifier: Apache-2.0
"""A TurtleBot3 Burger for those without one: the unicycle behind cmd_vel and odom."""

import math
import sys
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import PoseStamped, Quaternion, TransformStamped, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState, LaserScan
from std_srvs.srv import Trigger

from tbot_gradnav import ros
from tbot_gradnav.fake_lidar import LIDARS, SWEEP_PERIOD, FakeLidar
from tbot_gradnav.odometry import Reading
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.parameters import parameters_of
from tbot_gradnav.plant import Plant
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import Pose, Twist, quaternion

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # not to be had from PyPI; without it there is no tf
    TFMessage = None

PARAMETERS = {*parameters_of(FakeRobotOptions), "initial_pose", "world_frame", "cmd_vel_type"}


class FakeRobot(Node):
    """Integrates cmd_vel along exact arcs and publishes what a TurtleBot3 Burger would.

    Publishes odom, joint_states, tf (where tf2_msgs is installed), /clock (where the real time
    factor is not 1), ground_truth, the pose in the world that only a fake robot knows, and, while
    somebody listens, scan: what a lidar would see of the file's obstacles and boundary. Raises
    GradnavError for parameters that are not allowed.
    """

    def __init__(self, **node_arguments: Any) -> None:
        super().__init__(
            "fake_robot",
            automatically_declare_parameters_from_overrides=True,
            **node_arguments,
        )
        configuration = ros.declare(self, PARAMETERS)
        self._options = configuration.fake_robot
        self._world_frame = configuration.navigator.world_frame
        self._plant = Plant(self._options, configuration.settings.start)
        self._lidar = _lidar(self._options, configuration.settings)
        self._next_sweep = 0.0  # [s] when the lidar has turned once more
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._wall_start = self._steady.now()
        self._start = Clock(clock_type=ClockType.SYSTEM_TIME).now()
        self._subscribe(configuration.navigator.cmd_vel_type)
        self._odom = self.create_publisher(OdometryMessage, "odom", 10)
        self._truth = self.create_publisher(PoseStamped, "ground_truth", 10)
        self._joints = self.create_publisher(JointState, "joint_states", 10)
        self._scan = self.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self._tf = TFMessage and self.create_publisher(TFMessage, "/tf", 100)
        self._clock_publisher = (
            self.create_publisher(ClockMessage, "/clock", 10)
            if self._options.real_time_factor != 1.0
            else None
        )
        self.create_service(Trigger, "reset_odometry", self._reset_odometry)
        period = 1.0 / (self._options.rate * self._options.real_time_factor)
        self.create_timer(period, self._tick, clock=self._steady)
        x, y, yaw = configuration.settings.initial_pose
        self.get_logger().info(f"at x {x:g} m, y {y:g} m, yaw {yaw:g} rad")

    def _subscribe(self, kind: str) -> None:
        """Listen on cmd_vel; as Twist unless told otherwise, like turtlebot3_fake_node."""
        if kind == "twist_stamped":
            self.create_subscription(
                TwistStamped, "cmd_vel", lambda message: self._on_command(message.twist), 10
            )
        else:
            self.create_subscription(TwistMessage, "cmd_vel", self._on_command, 10)

    def _on_command(self, message: TwistMessage) -> None:
        v, omega = message.linear.x, message.angular.z
        if math.isfinite(v) and math.isfinite(omega):
            self._plant.receive(self._elapsed(), Twist(v, omega))
        else:
            self.get_logger().error(f"ignored a command that is not finite: ({v}, {omega})")

    def _elapsed(self) -> float:
        """Return the time [s] since the start, at the real time factor."""
        wall = float((self._steady.now() - self._wall_start).nanoseconds) * 1e-9
        return wall * self._options.real_time_factor

    def _tick(self) -> None:
        now = self._elapsed()
        self._plant.advance(now)
        stamp = Time(nanoseconds=self._start.nanoseconds + round(now * 1e9)).to_msg()
        if self._clock_publisher is not None:
            self._clock_publisher.publish(ClockMessage(clock=stamp))
        reading = self._plant.read()
        self._publish_truth(stamp)
        self._publish_joints(stamp)
        if self._tf:
            self._publish_tf(stamp, reading)
        self._publish_odometry(stamp, reading)
        if now >= self._next_sweep:
            self._next_sweep = now - now % SWEEP_PERIOD + SWEEP_PERIOD
            if self._scan.get_subscription_count() > 0:
                self._publish_scan(stamp)

    def _publish_odometry(self, stamp: Any, reading: Reading) -> None:
        message = OdometryMessage()
        message.header.stamp = stamp
        message.header.frame_id, message.child_frame_id = "odom", "base_footprint"
        message.pose.pose.position.x, message.pose.pose.position.y = reading.x, reading.y
        message.pose.pose.orientation = Quaternion(z=reading.q_z, w=reading.q_w)
        v, omega = self._plant.twist
        message.twist.twist.linear.x, message.twist.twist.angular.z = float(v), float(omega)
        self._odom.publish(message)

    def _publish_truth(self, stamp: Any) -> None:
        pose: Pose = self._plant.pose
        message = PoseStamped()
        message.header.stamp, message.header.frame_id = stamp, self._world_frame
        message.pose.position.x, message.pose.position.y = float(pose.x), float(pose.y)
        q_z, q_w = quaternion(float(pose.theta))
        message.pose.orientation = Quaternion(z=q_z, w=q_w)
        self._truth.publish(message)

    def _publish_joints(self, stamp: Any) -> None:
        message = JointState()
        message.header.stamp = stamp
        message.name = ["wheel_left_joint", "wheel_right_joint"]
        message.position = list(self._plant.wheels)
        self._joints.publish(message)

    def _publish_scan(self, stamp: Any) -> None:
        sweep = self._lidar.sweep(0.0, self._plant.pose)
        message = LaserScan()
        message.header.stamp, message.header.frame_id = stamp, "base_scan"
        message.angle_min, message.angle_increment = sweep.angle_min, sweep.angle_increment
        message.angle_max = sweep.angle_min + (sweep.ranges.size - 1) * sweep.angle_increment
        message.range_min, message.range_max = sweep.range_min, sweep.range_max
        message.scan_time = SWEEP_PERIOD
        message.ranges = sweep.ranges.tolist()
        self._scan.publish(message)

    def _publish_tf(self, stamp: Any, reading: Reading) -> None:
        transform = TransformStamped()
        transform.header.stamp = stamp
        transform.header.frame_id, transform.child_frame_id = "odom", "base_footprint"
        transform.transform.translation.x = reading.x
        transform.transform.translation.y = reading.y
        transform.transform.rotation = Quaternion(z=reading.q_z, w=reading.q_w)
        self._tf.publish(TFMessage(transforms=[transform]))

    def _reset_odometry(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._plant.reset_odometry()
        response.success, response.message = True, "odometry reset"
        return response


def _lidar(options: FakeRobotOptions, settings: Settings) -> FakeLidar:
    return FakeLidar(
        settings.world,
        settings.lidar_x,
        LIDARS[options.lidar],
        options.range_noise,
        options.range_dropout,
        options.seed,
    )


def main(arguments: Sequence[str] = sys.argv) -> int:
    """Run the fake robot until a signal; return the exit status."""
    return ros.run(FakeRobot, lambda robot: None, arguments)


if __name__ == "__main__":
    sys.exit(main())
