"""Lengths of CAN frames on the wire, computed bit by bit, to hold eel-transport against.

Written from ISO 11898-1 without a look at the Rust code: bits are characters of a string, the CRC
is the remainder of a division of one long binary number, and stuffing is a rewriting of the string.

    python3 tests/python/frame_bits.py > host-tools/transport/src/bits/pinned.txt
"""

import random

GENERATOR = 0b1100_0101_1001_1001  # x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1


def crc(bits: str) -> str:
    number = int(bits, 2) << 15
    while number.bit_length() > 15:
        number ^= GENERATOR << (number.bit_length() - 16)
    return format(number, "015b")


def stuffed(bits: str) -> str:
    out = ""
    for bit in bits:
        out += bit
        if out.endswith("00000"):
            out += "1"
        elif out.endswith("11111"):
            out += "0"
    return out


def on_the_wire(identifier: int, extended: bool, remote: bool, length: int, data: bytes) -> str:
    rtr = "1" if remote else "0"
    if extended:
        whole = format(identifier, "029b")
        arbitration = whole[:11] + "1" + "1" + whole[11:] + rtr + "00"
    else:
        arbitration = format(identifier, "011b") + rtr + "00"
    content = "0" + arbitration + format(length, "04b")
    if not remote:
        content += "".join(format(byte, "08b") for byte in data)
    acknowledge = "1" + "0" + "1"  # CRC delimiter, slot, delimiter
    return stuffed(content + crc(content)) + acknowledge + "1" * 7 + "1" * 3


def random_frame(rng: random.Random):
    extended = rng.random() < 0.4
    remote = rng.random() < 0.15
    length = rng.choice([0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8])
    if rng.random() < 0.5:
        # Long runs, which random bytes hardly have.
        data = bytes(rng.choice([0x00, 0xFF, 0x0F, 0xF8, 0x1F, 0x83]) for _ in range(length))
        identifier = rng.choice([0, 0x7FF, 0x078, 0x080, 0x1FFFFFFF, 0x7C1F07C1, 0x000007C0])
    else:
        data = bytes(rng.randrange(256) for _ in range(length))
        identifier = rng.randrange(1 << 29)
    identifier &= (1 << 29) - 1 if extended else (1 << 11) - 1
    return identifier, extended, remote, length, data


def main() -> None:
    rng = random.Random(20260131)
    frames = [
        (0, False, False, 0, b""),
        (0x7FF, False, False, 8, b"\xff" * 8),
        (0, False, False, 8, b"\x00" * 8),
        (0x080, False, False, 1, b"\x01"),
        (0x555, False, False, 8, b"\x55" * 8),
        (0, True, False, 0, b""),
        (0x1FFFFFFF, True, True, 0, b""),
    ]
    frames += [random_frame(rng) for _ in range(993)]
    for identifier, extended, remote, length, data in frames:
        name = format(identifier, "08X" if extended else "03X")
        body = f"R{length or ''}" if remote else data.hex().upper()
        bits = len(on_the_wire(identifier, extended, remote, length, data))
        print(f"{name}#{body} {bits}")


if __name__ == "__main__":
    main()
