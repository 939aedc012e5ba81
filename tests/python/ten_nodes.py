"""Meets the vertebrae on a CAN interface with python-canopen, which knows nothing of this project.

Waits for a heartbeat of every node, reads its device type (object 0x1000), identity (0x1018) and
heartbeat period (0x1017) by SDO, starts all of them with one NMT command, waits until every
heartbeat says operational, and takes them back to pre-operational. Prints one JSON object by node id. Ends with
status 1 and a sentence where a node does not answer.

    python3 tests/python/ten_nodes.py vcan0
"""

import argparse
import json
import sys

import canopen


def wait_for_state(node: canopen.RemoteNode, wanted: str, timeout: float) -> None:
    """Waits for heartbeats until one tells the wanted state; at most ten of them."""
    for _ in range(10):
        state = node.nmt.wait_for_heartbeat(timeout)
        if state == wanted:
            return
    raise RuntimeError(f"node {node.id} stays {state} and does not become {wanted}")


def unsigned(node: canopen.RemoteNode, index: int, subindex: int) -> int:
    return int.from_bytes(node.sdo.upload(index, subindex), "little")


def meet(network: canopen.Network, count: int, timeout: float) -> dict:
    nodes = {}
    for node_id in range(1, count + 1):
        # Objects are read by their numbers: an empty dictionary will do.
        node = canopen.RemoteNode(node_id, canopen.ObjectDictionary())
        # A host that also simulates the nodes may be slow to answer.
        node.sdo.RESPONSE_TIMEOUT = timeout
        nodes[node_id] = network.add_node(node)

    found = {node_id: {} for node_id in nodes}
    for node_id, node in nodes.items():
        found[node_id]["first_state"] = node.nmt.wait_for_heartbeat(timeout)
    for node_id, node in nodes.items():
        found[node_id]["device_type"] = unsigned(node, 0x1000, 0)
        found[node_id]["vendor"] = unsigned(node, 0x1018, 1)
        found[node_id]["serial"] = unsigned(node, 0x1018, 4)
        found[node_id]["heartbeat_ms"] = unsigned(node, 0x1017, 0)
        try:
            node.sdo.upload(0x5FFF, 0)
            found[node_id]["missing_object"] = None
        except canopen.SdoAbortedError as abort:
            found[node_id]["missing_object"] = abort.code
    for state in ("OPERATIONAL", "PRE-OPERATIONAL"):
        network.nmt.state = state
        for node in nodes.values():
            wait_for_state(node, state, timeout)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("interface", help="SocketCAN interface, such as vcan0")
    parser.add_argument("--nodes", type=int, default=10, help="node ids 1 to NODES (10)")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds for each answer (30)")
    arguments = parser.parse_args()

    network = canopen.Network()
    network.connect(interface="socketcan", channel=arguments.interface)
    try:
        print(json.dumps(meet(network, arguments.nodes, arguments.timeout)))
    except (canopen.nmt.NmtError, canopen.SdoError, RuntimeError) as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return 1
    finally:
        network.disconnect()
    return 0


if __name__ == "__main__":
    sys.exit(main())
