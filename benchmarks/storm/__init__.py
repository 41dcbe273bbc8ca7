"""Random missions of every strategy, judged by an oracle that shares no code with the product.

``python -m benchmarks storm`` draws maps, robot types and teams (`worlds`), runs each mission through the public Python
API (`runs`), and reads its log as docs/mission-log.md describes it (`logs`). The oracle (`oracle`) then checks every
line against the rules of motion, docking, sensing and ending that the documentation promises.

In some missions the robots report their own map (`reported`): a team (`reporting`) gets the commands of the service's
mission loop, and its reports are distorted (`distortion`). Their logs (`reported_log`) are judged by rules of their own
(`reported_rules`, `reported_end`), as what is known is not true there, changes, and has a frame that grows.
"""
