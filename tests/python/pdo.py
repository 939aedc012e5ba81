"""Maps PDOs of vertebra 3 anew while it runs, and holds SYNC and timers to what they say.

usage: pdo.py INTERFACE
"""

import struct

import peer

VALID, NO_REMOTE = 1 << 31, 1 << 30


def sync(bus, counter):
    bus.network.sync.transmit(counter)


def defaults(bus, node):
    """Returns which reports answer six SYNCs, one after the other."""
    node.nmt.state = "OPERATIONAL"
    bus.wait(0x703, content=bytes([5]))
    answers = []
    for counter in range(1, 7):
        mark = bus.mark()
        sync(bus, counter)
        bus.wait(0x703, count=1, mark=mark)
        answers.append([len(bus.since(mark, 0x183)), len(bus.since(mark, 0x283))])
    return answers


def transmit(bus, node):
    """Maps TPDO 2 to supply, a crank's angle and the error register; python-canopen does it all."""
    pdo = node.tpdo[2]
    pdo.read()
    before = [variable.name for variable in pdo]
    pdo.clear()
    pdo.add_variable("health", "supply")
    pdo.add_variable("motor", "angle3")
    pdo.add_variable(0x1001)
    pdo.cob_id, pdo.trans_type, pdo.enabled = 0x3C3, 1, True
    pdo.save()
    mark = bus.mark()
    sync(bus, 1)
    content = bus.wait(0x3C3, mark=mark)[0]
    told = {"before": before, "length": len(content)}
    told["carried"] = list(struct.unpack("<HiB", content))
    told["read"] = [node.sdo[name].raw for name in ("health.supply", "motor.angle3", 0x1001)]
    told["old identifier"] = len(bus.since(mark, 0x283))
    # By its event timer of 40 ms, with and without an inhibit time of 100 ms.
    pdo.trans_type, pdo.event_timer = 255, 40
    pdo.save()
    told["by timer"] = frames_in_a_second(bus)
    pdo.inhibit_time = 1000
    pdo.save()
    told["inhibited"] = frames_in_a_second(bus)
    # Every third SYNC.
    pdo.trans_type, pdo.inhibit_time, pdo.event_timer = 3, 0, 0
    pdo.save()
    mark = bus.mark()
    for counter in range(1, 10):
        sync(bus, counter)
        bus.wait(0x183, count=counter, mark=mark)
    bus.wait(0x703)
    told["every third"] = len(bus.since(mark, 0x3C3))
    return told


def frames_in_a_second(bus):
    """Counts what comes within five heartbeats, one every 200 ms."""
    bus.wait(0x703)
    mark = bus.mark()
    bus.wait(0x703, count=5, mark=mark)
    return len(bus.since(mark, 0x3C3))


def receive(bus, node):
    """Maps RPDO 2 to stiffness, two bytes of nothing and a moment, and sends it."""
    pdo = node.rpdo[2]
    pdo.read()
    pdo.clear()
    pdo.add_variable("moment", "stiffness")
    pdo.add_variable(0x0006)
    pdo.add_variable("moment", "x")
    pdo.cob_id, pdo.trans_type, pdo.enabled = 0x343, 1, True
    pdo.save()

    def objects():
        return [node.sdo["moment.stiffness"].raw, node.sdo["moment.x"].raw]

    told = {"before": objects()}
    bus.network.send_message(0x343, struct.pack("<Hhh", 20_000, 99, -321))
    told["before sync"] = objects()
    sync(bus, 1)
    told["after sync"] = objects()
    pdo.trans_type = 255
    pdo.save()
    bus.network.send_message(0x343, struct.pack("<Hhh", 30_000, 99, 55))
    told["at once"] = objects()
    mark = bus.mark()
    bus.network.send_message(0x343, struct.pack("<Hh", 1, 1))
    told["short"] = bus.wait(0x083, mark=mark)[0]
    told["after short"] = objects()
    bus.network.send_message(0x343, struct.pack("<HhhH", 40_000, 99, 7, 0))
    told["long"] = objects()
    return told


def refusals(bus, node):
    """Breaks every rule of changing a PDO, and returns the abort codes."""
    pdo = node.tpdo[1]
    pdo.read()

    def write(index, subindex, value, form="<I"):
        return peer.abort_of(node.sdo.download, index, subindex, struct.pack(form, value))

    told = {
        "map while enabled": write(0x1A00, 1, 0x2030_0110),
        "count while enabled": write(0x1A00, 0, 0, "<B"),
        "identifier while enabled": write(0x1800, 1, NO_REMOTE | 0x1C3),
        "reserved type": write(0x1800, 2, 241, "<B"),
        "remote frames": write(0x1800, 1, 0x183),
        "extended identifier": write(0x1800, 1, VALID | NO_REMOTE | 1 << 29 | 0x183),
        "disable": write(0x1800, 1, VALID | NO_REMOTE | 0x183),
        "identifier of SDO": write(0x1800, 1, NO_REMOTE | 0x603),
        "map while mapped": write(0x1A00, 1, 0x2030_0110),
        "free": write(0x1A00, 0, 0, "<B"),
        "no object": write(0x1A00, 1, 0x5FFF_0010),
        "no subindex": write(0x1A00, 1, 0x2010_1010),
        "wrong way": write(0x1A00, 1, 0x2000_0110),
        "wrong length": write(0x1A00, 1, 0x2010_0108),
        "dummy in a report": write(0x1A00, 1, 0x0005_0008),
        "four bytes": write(0x1A00, 1, 0x2012_0120),
        "four more": write(0x1A00, 2, 0x2012_0220),
        "two more": write(0x1A00, 3, 0x2010_0110),
        "ten bytes": write(0x1A00, 0, 3, "<B"),
        "empty": write(0x1A00, 3, 0),
        "empty entry": write(0x1A00, 0, 3, "<B"),
        "nine entries": write(0x1A00, 0, 9, "<B"),
        "enable the empty": write(0x1800, 1, NO_REMOTE | 0x183),
        "eight bytes": write(0x1A00, 0, 2, "<B"),
        "enable": write(0x1800, 1, NO_REMOTE | 0x183),
    }
    mark = bus.mark()
    sync(bus, 1)
    content = bus.wait(0x183, mark=mark)[0]
    told["carried"] = content == node.sdo.upload(0x2012, 1) + node.sdo.upload(0x2012, 2)
    return told


def beats(bus):
    """Sends SYNCs without and with too long a counter, and then a right one."""
    told = {}
    for name, data in (("none", b""), ("two bytes", b"\1\2"), ("right", b"\1")):
        mark = bus.mark()
        bus.network.send_message(0x080, data)
        bus.wait(0x703, mark=mark)
        told[name] = [len(bus.since(mark, 0x183)), bus.since(mark, 0x083)]
    return told


with peer.bus() as bus:
    vertebra = bus.node(3)
    bus.wait(0x703)
    peer.tell(
        {
            "defaults": defaults(bus, vertebra),
            "transmit": transmit(bus, vertebra),
            "receive": receive(bus, vertebra),
            "refusals": refusals(bus, vertebra),
            "beats": beats(bus),
        }
    )
    mark = bus.mark()
    vertebra.nmt.state = "RESET"
    bus.wait(0x703, mark=mark, content=b"\0")
