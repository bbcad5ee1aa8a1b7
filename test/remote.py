# SPDX-License-Identifier: Apache-2.0
"""A navigator as `ros2 service call`, `ros2 param` and `ros2 topic echo` see it."""

from rcl_interfaces.msg import Parameter
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rcl_interfaces.srv import SetParametersAtomically as SetAtomically
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Remote:
    """Calls services and sets parameters of a navigator from the test's node."""

    def __init__(self, graph, namespace="/"):
        self._graph, self._namespace = graph, namespace
        self._clients = {}
        self.states = []  # in the order in which they were announced
        graph.node.create_subscription(
            String, f"{namespace}state", lambda message: self.states.append(message.data), LATCHED
        )

    @property
    def state(self):
        """The last state announced."""
        return self.states[-1] if self.states else None

    def until(self, state, patience=20.0):
        """Wait for a state."""
        self._graph.until(lambda: self.state == state, f"{state} after {self.states}", patience)

    def trigger(self, name):
        """Call pause, resume or cancel; return success and message."""
        answer = self._call(Trigger, name, Trigger.Request())
        return answer.success, answer.message

    def set_each(self, **changes):
        """Set parameters one by one, as `ros2 param set`; return the refusals, '' for none."""
        request = SetParameters.Request(parameters=_messages(changes))
        answer = self._call(SetParameters, "navigator/set_parameters", request)
        return [result.reason if not result.successful else "" for result in answer.results]

    def set_together(self, changes):
        """Set parameters in one atomic request; return the refusal, '' for none."""
        request = SetAtomically.Request(parameters=_messages(changes))
        result = self._call(SetAtomically, "navigator/set_parameters_atomically", request).result
        return "" if result.successful else result.reason

    def set_one(self, name, value):
        """Set a parameter; return the refusal, '' for none."""
        return self.set_each(**{name: value})[0]

    def get(self, name):
        """Return a parameter's value."""
        request = GetParameters.Request(names=[name])
        values = self._call(GetParameters, "navigator/get_parameters", request).values
        return parameter_value_to_python(values[0])

    def describe(self, names):
        """Return the descriptors of parameters."""
        request = DescribeParameters.Request(names=list(names))
        return self._call(DescribeParameters, "navigator/describe_parameters", request).descriptors

    def _call(self, kind, name, request):
        if name not in self._clients:
            self._clients[name] = self._graph.node.create_client(kind, self._namespace + name)
        client = self._clients[name]
        self._graph.until(client.service_is_ready, name)
        future = client.call_async(request)
        self._graph.until(future.done, f"answer of {name}")
        return future.result()


def _messages(changes):
    return [
        Parameter(name=name, value=RosParameter(name, value=value).get_parameter_value())
        for name, value in changes.items()
    ]
