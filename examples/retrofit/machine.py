#!/usr/bin/env python3
"""The machine of the example: a carriage with two limit switches, behind remote I/O that speaks Modbus TCP.

machine.py PORT. Coils 0 and 1 move the carriage to the left and to the right; discrete inputs 0 to 2 are the
left limit switch, the right one, and the closed guard. The carriage begins in the middle. Coil 2 is a spindle and discrete
input 3 says that it is at speed, for those who have no LinuxCNC (start --without-hal).
"""
import socketserver
import struct
import sys
import threading
import time

coils = [False] * 3
position = 50.0
speed = 0.0


def move():
    """Moves the carriage, 100 steps a second, and stops it where the way ends. The spindle needs a second for its speed."""
    global position, speed
    while True:
        time.sleep(0.01)
        position = min(max(position + coils[1] - coils[0], 0), 100)
        speed = min(max(speed + (1 if coils[2] else -1), 0), 100)


class RemoteIo(socketserver.BaseRequestHandler):
    def handle(self):
        while head := self.receive(7):
            number, _, length, unit = struct.unpack(">HHHB", head)
            request = self.receive(length - 1)
            answer = self.answer(request)
            self.request.sendall(struct.pack(">HHHB", number, 0, len(answer) + 1, unit) + answer)

    def receive(self, count):
        data = b""
        while len(data) < count and (more := self.request.recv(count - len(data))):
            data += more
        return data if len(data) == count else b""

    def answer(self, request):
        function, start, count = struct.unpack(">BHH", request[:5])
        if function == 2 and start + count <= 4:
            switches = [position > 0, position < 100, True, speed == 100][start:start + count]
            return bytes([2, 1, sum(on << bit for bit, on in enumerate(switches))])
        if function == 15 and start + count <= 3:
            for bit in range(count):
                coils[start + bit] = bool(request[6] >> bit & 1)
            return request[:5]
        return bytes([function | 0x80, 2])


class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True


threading.Thread(target=move, daemon=True).start()
Server(("127.0.0.1", int(sys.argv[1])), RemoteIo).serve_forever()
