"""Reads vertebra 3's data sheet from itself (object 0x1021) and works with nothing else.

usage: data_sheet.py INTERFACE
"""

import canopen
import peer


def read_sheet(bus, node):
    """Reads the sheet by a block transfer. A host that lets this program stand still for a second,
    after which the vertebra gives up, gets another try."""
    for _ in range(5):
        try:
            with node.sdo.open(0x1021, 0, "rb", block_transfer=True) as stream:
                return stream.read()
        except canopen.SdoAbortedError as abort:
            if abort.code != 0x0504_0000:
                raise
            bus.wait(0x703, count=5)  # What was on its way has come.
    raise TimeoutError("no block transfer of the data sheet came to its end")


# What python-canopen does by itself, segment by segment, when it is asked to upload the sheet.
canopen.sdo.SdoClient.RESPONSE_TIMEOUT = peer.PATIENCE_S
with peer.bus() as bus:
    bus.wait(0x703)
    node = bus.network.add_node(3, upload_eds=True)
    objects = canopen.import_od(str(peer.DATA_SHEET), 3)
    found = {
        "objects": list(node.object_dictionary) == list(objects),
        "same": read_sheet(bus, node) == peer.DATA_SHEET.read_bytes(),
        "format": node.sdo[0x1022].raw,
        "name": node.sdo["Manufacturer device name"].raw,
    }
    node.sdo["gains.stiffness_y"].phys = 99.5
    found["stiffness"] = node.sdo[0x2020][2].raw
    node.tpdo.read()
    found["pose"] = [variable.name for variable in node.tpdo[1]]
    peer.tell(found)
