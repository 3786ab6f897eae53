"""Writes zstd.mcap and lz4.mcap: 40 messages of odometry each, in chunks packed by the reference library.

    pip install mcap==1.6.0
    python make_packed_bags.py
"""

import struct

from mcap.writer import CompressionType, Writer


def text(value):
    raw = value.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw


def pad(data, alignment):
    # Alignment counts from behind the four bytes of the encapsulation.
    return data + b"\0" * (-(len(data) - 4) % alignment)


def odometry(index):
    data = b"\0\1\0\0" + struct.pack("<iI", 100 + index // 10, index % 10 * 100_000_000) + text("odom")
    data = pad(data, 4) + text("base")
    values = [0.1 * index, 0.2, 0.3, 0.0, 0.0, 0.6, 0.8] + [0.0] * 36 + [0.0] * 6 + [0.0] * 36
    return pad(data, 8) + struct.pack(f"<{len(values)}d", *values)


for name, compression in (("zstd", CompressionType.ZSTD), ("lz4", CompressionType.LZ4)):
    with open(f"{name}.mcap", "wb") as file:
        writer = Writer(file, chunk_size=6000, compression=compression)
        writer.start(profile="ros2", library="scanstitch")
        schema = writer.register_schema(name="nav_msgs/msg/Odometry", encoding="ros2msg", data=b"")
        channel = writer.register_channel(topic="/odom", message_encoding="cdr", schema_id=schema)
        for index in range(40):
            time = (100 + index // 10) * 10**9 + index % 10 * 100_000_000
            writer.add_message(channel_id=channel, log_time=time, publish_time=time, data=odometry(index))
        writer.finish()
