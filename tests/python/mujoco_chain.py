#!/usr/bin/env python3
"""The dry chain of the eel in MuJoCo: the oracle of plant check P2.

Builds the eleven bodies from the outline by an integration of its own, gives every joint an angle
and a rate, lets the chain fly for 2 s without gravity, and writes where nose, joints and trailing
edge then are. `--check FILE` compares with a stored table instead.

    pip install mujoco numpy
    python tests/python/mujoco_chain.py > hil-sim/src/plant/mujoco-chain.csv
"""

import argparse
import csv
import math
import sys

import mujoco
import numpy as np

LENGTH, NOSE, TAIL = 1.5, 0.25, 0.25
LATERAL, VERTICAL = 0.050, 0.075
EDGE_LATERAL, EDGE_VERTICAL = 0.004, 0.045
DENSITY = 1000.0
STARTS = [0.0] + [0.3 + 0.1 * k for k in range(10)] + [LENGTH]
STEP, SECONDS = 1e-4, 2.0


def half_axes(s):
    """Lateral and vertical half axis at distances s from the nose."""
    nose = np.sqrt(np.clip(1.0 - (1.0 - s / NOSE) ** 2, 0.0, 1.0))
    tail = np.clip((s - (LENGTH - TAIL)) / TAIL, 0.0, 1.0)
    lateral = LATERAL + (EDGE_LATERAL - LATERAL) * tail
    vertical = VERTICAL + (EDGE_VERTICAL - VERTICAL) * tail
    share = np.where(s < NOSE, nose, 1.0)
    return lateral * share, vertical * share


def body(start, end, slices=200_000):
    """Mass, centre and principal inertia about the centre of the sections between two places."""
    z = (np.arange(slices) + 0.5) * (end - start) / slices
    a, b = half_axes(start + z)
    mass = DENSITY * math.pi * a * b * (end - start) / slices
    centre = float((mass * z).sum() / mass.sum())
    about_x = (mass * (a * a / 4 + (z - centre) ** 2)).sum()
    about_y = (mass * (b * b / 4 + (z - centre) ** 2)).sum()
    about_z = (mass * (a * a + b * b) / 4).sum()
    return float(mass.sum()), centre, (float(about_x), float(about_y), float(about_z))


def model():
    """The chain as MJCF."""
    xml, close = [], []
    for k in range(11):
        mass, centre, (ix, iy, iz) = body(STARTS[k], STARTS[k + 1])
        offset = 0.0 if k == 0 else STARTS[k] - STARTS[k - 1]
        joint = "<freejoint/>" if k == 0 else "<joint type='ball'/>"
        xml.append(
            f"<body name='b{k}' pos='0 0 {offset!r}'>{joint}"
            f"<inertial pos='0 0 {centre!r}' mass='{mass!r}' diaginertia='{ix!r} {iy!r} {iz!r}'/>"
        )
        close.append("</body>")
    inner = "".join(xml + close)
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><compiler balanceinertia='false'/>"
        f"<option gravity='0 0 0' timestep='{STEP}' integrator='RK4'>"
        f"<flag contact='disable'/></option><worldbody>{inner}</worldbody></mujoco>"
    )


def turned(axis, angle):
    quaternion = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quaternion, np.array(axis, float), angle)
    return quaternion


def product(a, b):
    result = np.zeros(4)
    mujoco.mju_mulQuat(result, a, b)
    return result


def fly():
    """Places of nose, joints and trailing edge after the flight."""
    chain = model()
    data = mujoco.MjData(chain)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    data.qvel[:6] = [0.05, -0.10, 0.15, 0.2, -0.1, 0.3]
    for k in range(10):
        pose = (0.2 * math.sin(k + 1), 0.08 * math.cos(2 * k), 0.03 * math.sin(3 * k))
        quaternion = product(
            product(turned((1, 0, 0), pose[0]), turned((0, 1, 0), pose[1])),
            turned((0, 0, 1), pose[2]),
        )
        data.qpos[7 + 4 * k : 11 + 4 * k] = quaternion
        data.qvel[6 + 3 * k : 9 + 3 * k] = [
            math.cos(k),
            0.5 * math.sin(2 * k),
            0.3 * math.cos(3 * k),
        ]
    for _ in range(round(SECONDS / STEP)):
        mujoco.mj_step(chain, data)
    mujoco.mj_kinematics(chain, data)
    points = [data.body(f"b{k}").xpos.copy() for k in range(11)]
    last = data.body("b10")
    tip = last.xmat.reshape(3, 3) @ np.array([0, 0, LENGTH - STARTS[10]])
    points.append(last.xpos + tip)
    return points


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", metavar="FILE", help="compare with a stored table")
    arguments = parser.parse_args()
    points = fly()
    if arguments.check:
        with open(arguments.check, newline="", encoding="utf-8") as table:
            rows = [r for r in csv.reader(table) if r and not r[0].startswith(("#", "point"))]
        stored = np.array([[float(x) for x in row[1:]] for row in rows])
        gap = float(np.abs(stored - np.array(points)).max())
        print(f"largest difference {gap:.3e} m over {len(points)} points")
        return 0 if gap < 1e-8 else 1
    print(f"# MuJoCo {mujoco.__version__}: the dry chain after {SECONDS} s, m; see mujoco_chain.py")
    print("point,x,y,z")
    for index, point in enumerate(points):
        print(",".join([str(index)] + [f"{x:.12f}" for x in point]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
