"""Starts vertebra 3, lets it nod twice, and draws what it was told and what it did.

    python nod.py [INTERFACE [PICTURE]]        vcan0 and nod.png where not given
"""

import math
import pathlib
import sys
import time

import canopen
from matplotlib.figure import Figure

DATA_SHEET = pathlib.Path(__file__).parents[2] / "docs/generated/vertebra.eds"
NODE = 3
BEAT_S = 0.01  # between two SYNCs
OFF, RUN = 0, 4  # modes of a target


def crc8(data):
    """CRC-8/AUTOSAR: polynomial 0x2F, start 0xFF, inverted at the end."""
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc << 1 ^ (0x12F if crc & 0x80 else 0)
    return crc ^ 0xFF


def send_target(target, pitch_rad, mode, count):
    """Sends a target with its counter, 0 to 14, and its protection by the COB-ID it goes under."""
    target["target.pitch"].phys = pitch_rad
    target["target.code"].raw = mode | count % 15 << 4
    target["target.crc"].raw = crc8(target.data[:7] + target.cob_id.to_bytes(2, "little"))
    target.transmit()


def nod(network):
    """Lets the vertebra nod for three seconds; returns time (s), told and seen pitch (degrees)."""
    vertebra = network.add_node(NODE, str(DATA_SHEET))
    vertebra.emcy.add_callback(lambda emergency: print("the vertebra says:", emergency))
    vertebra.rpdo.read(from_od=True)
    vertebra.tpdo.read(from_od=True)
    target, pose = vertebra.rpdo[1], vertebra.tpdo[1]
    vertebra.nmt.state = "OPERATIONAL"
    rows, start = [], time.monotonic()
    for beat in range(-30, 330):
        network.sync.transmit(beat % 240 + 1)  # Takes the target before this one, reports the pose.
        mode = RUN if 0 <= beat < 300 else OFF  # Before it may run it must have been told "off".
        pitch_rad = 0.1 * (1 - math.cos(math.tau * beat / 150)) if mode == RUN else 0.0
        send_target(target, pitch_rad, mode, beat)
        time.sleep(BEAT_S)
        rows.append((time.monotonic() - start, pitch_rad, pose["pose.pitch"].phys))
    vertebra.nmt.state = "PRE-OPERATIONAL"
    return [(moment, math.degrees(told), math.degrees(seen)) for moment, told, seen in rows]


def draw(rows, picture):
    """Draws both pitches over time."""
    moments, told, seen = zip(*rows)
    figure = Figure(figsize=(8, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(moments, told, color="0.65", linewidth=4, label="told")
    axes.plot(moments, seen, color="tab:blue", label="measured")
    axes.set(title=f"Vertebra {NODE} nods", xlabel="time in s", ylabel="pitch in degrees")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(picture, dpi=150)


if __name__ == "__main__":
    interface, picture = (sys.argv[1:] + ["vcan0", "nod.png"][len(sys.argv) - 1 :])[:2]
    with canopen.Network().connect(interface="socketcan", channel=interface) as network:
        rows = nod(network)
    draw(rows, picture)
    highest = [max(column) for column in zip(*rows)]
    if highest[2] < highest[1] / 2:
        print("it did not follow: `eel read 3 pose` says why; `eel head --reset` ends a latched stop")
    print(f"told {highest[1]:.2f} degrees, reached {highest[2]:.2f}; drawn in {picture}")
