"""A Ray cluster on this machine: a head without processors and nodes with one each, until stdin is closed.

``python ray_cluster_program.py NODES CLIENT_PORT`` prints the address of the head once all nodes are there.
"""

import sys

from ray.cluster_utils import Cluster
from support.waiting import HANG_S

MODEST = {"object_store_memory": 80_000_000, "include_dashboard": False, "include_log_monitor": False}

if __name__ == "__main__":
    count, client_port = map(int, sys.argv[1:])
    cluster = Cluster()
    cluster.add_node(num_cpus=0, ray_client_server_port=client_port, wait=False, **MODEST)
    for _ in range(count):
        cluster.add_node(num_cpus=1, wait=False, **MODEST)
    cluster.wait_for_nodes(HANG_S)
    print(cluster.address, flush=True)
    sys.stdin.read()
    cluster.shutdown()
