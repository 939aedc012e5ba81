"""What the scripts share that meet vertebrae on a CAN interface with python-canopen.

A script prints one JSON object with what it found; the test that runs it says what that must be.
The host that runs it may also simulate the vertebrae on one slow processor: nothing here measures
time, and whatever is waited for has a minute.
"""

import contextlib
import json
import pathlib
import sys
import threading

import canopen

ROOT = pathlib.Path(__file__).parents[2]
DATA_SHEET = ROOT / "docs/generated/vertebra.eds"
PATIENCE_S = 60


class Bus:
    """A network, and every frame that came, in the order of the bus."""

    def __init__(self, interface):
        self.frames = []
        self.news = threading.Condition()
        self.network = canopen.Network()
        self.network.listeners.append(self)
        self.network.connect(interface="socketcan", channel=interface)

    # python-can calls listeners, asks them to stop at the end, and tells them of errors.
    def __call__(self, message):
        with self.news:
            self.frames.append((message.arbitration_id, bytes(message.data)))
            self.news.notify_all()

    def stop(self):
        pass

    def node(self, node_id, dictionary=str(DATA_SHEET)):
        """Adds a node whose client is as patient as everything else."""
        node = self.network.add_node(node_id, dictionary)
        node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
        return node

    def mark(self):
        """Returns the place after the last frame so far."""
        return len(self.frames)

    def since(self, mark, cob_id):
        """Returns the contents of the frames with an identifier that came after a mark."""
        return [data for identifier, data in self.frames[mark:] if identifier == cob_id]

    def wait(self, cob_id, count=1, mark=None, content=None):
        """Waits until `count` frames have come after the mark, or one with this content."""
        mark = self.mark() if mark is None else mark

        def found():
            data = self.since(mark, cob_id)
            return content in data if content is not None else len(data) >= count

        with self.news:
            if not self.news.wait_for(found, PATIENCE_S):
                wanted = f"{cob_id:03X}" + (f"#{content.hex()}" if content is not None else "")
                raise TimeoutError(f"no {wanted} came; others: {self.frames[mark:][-10:]}")
        return self.since(mark, cob_id)

    def ask(self, cob_id, request, answer_id):
        """Sends a frame and returns the content of the first answer."""
        mark = self.mark()
        self.network.send_message(cob_id, request)
        return self.wait(answer_id, mark=mark)[0]


@contextlib.contextmanager
def bus():
    """Opens the interface that the command line names."""
    opened = Bus(sys.argv[1])
    try:
        yield opened
    finally:
        opened.network.disconnect()


def abort_of(action, *arguments):
    """Returns the abort code that an access ends with, in hexadecimal; None where it succeeds."""
    try:
        action(*arguments)
    except canopen.SdoAbortedError as abort:
        return f"{abort.code:08X}"
    return None


def tell(found):
    print(json.dumps(found, default=lambda value: value.hex()))
