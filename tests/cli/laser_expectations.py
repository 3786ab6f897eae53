"""Logs of lasers as their makers specify them, and the numbers in them, read back without our reader.

    pip install rosbags==0.11.5
    python tests/cli/laser_expectations.py > tests/cli/laser_expectations.json

Sources: SICK, "Telegram listing: ranging sensors LMS1xx, LMS5xx, TiM5xx" (CoLa A and B, LMDscandata); Hokuyo, "Communication Protocol
Specification for SCIP2.0 Standard"; DP-SLAM's readme; the message CustomMsg of Livox' ROS 2 driver, which the package rosbags writes
and reads by its definition. Angles in degrees, counter-clockwise from ahead; ranges in metres; times in seconds.
"""

import base64
import json
import math
import random
import struct

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

random.seed(22)


def varied(count, least, most):
    return [random.randint(least, most) for _ in range(count)]


# SICK: a telegram's fields in their order; numbers have the high byte first.


def sick_body(scale, start, step, values, time, encoders):
    fields = struct.pack(">HHI", 1, 1, 0x00123456)  # version, device, serial number
    fields += struct.pack(">BBHH", 0, 0, 17, 18)  # status, telegrams, scans
    fields += struct.pack(">II", time, time + 900)  # since the start, of the transmission (us)
    fields += struct.pack(">HHH", 0, 0, 0)  # inputs, outputs, reserved
    fields += struct.pack(">II", 2500, 5400)  # frequencies
    fields += struct.pack(">H", encoders) + b"".join(struct.pack(">IH", 100 + e, 5) for e in range(encoders))
    fields += struct.pack(">H", 1) + b"DIST1" + struct.pack(">ff", scale, 0.0)
    fields += struct.pack(">iHH", start, step, len(values)) + struct.pack(f">{len(values)}H", *values)
    return fields + struct.pack(">HHHHHH", 0, 0, 0, 0, 0, 0)


def sick_binary(telegrams):
    data = b""
    for telegram in telegrams:
        payload = b"sSN LMDscandata " + sick_body(*telegram)
        checksum = 0
        for byte in payload:
            checksum ^= byte
        data += b"\x02\x02\x02\x02" + struct.pack(">I", len(payload)) + payload + bytes([checksum])
    return data


def read_sick_binary(data):
    scans = []
    at = 0
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at + 4)
        body = data[at + 8 + len(b"sSN LMDscandata ") : at + 8 + length]
        (time,) = struct.unpack_from(">I", body, 14)
        (encoders,) = struct.unpack_from(">H", body, 36)
        channel = 38 + 6 * encoders + 2
        assert body[channel : channel + 5] == b"DIST1"
        scale, offset = struct.unpack_from(">ff", body, channel + 5)
        start, step, count = struct.unpack_from(">iHH", body, channel + 13)
        values = struct.unpack_from(f">{count}H", body, channel + 21)
        scans.append(scan(start / 1e4 - 90, step / 1e4, [v and (v * scale + offset) / 1000 for v in values], time / 1e6))
        at += 8 + length + 1
    return scans


def sick_text(telegrams):
    lines = []
    for scale, start, step, values, time, encoders in telegrams:
        words = ["sSN", "LMDscandata", 1, 1, 0x123456, 0, 0, 17, 18, time, time + 900, 0, 0, 0, 0, 0, 2500, 5400, encoders]
        words += [word for e in range(encoders) for word in (100 + e, 5)]
        words += [1, "DIST1", struct.unpack(">I", struct.pack(">f", scale))[0], 0, start & 0xFFFFFFFF, step, len(values), *values]
        words += [0, 0, 0, 0, 0, 0]
        lines.append("\x02" + " ".join(w if isinstance(w, str) else f"{w:X}" for w in words) + "\x03")
    return "\n".join(lines).encode()


def read_sick_text(data):
    scans = []
    for telegram in data.decode().split("\x03"):
        words = telegram.strip("\x02\n").split(" ")
        if len(words) < 20:
            continue
        channel = words.index("DIST1")
        scale = struct.unpack(">f", bytes.fromhex(words[channel + 1].rjust(8, "0")))[0]
        start = struct.unpack(">i", bytes.fromhex(words[channel + 3].rjust(8, "0")))[0]
        step, count = (int(word, 16) for word in words[channel + 4 : channel + 6])
        values = [int(word, 16) for word in words[channel + 6 : channel + 6 + count]]
        time = int(words[words.index("LMDscandata") + 8], 16)
        scans.append(scan(start / 1e4 - 90, step / 1e4, [v and v * scale / 1000 for v in values], time / 1e6))
    return scans


# Hokuyo: six bits a character.


def scip_characters(value, width):
    return "".join(chr(0x30 + ((value >> shift) & 0x3F)) for shift in range(6 * (width - 1), -1, -6))


def scip_summed(text):
    return text + chr((sum(map(ord, text)) & 0x3F) + 0x30)


def scip(command, first, last, group, width, values, times, parameters):
    lines = []
    if parameters:
        lines += ["PP", "00P"]
        named = ["MODL:X", "DMIN:20", "DMAX:30000", f"ARES:{parameters[0]}", f"AMIN:{first}", f"AMAX:{last}", f"AFRT:{parameters[1]}"]
        lines += [line + ";" + scip_summed(line)[-1] for line in named] + [""]
    echo = f"{command}{first:04}{last:04}{group:02}" + ("000" if command[0] == "M" else "")
    if command[0] == "M":
        lines += [echo, "00P", ""]
    for ranges, time in zip(values, times):
        lines += [echo, "99b" if command[0] == "M" else "00P", scip_summed(scip_characters(time, 4))]
        data = "".join(scip_characters(value, width) for value in ranges)
        lines += [scip_summed(data[at : at + 64]) for at in range(0, len(data), 64)] + [""]
    return ("\n".join(lines) + "\n").encode()


def scip_scans(first, group, steps, front, values, times):
    degrees = 360 / steps
    start = (first + (group - 1) / 2 - front) * degrees
    ranges = [[None if v < 20 or v >= 65533 else v / 1000 for v in scan_values] for scan_values in values]
    return [scan(start, group * degrees, r, time / 1000) for r, time in zip(ranges, times)]


def dp_slam(poses, values):
    lines = []
    for (x, y, theta), ranges in zip(poses, values):
        lines.append(f"Odometry {x} {y} {theta}")
        lines.append(f"Laser {len(ranges)} " + " ".join(f"{r / 1000:.3f}" for r in ranges))
    return ("\n".join(lines) + "\n").encode()


def read_dp_slam(data):
    scans = []
    odometry = None
    for line in data.decode().splitlines():
        word, *numbers = line.split()
        if word == "Odometry":
            odometry = [float(number) for number in numbers]
        else:
            # Its source has the readings a degree apart, from 90 degrees to the right on.
            scans.append({**scan(-90, 1, [float(number) for number in numbers[1:]], None), "odometry": odometry})
    return scans


def scan(start, step, ranges, time):
    return {"start": start, "step": step, "ranges": [r or None for r in ranges], "time": time}


def livox():
    store = get_typestore(Stores.ROS2_HUMBLE)
    point = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line"
    message = "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\nlivox/CustomPoint[] points"
    store.register(get_types_from_msg(point, "livox/msg/CustomPoint"))
    store.register(get_types_from_msg(message, "livox/msg/CustomMsg"))
    import numpy as np

    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=1_700_000_000, nanosec=250_000_000)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="livox_frame")
    points = [
        types["livox/msg/CustomPoint"](
            offset_time=1000 * i, x=math.cos(i) * i, y=math.sin(i) * i, z=0.25 * i, reflectivity=i, tag=16, line=i % 6
        )
        for i in range(1, 40)
    ]
    whole = types["livox/msg/CustomMsg"](
        header=header, timebase=12345678901234, point_num=len(points), lidar_id=1, rsvd=np.zeros(3, np.uint8), points=points
    )
    data = bytes(store.serialize_cdr(whole, "livox/msg/CustomMsg"))
    again = store.deserialize_cdr(data, "livox/msg/CustomMsg")
    positions = [float(np.float32(value)) for p in again.points for value in (p.x, p.y, p.z)]
    return {"file": base64.b64encode(data).decode(), "stamp": [again.header.stamp.sec, again.header.stamp.nanosec], "positions": positions}


def case(data, scans):
    return {"file": base64.b64encode(data).decode(), "scans": scans}


telegrams = [
    (1.0, -450000, 5000, varied(541, 20, 20000), 2_500_000, 0),
    (2.0, 0, 2500, [0, *varied(30, 20, 40000)], 2_540_000, 2),
    (1.0, -50000, 3333, varied(12, 0, 3), 2_580_000, 1),
]
binary, text = sick_binary(telegrams), sick_text(telegrams)
urg = [varied(682, 0, 4095) for _ in range(2)]
utm = [[*varied(1080, 0, 60000), 65533]]
grouped = [varied(228, 20, 4000)]
rooms = [varied(180, 300, 8000), varied(181, 300, 8000)]
log = dp_slam([(0.0, 0.0, 0.0), (0.125, -0.0625, 0.25)], rooms)
print(
    json.dumps(
        {
            "sick_binary": case(binary, read_sick_binary(binary)),
            "sick_text": case(text, read_sick_text(text)),
            "scip_gs": case(scip("GS", 44, 725, 1, 2, urg, [100, 200], None), scip_scans(44, 1, 1024, 384, urg, [100, 200])),
            "scip_md": case(scip("MD", 0, 1080, 1, 3, utm, [16777215], (1440, 540)), scip_scans(0, 1, 1440, 540, utm, [16777215])),
            "scip_gd": case(scip("GD", 44, 725, 3, 3, grouped, [7], (1024, 384)), scip_scans(44, 3, 1024, 384, grouped, [7])),
            "dp_slam": case(log, read_dp_slam(log)),
            "livox": livox(),
        }
    )
)
