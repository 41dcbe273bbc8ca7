"""The ROS package of the node; its code is in the Python package `marsupial_ros`."""

from setuptools import setup

NAME = "marsupial_node"

setup(
    name=NAME,
    version="0.1.0",
    packages=[],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/fleet.launch.py"]),
    ],
    zip_safe=True,
    maintainer="marsupial contributors",
    maintainer_email="marsupial@users.noreply.github.com",
    description="Robots with ROS 2 in missions of marsupial",
    license="Apache-2.0",
    entry_points={"console_scripts": ["fleet = marsupial_ros.native.main:main"]},
)
