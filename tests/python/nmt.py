"""Takes vertebra 3 through every NMT state with python-canopen, while vertebra 5 goes on.

usage: nmt.py INTERFACE
"""

import peer

PRE_OPERATIONAL, OPERATIONAL, STOPPED, BOOT_UP = 127, 5, 4, 0
UPLOAD_DEVICE_TYPE = bytes([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])


def command(bus, node, name, expected):
    """Sends an NMT command and returns the states that the heartbeats then told, until expected."""
    mark = bus.mark()
    node.nmt.state = name
    return [data[0] for data in bus.wait(0x703, content=bytes([expected]), mark=mark)]


def states(bus, node):
    start = bus.mark()
    told = {
        "start": command(bus, node, "OPERATIONAL", OPERATIONAL)[-1],
        "stop": command(bus, node, "STOPPED", STOPPED)[-1],
    }
    # A stopped node answers no SDO. By five heartbeats of another it would have.
    mark = bus.mark()
    bus.network.send_message(0x603, UPLOAD_DEVICE_TYPE)
    bus.wait(0x705, count=5)
    told["answers in stopped"] = len(bus.since(mark, 0x583))
    told["pre-operational"] = command(bus, node, "PRE-OPERATIONAL", PRE_OPERATIONAL)[-1]
    for name, text in (("RESET", "reset node"), ("RESET COMMUNICATION", "reset communication")):
        command(bus, node, "OPERATIONAL", OPERATIONAL)
        seen = command(bus, node, name, PRE_OPERATIONAL)
        told[text] = seen[seen.index(BOOT_UP) :] if BOOT_UP in seen else seen
    # What is for another node, is no command, or is too short changes nothing.
    for data in ([1, 5], [7, 3], [1]):
        bus.network.send_message(0, bytes(data))
    told["after strange commands"] = bus.wait(0x703, count=2)[-1][0]
    told["boot-ups of 3"] = bus.since(start, 0x703).count(bytes([BOOT_UP]))
    told["states of 5"] = sorted({data[0] for data in bus.since(start, 0x705)})
    mark = bus.mark()
    bus.network.nmt.state = "RESET"
    bus.wait(0x705, mark=mark, content=bytes([BOOT_UP]))
    return told


def heartbeats(bus, node):
    """Counts heartbeats of node 3 at several periods by those of node 5, one every 200 ms."""
    counts = {}
    for period_ms in (20, 50, 0, 200):
        node.sdo[0x1017].raw = period_ms
        bus.wait(0x705)
        mark = bus.mark()
        bus.wait(0x705, count=5, mark=mark)
        counts[node.sdo[0x1017].raw] = len(bus.since(mark, 0x703))
    return counts


def consumer(bus, node):
    """Lets the head's heartbeat fail, come back, and fail for a node that does not watch it."""
    told = {"default": node.sdo[0x1016][1].raw}
    node.sdo[0x1016][1].raw = 127 << 16 | 400
    node.sdo[0x1003][0].raw = 0
    mark = bus.mark()
    bus.network.send_message(0x77F, [OPERATIONAL])
    told["emergency"] = bus.wait(0x083, mark=mark)[0]
    told["history"] = [node.sdo[0x1003][0].raw, node.sdo[0x1003][1].raw]
    told["register"] = node.sdo[0x1001].raw
    told["status"] = node.sdo["pose.status"].raw
    mark = bus.mark()
    bus.network.send_message(0x77F, [OPERATIONAL])
    told["back"] = bus.wait(0x083, mark=mark)[0]
    node.sdo[0x1016][1].raw = 0
    mark = bus.mark()
    bus.network.send_message(0x77F, [OPERATIONAL])
    bus.wait(0x703, count=6)
    told["unwatched"] = bus.since(mark, 0x083)
    told["refused"] = peer.abort_of(node.sdo.download, 0x1016, 1, bytes([0, 0, 127, 1]))
    return told


with peer.bus() as bus:
    vertebra = bus.node(3)
    bus.wait(0x703)
    peer.tell(
        {
            "states": states(bus, vertebra),
            "heartbeats": heartbeats(bus, vertebra),
            "consumer": consumer(bus, vertebra),
        }
    )
