"""Finds two vertebrae without node ids by LSS fastscan, and gives them ids that last.

usage: lss.py INTERFACE
"""

import canopen
import peer

# A bit of the identity that is 1 is known by silence, for this long.
SILENCE_S = 0.12
PRODUCT = 0x6565_6C01


def scan(lss):
    """Searches until nobody is left who has no id, giving ids from the last hexadecimal digit."""
    found, empty = [], 0
    while empty < 3:
        # An answer that comes late spoils a search, which the search notices: it is repeated.
        some, identity = lss.fast_scan()
        empty = 0 if some else empty + 1
        if not some:
            continue
        node_id = identity[3] & 0xF
        # The one that was found is in configuration state now.
        inquired = [lss.inquire_lss_address(command) for command in (0x5A, 0x5B, 0x5C, 0x5D)]
        before = lss.inquire_node_id()
        lss.configure_node_id(node_id)
        lss.store_configuration()
        found.append([identity, inquired, before, lss.inquire_node_id()])
        lss.send_switch_state_global(lss.WAITING_STATE)
    return found


def identify(bus, lss):
    """Asks whether there is anybody without an id, and by a range of serial numbers; returns who answers."""
    told = []
    for ask in (
        lss.send_identify_non_configured_remote_slave,
        lambda: lss.send_identify_remote_slave(0, PRODUCT, 0, 0xFFFF_FFFF, 0, 0xFFFF_FFFF),
    ):
        mark = bus.mark()
        ask()
        told.append([data[0] for data in bus.wait(0x7E4, count=2, mark=mark)])
    return told


def refusals(lss, identity):
    """Selects one by its identity and asks it for what must be refused."""
    told = {"selected": lss.send_switch_state_selective(*identity)}
    for name, action in {
        "id 0": lambda: lss.configure_node_id(0),
        "id 128": lambda: lss.configure_node_id(128),
        "125 kbit/s": lambda: lss.configure_bit_timing(4),
        "1 Mbit/s": lambda: lss.configure_bit_timing(0),
    }.items():
        try:
            action()
            told[name] = "accepted"
        except canopen.lss.LssError as error:
            told[name] = str(error)
    lss.send_switch_state_global(lss.WAITING_STATE)
    return told


with peer.bus() as bus:
    lss = bus.network.lss
    lss.RESPONSE_TIMEOUT = SILENCE_S
    mark = bus.mark()
    found = {"identified": identify(bus, lss), "scanned": scan(lss)}
    lss.RESPONSE_TIMEOUT = peer.PATIENCE_S
    # Each boots with its id as soon as it is back in waiting state.
    found["booted"] = [bus.wait(0x700 + node_id, mark=mark)[0][0] for node_id in (3, 5)]
    nodes = [bus.node(node_id) for node_id in (3, 5)]
    found["serials"] = [node.sdo[0x1018][4].raw for node in nodes]
    found["refusals"] = refusals(lss, found["scanned"][0][0])
    # The ids were stored: they outlast a reset.
    mark = bus.mark()
    bus.network.nmt.state = "RESET"
    for node_id in (3, 5):
        bus.wait(0x700 + node_id, mark=mark, content=b"\0")
    found["after reset"] = [node.sdo[0x1018][4].raw for node in nodes]
    peer.tell(found)
