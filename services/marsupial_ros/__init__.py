"""A bridge between robots with ROS 2 and the missions of the service: a node of ROS 2, and `marsupial ros`.

::

    ROS 2 ── rclpy ─────────────────────── native/ ─┐
    ROS 2 ── rosbridge ── websocket ── rosbridge.py ┴─► map_tracker.py  occupancy and masks -> changed cells
                                            │      └──► transforms.py   tf -> poses
                                            ▼                │
                                         fleet.py  ◄─────────┘          watches the robots of commands.py (commands
                                            ▲                           -> goals) and team.py (places -> reports)
    service ──── HTTP ──── marsupial_client ─── bridge.py               the loop of one mission

Messages on either side can be repeated: goals carry the command they are for, reports are numbered. So a bridge that
lost ROS or the service, or was killed, resumes its mission (`journal.py`). `transport.py` is what it needs of ROS. Only
`native` needs a ROS installation. `marsupial_interfaces` and `marsupial_node` beside this file are ROS packages: the
actions for docking, and the node.
"""
