"""Supervised processes on the machines of a Ray cluster, and its other uses.

A *cluster runner* starts a *gateway*, a process of its own that is connected to the cluster and may be lost with it. On
every node the gateway has a *node agent*, an actor with a warm launcher (`marsupial.processes`), and it relays the
channel of each run to the agent of the node whose processors Ray has reserved for it.
"""
