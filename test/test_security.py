# SPDX-License-Identifier: Apache-2.0
"""The SROS2 policy allows what the nodes do on the graph, and nothing more."""

from importlib.util import find_spec
from xml.etree import ElementTree

import pytest
from conftest import CONFIG

pytest.importorskip("rclpy", reason="needs ROS 2")

from geometry_msgs.msg import Twist
from remote import Remote

POLICY = ElementTree.parse(CONFIG / "sros2_policy.xml").getroot()  # noqa: S314 (our own file)
HERE = "/secured"  # a namespace that no node killed by another test is still listed in
IN_IT = ["--ros-args", "-r", f"__ns:={HERE}"]
SIM_TIME = [*IN_IT, "-p", "use_sim_time:=true"]


def allowed(node, kind, qualifier):
    """Return the names that a node's profile allows, as they are on the graph."""
    (profile,) = POLICY.findall(f".//profile[@node='{node}']")
    blocks = profile.findall(f"{kind}s[@{qualifier}='ALLOW']")
    names = [item.text for block in blocks for item in block.findall(kind)]
    assert len(names) == len(set(names))
    prefixes = {"/": "", "~": f"{HERE}/{node}"}
    return {
        prefixes[name[0]] + name.lstrip("~") if name[0] in prefixes else f"{HERE}/{name}"
        for name in names
    }


class Uses:
    """All that a node is ever seen to use of the graph: published, subscribed, served, called."""

    def __init__(self, graph, name):
        self._graph, self._name = graph, name
        self.names = [set(), set(), set(), set()]
        listed = graph.node.get_node_names_and_namespaces
        graph.until(lambda: (name, HERE) in listed(), name)

    def look(self):
        """Take note of what the node uses now."""
        node = self._graph.node
        queries = (
            node.get_publisher_names_and_types_by_node,
            node.get_subscriber_names_and_types_by_node,
            node.get_service_names_and_types_by_node,
            node.get_client_names_and_types_by_node,
        )
        for names, query in zip(self.names, queries, strict=True):
            names |= {name for name, _ in query(self._name, HERE)}
        return True

    def hears(self, topic):
        """Return whether the node has ever subscribed a topic."""
        return self.look() and topic in self.names[1]

    def check(self, published=(), subscribed=()):
        """Compare with the policy, but for names that cannot show up here."""
        # The navigator uses tf only with publish_tf and while a goal waits for its frame.
        tf_shows = self._name != "navigator" and find_spec("tf2_msgs")
        absent = set() if tf_shows else {"/tf", "/tf_static"}
        expected = [
            allowed(self._name, "topic", "publish") - absent - set(published),
            allowed(self._name, "topic", "subscribe") - absent - set(subscribed),
            allowed(self._name, "service", "reply"),
            allowed(self._name, "service", "request"),
        ]
        kinds = [*zip(self.names, expected, strict=True)]
        self._graph.until(lambda: self.look() and all(e <= n for n, e in kinds), f"all of {kinds}")
        self._graph.spin(0.5)  # for what might come besides
        self.look()
        assert self.names == expected


def test_navigator(graph):
    """Which topics it hears depends on its potential, so it is given each in turn."""
    graph.start("navigator", *SIM_TIME)
    uses, remote = Uses(graph, "navigator"), Remote(graph, f"{HERE}/")
    for potential in ["scan", "map"] if find_spec("skfmm") else ["scan"]:
        assert remote.set_one("potential", potential) == ""
        topic = f"{HERE}/{potential}"
        graph.until(lambda topic=topic: uses.hears(topic), topic)
    uses.check(subscribed=() if find_spec("skfmm") else [f"{HERE}/map"])


def test_fake_robot_that_hears_the_clock(graph):
    graph.start("fake_robot", *SIM_TIME)
    Uses(graph, "fake_robot").check(published=["/clock"])


def test_fake_robot_that_is_the_clock(graph):
    graph.start("fake_robot", *IN_IT, "-p", "real_time_factor:=2.0")
    Uses(graph, "fake_robot").check(subscribed=["/clock"])


def test_watchdog(graph):
    """It joins cmd_vel once a robot is there."""
    graph.listen(Twist, f"{HERE}/cmd_vel")
    """With a type given it does not wait for a robot to listen before it joins the topic."""
    graph.start("cmd_vel_watchdog", *SIM_TIME, "-p", "cmd_vel_type:=twist")
    Uses(graph, "cmd_vel_watchdog").check()
