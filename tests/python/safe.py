"""Lets vertebra 3 run, then lets the head's heartbeat stop while targets go on: it must let go.

usage: safe.py INTERFACE
"""

import itertools
import struct
import sys
import time

import canopen
import peer

sys.path.append(str(peer.ROOT / "examples/python"))
import nod  # noqa: E402

TOLD_S = 1_700_000_000.5  # what TIME says that it is
RESET = 15  # mode of a target: acknowledges the stop


class Head:
    """What a head sends in a beat, and the states that answer."""

    def __init__(self, bus):
        self.bus, self.node, self.beat = bus, bus.node(3), 0
        self.node.rpdo.read(from_od=True)
        self.mark = bus.mark()

    def beats(self, count, mode, heartbeats):
        for _ in range(count):
            if heartbeats and self.beat % 10 == 0:
                self.bus.network.send_message(0x77F, [5])
            self.bus.network.sync.transmit(self.beat % 240 + 1)
            nod.send_target(self.node.rpdo[1], 0.0, mode, self.beat)
            self.beat += 1
            time.sleep(nod.BEAT_S)

    def seen(self):
        """Returns the states of the poses since the last time, without repetitions."""
        poses = self.bus.since(self.mark, 0x183)
        self.mark = self.bus.mark()
        return [state for state, _ in itertools.groupby(pose[6] & 0x0F for pose in poses)]


def freeze_frame(node):
    """Reads the moment of the stop: code, detail, and the time of day in days and milliseconds."""
    with node.sdo.open(0x2100, 1, "rb", block_transfer=True) as stream:
        frame = stream.read()
    code, detail = struct.unpack_from("<HH", frame, 4)
    flags, days, ms = struct.unpack_from("<HHI", frame, 20)
    return {"bytes": len(frame), "code": code, "detail": detail, "clock": [flags & 1, days, ms]}


with peer.bus() as bus:
    head = Head(bus)
    bus.network.time.transmit(TOLD_S)
    head.node.nmt.state = "OPERATIONAL"
    head.beats(30, nod.OFF, True)
    head.beats(30, nod.RUN, True)
    found = {"running": head.seen()}
    mark = bus.mark()
    head.beats(60, nod.RUN, False)
    found["emergencies"] = [data[:2] + data[3:6] for data in bus.since(mark, 0x083)]
    # The heartbeat is back, and nothing moves until somebody says so.
    head.beats(30, nod.RUN, True)
    found["let go"] = head.seen()
    head.beats(3, RESET, True)
    head.beats(30, nod.OFF, True)
    head.beats(30, nod.RUN, True)
    found["again"] = head.seen()
    head.beats(5, nod.OFF, True)
    head.node.nmt.state = "PRE-OPERATIONAL"
    found["freeze"] = freeze_frame(head.node)
    delta = TOLD_S - canopen.timestamp.OFFSET
    found["told"] = [int(delta // 86_400), int(delta % 86_400 * 1000)]
    peer.tell(found)
