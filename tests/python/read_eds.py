"""Reads an EDS with python-canopen, checks the communication area, prints the other entries.

usage: read_eds.py EDS
"""

import sys

import canopen

NODE = 3
COMMUNICATION = [
    0x1000, 0x1001, 0x1003, 0x1005, 0x1008, 0x1009, 0x100A, 0x1010, 0x1011, 0x1012, 0x1014, 0x1015,
    0x1016, 0x1017, 0x1018, 0x1019, 0x1021, 0x1022, 0x1029, 0x1200,
    0x1400, 0x1401, 0x1600, 0x1601, 0x1800, 0x1801, 0x1A00, 0x1A01,
]
PDOS = {
    0x1400: (0x200, 1), 0x1401: (0x8000_0300, 1),
    0x1800: (0x4000_0180, 1), 0x1801: (0x4000_0280, 2),
}


def scientific(value):
    """Writes a float as Rust's {:e} does."""
    mantissa, exponent = f"{value:.17e}".split("e")
    for digits in range(18):
        text = f"{value:.{digits}e}"
        if float(text) == value:
            mantissa, exponent = text.split("e")
            break
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}e{int(exponent)}"


def main(eds):
    dictionary = canopen.import_od(eds, node_id=NODE)
    present = [index for index in dictionary if 0x1000 <= index < 0x2000]
    assert present == COMMUNICATION, [hex(index) for index in present]
    for index, (cob_id, transmission) in PDOS.items():
        assert dictionary[index][1].default == cob_id + NODE, hex(index)
        assert dictionary[index][2].default == transmission, hex(index)
        total = sum(dictionary[index + 0x200][sub].default & 0xFF for sub in range(1, 9))
        assert total == 64, hex(index)
    information = dictionary.device_information
    assert information.vendor_number == dictionary[0x1018][1].default
    assert information.product_number == dictionary[0x1018][2].default
    assert information.nr_of_RXPDO == information.nr_of_TXPDO == 2
    assert information.allowed_baudrates == {1_000_000}
    # A remote node of python-canopen finds its PDOs by name.
    node = canopen.RemoteNode(NODE, dictionary)
    assert len(node.tpdo) == len(node.rpdo) == 2
    for index in (index for index in dictionary if index >= 0x2000):
        entries = dictionary[index]
        assert entries[0].default == len(entries) - 1
        for sub in range(1, len(entries)):
            entry = entries[sub]
            # Where a program asks for "pose.yaw" it gets this entry.
            assert dictionary[entry.qualname] is entry, entry.qualname
            line = f"{index:04X}:{sub} {entry.qualname} {entry.data_type} {scientific(entry.factor)} {entry.unit}"
            print(line.rstrip())


main(*sys.argv[1:])
