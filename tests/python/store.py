"""Has vertebra 3 store its parameters, starts it anew, and has it forget them again.

usage: store.py INTERFACE
"""

import peer


def reset(bus, node):
    """Starts the node anew and waits until it has booted."""
    mark = bus.mark()
    node.nmt.state = "RESET"
    bus.wait(0x703, mark=mark, content=b"\0")


def parameters(node):
    """Reads a parameter of the communication area, one of a PDO and one of the application."""
    names = (0x1017, "TPDO2 communication parameter.Transmission type", "gains.stiffness_x")
    return [node.sdo[name].raw for name in names]


def change(node):
    node.sdo[0x1017].raw = 250
    node.sdo[0x1801][2].raw = 7
    node.sdo["gains.stiffness_x"].raw = 123_456


with peer.bus() as bus:
    vertebra = bus.node(3)
    bus.wait(0x703)
    store = vertebra.sdo.download
    found = {
        "offers": [vertebra.sdo[0x1010][sub].raw for sub in range(4)],
        "default": parameters(vertebra),
    }
    change(vertebra)
    reset(bus, vertebra)
    found["not stored"] = parameters(vertebra)
    change(vertebra)
    found["wrong signatures"] = [
        peer.abort_of(store, 0x1010, 1, b"evas"),
        peer.abort_of(store, 0x1011, 1, b"save"),
        peer.abort_of(store, 0x1010, 1, b"sav"),
        peer.abort_of(store, 0x1010, 4, b"save"),
    ]
    vertebra.store()
    reset(bus, vertebra)
    found["stored"] = parameters(vertebra)
    # The application's parameters alone become what they were.
    vertebra.restore(3)
    found["until reset"] = parameters(vertebra)
    reset(bus, vertebra)
    found["application restored"] = parameters(vertebra)
    vertebra.restore()
    reset(bus, vertebra)
    found["restored"] = parameters(vertebra)
    peer.tell(found)
