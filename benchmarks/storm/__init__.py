"""Random missions of every strategy, judged by an oracle that shares no code with the product.

``python -m benchmarks storm`` draws maps, robot types and teams (`worlds`), runs each mission through the public Python
API (`runs`), and reads its log as docs/mission-log.md describes it (`logs`). The oracle (`oracle`) then checks every
line against the rules of motion, docking, sensing and ending that the documentation promises.
"""
