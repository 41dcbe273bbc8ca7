"""The bridge as a node of ROS 2, by rclpy: `ros2 launch marsupial_node fleet.launch.py settings:=fleet.yaml`.

::

    main.py ── parameters, signals, the service if it is local
       ├── transport.py   topics and actions for the bridge        ┐
       └── display.py     state, markers, diagnostics, services    ├── ros_node.py   all use of rclpy
                                                                   ┘

`marsupial_node` beside this folder is its ROS package: what `colcon build` and `ros2 launch` need.
"""
