#!/usr/bin/env python3
"""Prints variables of a running control: read_image.py IMAGE [NAME...], all of them without a name."""
import mmap
import struct
import sys


def symbols(file):
    """The table of symbols: name, direction, unit, place of the value and of the lines."""
    at, count = struct.unpack_from("<QQ", file, 0x68)
    for entry in range(at, at + 48 * count, 48):
        name, length = struct.unpack_from("<II", file, entry)
        value, line = struct.unpack_from("<IBBBx", file, entry + 8), struct.unpack_from("<IBBBx", file, entry + 16)
        direction = ("variable", "input", "output")[file[entry + 0x20]]
        unit, unit_length = struct.unpack_from("<II", file, entry + 0x28)
        yield file[name:name + length].decode(), direction, file[unit:unit + unit_length].decode(), value, line


def read_tick(file):
    """A whole tick: the number of ticks done, and the process image."""
    size, = struct.unpack_from("<I", file, 0x1C)
    start, = struct.unpack_from("<Q", file, 0x20)
    for _ in range(100_000):
        before, ticks = struct.unpack_from("<QQ", file, 0x80)
        image = file[start:start + size]
        if before % 2 == 0 and struct.unpack_from("<Q", file, 0x80)[0] == before:
            return ticks, image
    raise SystemExit("the control has died while it wrote a tick")


def decode(image, place):
    """The value at a place of the process image."""
    offset, kind, bit, width = place
    if kind < 5:
        return struct.unpack_from(("<B", "<h", "<i", "<d", "<H")[kind], image, offset)[0]
    bits = int.from_bytes(image[offset:offset + (bit + width + 7) // 8], "little") >> bit & (1 << width) - 1
    if kind == 6 and bits >> (width - 1):
        return bits - (1 << width)
    return sum((bits >> 4 * n & 15) * 10**n for n in range(8)) if kind == 7 else bits


def main():
    with open(sys.argv[1], "rb") as opened:
        file = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)
    ticks, image = read_tick(file)
    print("ticks", ticks)
    for name, direction, unit, value, line in symbols(file):
        if not sys.argv[2:] or name in sys.argv[2:]:
            place = line if direction == "output" and line[3] else value
            print(name, direction, decode(image, place), unit)


if __name__ == "__main__":
    main()
