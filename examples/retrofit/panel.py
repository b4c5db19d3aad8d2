#!/usr/bin/env python3
"""The panel of the example, and its operator: panel.py PORT. It moves the carriage to both ends, switches the
spindle on, says what it sees, and ends with status 0 if the machine has done all of it."""
import socket
import struct
import sys
import time


class Panel:
    def __init__(self, port):
        self.peer = socket.create_connection(("127.0.0.1", port), timeout=5)
        self.buttons = 0

    def ask(self, request):
        self.peer.sendall(struct.pack(">HHHB", 1, 0, len(request) + 1, 1) + request)
        length = struct.unpack(">HHHB", self.receive(7))[2]
        answer = self.receive(length - 1)
        if answer[0] & 0x80:
            raise SystemExit(f"the control answers with exception {answer[1]}")
        return answer

    def receive(self, count):
        data = b""
        while len(data) < count:
            more = self.peer.recv(count - len(data))
            if not more:
                raise ConnectionError("the control has closed the connection")
            data += more
        return data

    def look(self):
        """Gives the buttons to the control; gives what moves, and how often a switch has stopped the carriage."""
        self.ask(struct.pack(">BHHBB", 15, 0, 3, 1, self.buttons))
        lamps = self.ask(struct.pack(">BHH", 2, 0, 3))[2]
        return lamps, struct.unpack(">H", self.ask(struct.pack(">BHH", 4, 0, 1))[2:4])[0]

    def hold(self, buttons, what, until):
        """Holds buttons until something is so."""
        self.buttons = buttons
        for _ in range(3000):
            lamps, stops = self.look()
            if until(lamps, stops):
                print(f"{what}: moving {lamps:03b}, stopped by switches {stops} times", flush=True)
                return stops
            time.sleep(0.02)
        raise SystemExit(f"{what}: it does not happen")


def connect(port):
    for _ in range(600):
        try:
            panel = Panel(port)
            panel.look()
            return panel
        except OSError:
            time.sleep(0.1)
    raise SystemExit("there is no control")


panel = connect(int(sys.argv[1]))
panel.hold(0b001, "to the left", lambda lamps, _: lamps == 0b001)
first = panel.hold(0b001, "at the left end", lambda lamps, _: lamps == 0)
panel.hold(0b010, "to the right", lambda lamps, _: lamps == 0b010)
panel.hold(0b010, "at the right end", lambda lamps, stops: lamps == 0 and stops > first)
panel.hold(0b100, "spindle", lambda lamps, _: lamps == 0b100)
panel.hold(0b011, "both buttons", lambda lamps, _: lamps == 0)
