# SPDX-License-Identifier: Apache-2.0
"""Build of the ament_python package tbot_gradnav; dependencies as in package.xml."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = "tbot_gradnav"
ROS = ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"]
PLOT = ["matplotlib>=3.6"]
BAGS = ["rosbags>=0.11"]
MAP = ["scikit-fmm>=2022.8.15"]  # from source: it needs a C++ compiler
TEST = ["pytest>=7", "hypothesis>=6", "pytest-timeout>=2", "pytest-xdist>=3", "wheel"]
BENCH = ["scipy>=1.11", "ir-sim>=2.12", *MAP]
COLCON = ["colcon-common-extensions>=0.3", "setuptools"]
LINT = ["ruff>=0.8", "mypy>=1.11", "types-PyYAML", *COLCON]

setup(
    name=NAME,
    version="0.1.0",
    description="Gradient-based navigation for a TurtleBot3 Burger",
    long_description=Path("README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="tbot_gradnav maintainers",
    maintainer="tbot_gradnav maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    license="Apache-2.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", glob("config/*.*")),
        (f"share/{NAME}/config/maps", glob("config/maps/*")),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
    ],
    python_requires=">=3.11",
    install_requires=["setuptools", "numpy>=1.26", "PyYAML>=6"],
    extras_require={
        "ros": ROS,
        "plot": PLOT,
        "bags": BAGS,
        "map": MAP,
        "all": [*ROS, *PLOT, *BAGS],
        "test": [*TEST, *COLCON],
        "lint": LINT,
        "bench": BENCH,
    },
    entry_points={
        "console_scripts": [
            f"navigator = {NAME}.navigator:main",
            f"fake_robot = {NAME}.fake_robot:main",
            f"cmd_vel_watchdog = {NAME}.cmd_vel_watchdog:main",
            f"gradnav = {NAME}.cli:main",
        ],
    },
    zip_safe=True,
)
