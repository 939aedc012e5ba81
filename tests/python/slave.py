"""A vertebra made of durand, a CANopen slave that knows nothing of this project, led by a head.

It boots, is started, gets SYNCs and targets, does at once what they say, and ends when it is taken
out of operation. Prints what it was told.

usage: slave.py INTERFACE
"""

import asyncio
import itertools
import json
import struct
import sys

import can
import durand

NODE = 3
TARGET, POSE = 0x2000, 0x2010
OFF, RUN = 0, 4  # modes
SWITCHED_OFF, READY, RUNNING = 1, 2, 3  # states
PATIENCE_S = 120


def crc8(data):
    """CRC-8/AUTOSAR, by long division of one binary number."""
    number = int.from_bytes(bytes([data[0] ^ 0xFF]) + data[1:], "big") << 8
    while number > 0xFF:
        number ^= 0x12F << number.bit_length() - 9
    return number ^ 0xFF


def record(name, access):
    """Five entries as a target and a pose have them: three angles, a code, a protection byte."""
    made = durand.Record(name)
    for sub in (1, 2, 3):
        made[sub] = durand.Variable(durand.DatatypeEnum.INTEGER16, access)
    for sub in (4, 5):
        made[sub] = durand.Variable(durand.DatatypeEnum.UNSIGNED8, access)
    return made


class Vertebra:
    """The slave's objects, and what it counts."""

    def __init__(self, network):
        self.node = durand.MinimalNode(network, NODE)
        self.objects = self.node.object_dictionary
        self.objects[TARGET] = record("target", "rw")
        self.objects[POSE] = record("pose", "ro")
        entries = range(1, 6)
        self.node.rpdo[0].mapping = [(TARGET, sub) for sub in entries]
        self.node.tpdo[0].mapping = [(POSE, sub) for sub in entries]
        self.node.rpdo[0].transmission_type = self.node.tpdo[0].transmission_type = 1
        self.syncs, self.poses, self.modes, self.counters = 0, 0, [], []
        self.wrong, self.yaws, self.states = 0, [], []
        self.ended = asyncio.Event()
        self.report((0, 0, 0), SWITCHED_OFF)
        # The last entry of a target is written last.
        self.objects.update_callbacks[(TARGET, 5)].add(self.obey)
        self.node.sync.callbacks.add(self.count)
        self.node.nmt.state_callbacks.add(self.follow)
        self.objects.write(0x1017, 0, 200)

    def count(self):
        self.syncs += 1

    def follow(self, state):
        self.states.append(int(state))
        if len(self.counters) > 0 and state != durand.services.nmt.StateEnum.OPERATIONAL:
            self.ended.set()

    def obey(self, crc):
        """Takes a target, and is where it says as soon as it may."""
        yaw, pitch, roll, code = (self.objects.read(TARGET, sub) for sub in range(1, 5))
        body = struct.pack("<3hB", yaw, pitch, roll, code)
        self.wrong += crc8(body + struct.pack("<H", 0x200 + NODE)) != crc
        mode = code & 0x0F
        self.modes.append(mode)
        self.counters.append(code >> 4)
        if mode == RUN:
            self.yaws.append(yaw)
        self.report((yaw, pitch, roll), {OFF: READY, RUN: RUNNING}[mode])
        if self.modes.count(RUN) == 100 and mode == RUN:
            # "Target limited", yaw.
            self.node.emcy.set(0xFF20, 0x81, bytes([0, 0, 1, 0]))

    def report(self, pose, state):
        """Writes what the next SYNC reports."""
        code = state | self.poses % 15 << 4
        self.poses += 1
        body = struct.pack("<3hB", *pose, code)
        crc = crc8(body + struct.pack("<H", 0x180 + NODE))
        for sub, value in enumerate((*pose, code, crc), 1):
            self.objects.write(POSE, sub, value)

    def told(self):
        steps = zip(self.counters, self.counters[1:])
        return {
            "states": self.states,
            "syncs": self.syncs,
            "targets": len(self.modes),
            "modes": [mode for mode, _ in itertools.groupby(self.modes)],
            "wrong protection": self.wrong,
            "counter gaps": sum((before + 1) % 15 != after for before, after in steps),
            "yaw": [min(self.yaws, default=0), max(self.yaws, default=0)],
        }


async def main():
    loop = asyncio.get_running_loop()
    with can.Bus(interface="socketcan", channel=sys.argv[1]) as bus:
        network = durand.CANBusNetwork(bus, loop=loop)
        vertebra = Vertebra(network)
        await asyncio.wait_for(vertebra.ended.wait(), PATIENCE_S)
        network.stop()
    print(json.dumps(vertebra.told()))


asyncio.run(main())
