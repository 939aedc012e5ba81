"""Moves values of every length through vertebra 3's SDO server, and asks it for what it must refuse.

usage: sdo.py INTERFACE
"""

import struct
import zlib

import peer

LENGTHS = (1, 7, 14, 889, 2000)
LINK, DATA, LENGTH, CRC = 0x2101, 1, 2, 3


def pattern(length):
    """What the link object reads as."""
    return bytes((7 * k + k // 256) % 256 for k in range(length))


def content(length):
    """What is written to it: no two blocks of it are the same."""
    return bytes((k * k + k // 7 + length) % 256 for k in range(length))


def short_values(node):
    """Reads and writes values of one to four bytes, which travel in one frame."""
    sdo = node.sdo
    told = {"1001": sdo[0x1001].raw, "1017": sdo[0x1017].raw, "1000": sdo[0x1000].raw}
    sdo[0x1017].raw = 300
    sdo["gains.stiffness_x"].phys = 123.456
    sdo["gains.range_pitch"].raw = 1234
    sdo[0x1019].raw = 100
    told["written"] = [
        sdo.upload(0x1017, 0),
        sdo.upload(0x2020, 1),
        sdo.upload(0x2020, 9),
        sdo.upload(0x1019, 0),
    ]
    sdo[0x1017].raw, sdo[0x1019].raw = 200, 240
    told["text"] = sdo[0x1008].raw
    return told


def write(node, data, how):
    if how == "expedited or segmented":
        node.sdo.download(LINK, DATA, data)
    elif how == "segmented":
        node.sdo.download(LINK, DATA, data, force_segment=True)
    else:
        crc = how == "block"
        with node.sdo.open(
            LINK, DATA, "wb", size=len(data), block_transfer=True, request_crc_support=crc
        ) as stream:
            stream.write(data)


def read(node, how):
    if "segmented" in how:
        return node.sdo.upload(LINK, DATA)
    crc = how == "block"
    with node.sdo.open(
        LINK, DATA, "rb", block_transfer=True, request_crc_support=crc
    ) as stream:
        return stream.read()


def transfers(node):
    """Tells for each way and length whether what came is what was sent, both ways."""
    told = {}
    for how in ("expedited or segmented", "segmented", "block", "block without crc"):
        for length in LENGTHS:
            data = content(length)
            write(node, data, how)
            arrived = node.sdo[LINK][CRC].raw == zlib.crc32(data)
            node.sdo[LINK][LENGTH].raw = length
            told[f"{how} {length}"] = [arrived, read(node, how) == pattern(length)]
    return told


def refusals(node):
    """Asks for what can't be and returns the abort codes."""
    download, upload = node.sdo.download, node.sdo.upload
    return {
        "no object": peer.abort_of(upload, 0x5FFF, 0),
        "no subindex": peer.abort_of(upload, 0x1018, 5),
        "write to what is read only": peer.abort_of(download, 0x2010, 1, b"\0\0"),
        "write to a constant": peer.abort_of(download, 0x1000, 0, bytes(4)),
        "too long": peer.abort_of(download, 0x1017, 0, bytes(4)),
        "too short": peer.abort_of(download, 0x1017, 0, bytes(1)),
        "too high": peer.abort_of(download, 0x2020, 1, struct.pack("<I", 500_001)),
        "too low": peer.abort_of(download, 0x2020, 8, struct.pack("<h", -1)),
        "not a counter": peer.abort_of(download, 0x1019, 0, bytes([241])),
    }


def answer(bus, *request):
    """Sends a raw request and returns the command specifier or the abort code that answers it."""
    data = bus.ask(0x603, bytes(request) + bytes(8 - len(request)), 0x583)
    return f"{struct.unpack_from('<I', data, 4)[0]:08X}" if data[0] == 0x80 else f"{data[0]:02X}"


def broken_protocol(bus, node):
    """Breaks the protocol in the middle of transfers; after each the server serves on."""
    name, link = (0x08, 0x10, 0), (0x01, 0x21, 1)
    told = {"unknown command": answer(bus, 0xE0, *name)}
    told["segment of nothing"] = answer(bus, 0x60)
    told["toggle"] = [answer(bus, 0x40, *name), answer(bus, 0x60), answer(bus, 0x60)]
    bus.network.send_message(0x603, bytes([0x80, *name, 0, 0, 4, 8]))
    told["block of 0"] = answer(bus, 0xA4, *link, 0)
    told["block of 128"] = answer(bus, 0xA4, *link, 128)
    told["block refused"] = [
        answer(bus, 0xA4, *link, 4),
        answer(bus, 0xA2, 1, 0),
    ]
    # A block of two segments and its end, with a wrong CRC.
    told["crc"] = [answer(bus, 0xC6, *link, 14)]
    bus.network.send_message(0x603, bytes([1, *range(7)]))
    told["crc"] += [answer(bus, 0x82, *range(7)), answer(bus, 0xC1, 0x34, 0x12)]
    # A client that falls silent is told so, and the next one is served.
    told["silence"] = [answer(bus, 0x40, *name)]
    told["silence"] += [f"{struct.unpack_from('<I', data, 4)[0]:08X}" for data in bus.wait(0x583)]
    told["afterwards"] = node.sdo[0x1008].raw
    return told


with peer.bus() as bus:
    vertebra = bus.node(3)
    bus.wait(0x703)
    peer.tell(
        {
            "short values": short_values(vertebra),
            "refusals": refusals(vertebra),
            "transfers": transfers(vertebra),
            "broken protocol": broken_protocol(bus, vertebra),
        }
    )
