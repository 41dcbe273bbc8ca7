"""Start the node: ``ros2 launch marsupial_node fleet.launch.py settings:=$PWD/fleet.yaml server:=local``."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# parameters of the node, with their values unless given
USUAL = {
    "settings": "fleet.yaml",
    "server": "http://127.0.0.1:8080",
    "serve": "marsupial serve --port 0",
    "state": "",
}


def generate_launch_description() -> LaunchDescription:
    """Return the node with its arguments; `namespace` is as of any node."""
    texts = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in USUAL}
    simulated = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    usual = {**USUAL, "use_sim_time": "false", "namespace": ""}
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, default_value=value) for name, value in usual.items()),
            Node(
                package="marsupial_node",
                executable="fleet",
                name="marsupial",
                namespace=LaunchConfiguration("namespace"),
                parameters=[{**texts, "use_sim_time": simulated}],
                output="screen",
                emulate_tty=True,
                # the mission ends with its stop report, and goals are cancelled: longer than launch waits by itself
                sigterm_timeout="45",
                sigkill_timeout="15",
            ),
        ]
    )
