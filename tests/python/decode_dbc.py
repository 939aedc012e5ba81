"""Decodes a candump file with cantools and compares it with the JSON lines of `eel decode`.

usage: decode_dbc.py DBC LOG JSONL
"""

import json
import math
import sys

import can
import cantools


def same(ours, theirs):
    if isinstance(ours, str):
        return ours == str(theirs)
    return math.isclose(ours, float(theirs), rel_tol=1e-12, abs_tol=1e-15)


def main(dbc, log, jsonl):
    database = cantools.database.load_file(dbc, strict=True)
    known = {message.frame_id for message in database.messages}
    seen = set()
    count = 0
    with open(jsonl) as lines:
        for frame, line in zip(can.CanutilsLogReader(log), lines, strict=True):
            ours = json.loads(line)
            where = f"{line.strip()}\nat {frame}"
            assert ours["id"] == frame.arbitration_id, where
            assert bytes.fromhex(ours["data"]) == bytes(frame.data), where
            assert math.isclose(ours["time_s"], frame.timestamp, abs_tol=1e-6), where
            message = database.get_message_by_frame_id(frame.arbitration_id)
            assert message.name.endswith(ours["message"]), where
            if message.name != ours["message"]:
                sender = "head" if ours["node"] == 127 else f"vertebra{ours['node']}"
                assert message.name == f"{sender}_{ours['message']}", where
            theirs = message.decode(frame.data)
            assert theirs.keys() == ours["signals"].keys(), where
            for name, value in theirs.items():
                assert same(ours["signals"][name], value), f"{name}: {value}\n{where}"
            # What cantools packs from the values is what was on the bus.
            if not ours["message"] == "emergency":
                assert message.encode(theirs) == bytes(frame.data), where
            assert "problem" not in ours, where
            seen.add(frame.arbitration_id)
            count += 1
    print(f"{count} frames agree, {len(seen)} of {len(known)} messages")


main(*sys.argv[1:])
