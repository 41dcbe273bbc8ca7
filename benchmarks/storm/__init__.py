"""Random missions of every strategy, judged by an oracle that shares no code with the product.

``python -m benchmarks storm`` draws maps, robot types and teams (`worlds`), and what else a scenario may have
(`additions`). It runs each mission through the public Python API (`runs`). In some missions the robots report their own
map (`reported`): a team (`reporting`) gets the commands of the service's mission loop, and its reports are distorted
(`distortion`).

The oracle (`oracle`) reads the log as docs/mission-log.md describes it (`logs`). An account follows the events
(`account`, with `robots`, `charges`, `contact` and `zones`), and each of the rules (`rules`) checks them against what
the documentation promises.
"""
