"""A simulated EtherCAT segment at a network interface: frames pass through terminals in their order, as by ETG.1000.4.

What is simulated of a terminal: registers, the memory with its description (SII), the state machine, sync managers with
their watchdog, memory management units (FMMU), and a mailbox that answers expedited uploads of CANopen objects. Distributed
clocks are not there."""

import errno
import socket
import struct
import threading
import time

INIT, PRE_OP, SAFE_OP, OP = 1, 2, 4, 8
# The answer to a frame has this bit in its sender, which the first terminal sets.
PASSED = 0x02
ETHERTYPE = 0x88A4
# How long outputs may not be written (register 0x0420 as it is after power-up).
WATCHDOG = 0.1
MAILBOX = 0x80


def words(data):
    """Data of a category, filled up to whole words."""
    return data + b"\0" * (len(data) % 2)


class Terminal:
    """`inputs` and `outputs` are lists of the lengths in bits of its entries; `coe` says that it has a mailbox."""

    def __init__(self, name, product, inputs=(), outputs=(), coe=False, vendor=2, revision=0x00110000):
        self.name, self.coe = name, coe
        self.identity = (vendor, product, revision)
        self.bits = {"in": list(inputs), "out": list(outputs)}
        # What its terminals outside have: inputs are given by the test, outputs are read by it.
        self.inputs = bytearray((sum(inputs) + 7) // 8)
        self.outputs = bytes((sum(outputs) + 7) // 8)
        # Faults.
        self.silent = self.refuses_op = self.emergency = self.has_no_links = False
        first = 2 if coe else 0
        self.sync_managers = [(0x1000, MAILBOX, 0x26, 1), (0x1080, MAILBOX, 0x22, 2)] if coe else []
        if outputs or coe:
            self.sync_managers.append((0x1100, len(self.outputs), 0x64, 3))
        if inputs or coe:
            self.sync_managers.append((0x1180, len(self.inputs), 0x20, 4))
        self.output_manager = first if outputs else None
        self.input_manager = first + bool(outputs or coe) if inputs else None
        self.units = [{1: 0, 2: 0, 3: 1, 4: 2}[kind] for *_, kind in self.sync_managers]
        if coe:
            self.units = [1, 2, 3]
        self.objects = self.describe_objects()
        self.memory_words = self.describe()
        self.switch_on()

    def switch_on(self):
        self.memory = bytearray(0x2000)
        self.memory[0x0004:0x0006] = bytes([8, 8])
        self.state, self.error, self.code = INIT, 0, 0
        self.written = 0.0
        self.outputs = bytes(len(self.outputs))

    # The description in the terminal's memory (ETG.2010).

    def describe(self):
        head = bytearray(0x80)
        head[0x10:0x1C] = struct.pack("<3I", *self.identity)
        if self.coe:
            head[0x30:0x3A] = struct.pack("<5H", 0x1000, MAILBOX, 0x1080, MAILBOX, 4)
        head[0x7C:0x80] = struct.pack("<2H", 7, 1)
        name = self.name.encode()
        general = bytearray(32)
        general[2] = general[3] = 1
        general[5] = 0x01 if self.coe else 0
        managers = b"".join(
            struct.pack("<HHBBBB", start, length, control, 0, 1, kind) for start, length, control, kind in self.sync_managers
        )
        categories = [(10, bytes([1, len(name)]) + name), (30, bytes(general)), (40, bytes(self.units)), (41, managers)]
        for kind, bits, index, manager in (
            (50, self.bits["in"], 0x1A00, self.input_manager),
            (51, self.bits["out"], 0x1600, self.output_manager),
        ):
            if bits:
                entries = b"".join(struct.pack("<HBBBBH", 0x6000, 1 + at, 0, 1, length, 0) for at, length in enumerate(bits))
                categories.append((kind, struct.pack("<HBBBBH", index, len(bits), manager, 0, 0, 0) + entries))
        text = b"".join(struct.pack("<HH", kind, len(words(data)) // 2) + words(data) for kind, data in categories)
        return bytes(head) + text + b"\xff" * 64

    def describe_objects(self):
        """The objects by which a terminal with a mailbox says how long its process data is."""
        objects = {}
        for assignment, index, bits in ((0x1C12, 0x1600, self.bits["out"]), (0x1C13, 0x1A00, self.bits["in"])):
            objects[assignment, 0] = bytes([1 if bits else 0])
            objects[assignment, 1] = struct.pack("<H", index)
            objects[index, 0] = bytes([len(bits)])
            for at, length in enumerate(bits):
                objects[index, 1 + at] = struct.pack("<I", 0x60000000 | (1 + at) << 8 | length)
        return objects

    # What the process data interface does.

    def before_frame(self):
        """Inputs are latched, outputs are switched off when nobody has written them for too long."""
        if self.input_manager is not None:
            start = self.sync_managers[self.input_manager][0]
            self.memory[start : start + len(self.inputs)] = self.inputs
        if self.state == OP and self.outputs and time.monotonic() - self.written > WATCHDOG:
            self.falls_back(0x001B)

    def falls_back(self, code):
        """The terminal leaves OP by itself."""
        self.state, self.error, self.code = SAFE_OP, 0x10, code
        self.outputs = bytes(len(self.outputs))

    def ask_for_state(self, word):
        state = word & 0xF
        if word & 0x10:
            self.error = self.code = 0
        order = [INIT, PRE_OP, SAFE_OP, OP]
        if state not in order or order.index(state) > order.index(self.state) + 1:
            self.error, self.code = 0x10, 0x0011
        elif state == OP and self.refuses_op:
            self.error, self.code = 0x10, 0x0019
        elif state == SAFE_OP and not self.managers_are_right():
            self.error, self.code = 0x10, 0x0017
        else:
            self.state = state
            self.written = time.monotonic()
        if self.state != OP:
            self.outputs = bytes(len(self.outputs))

    def managers_are_right(self):
        for number in (self.input_manager, self.output_manager):
            if number is not None:
                start, length, *_, enable = struct.unpack_from("<HHBBH", self.memory, 0x800 + 8 * number)
                if (start, length, enable & 1) != (*self.sync_managers[number][:2], 1):
                    return False
        return True

    # Registers.

    def read(self, at, length, links):
        self.memory[0x0110:0x0112] = struct.pack("<H", links)
        self.memory[0x0130:0x0136] = struct.pack("<HHH", self.state | self.error, 0, self.code)
        data = bytes(self.memory[at : at + length]).ljust(length, b"\0")
        if self.coe and at <= 0x1080 + MAILBOX - 1 < at + length:
            self.memory[0x0800 + 8 + 5] &= ~0x08
        return data

    def write(self, at, data):
        self.memory[at : at + len(data)] = data
        end = at + len(data)
        if at <= 0x0120 < end:
            self.ask_for_state(data[0x0120 - at])
        elif at == 0x0502 and len(data) >= 4 and data[1] & 1:
            place = 2 * struct.unpack_from("<H", data, 2)[0]
            self.memory[0x0508:0x050C] = self.memory_words[place : place + 4].ljust(4, b"\xff")
            self.memory[0x0502:0x0504] = b"\0\0"
        elif self.coe and self.state != INIT and at <= 0x1000 + MAILBOX - 1 < end:
            self.answer_mailbox(bytes(self.memory[0x1000:0x1080]))

    def answer_mailbox(self, request):
        counter = request[5] & 0x70
        _, _, index, sub = struct.unpack_from("<HBHB", request, 6)
        value = self.objects.get((index, sub))
        if self.emergency:
            reply = struct.pack("<HHBBH", 10, 0, 0, 3 | counter, 0x1000) + bytes(8)
        elif value is None:
            reply = struct.pack("<HHBBHBHBI", 10, 0, 0, 3 | counter, 0x2000, 0x80, index, sub, 0x06020000)
        else:
            command = 0x43 | (4 - len(value)) << 2
            reply = struct.pack("<HHBBHBHB", 10, 0, 0, 3 | counter, 0x3000, command, index, sub) + value.ljust(4, b"\0")
        self.memory[0x1080 : 0x1080 + MAILBOX] = reply.ljust(MAILBOX, b"\0")
        self.memory[0x0800 + 8 + 5] |= 0x08

    # Logical addresses.

    def logical(self, address, data, reads, writes):
        """Maps a datagram; gives the counts of what was read and written."""
        was_read = was_written = False
        for number in range(8):
            start, length, _, _, place, _, kind, on = struct.unpack_from("<IHBBHBBB", self.memory, 0x600 + 16 * number)
            low, high = max(start, address), min(start + length, address + len(data))
            if not on & 1 or low >= high or self.state < SAFE_OP:
                continue
            ours, theirs = place + low - start, low - address
            if kind & 2 and writes and self.output_manager is not None:
                self.memory[ours : ours + high - low] = data[theirs : theirs + high - low]
                was_written, self.written = True, time.monotonic()
                if self.state == OP:
                    begin = self.sync_managers[self.output_manager][0]
                    self.outputs = bytes(self.memory[begin : begin + len(self.outputs)])
            if kind & 1 and reads:
                data[theirs : theirs + high - low] = self.memory[ours : ours + high - low]
                was_read = True
        return was_read, was_written


class Segment:
    """Terminals behind an interface. Faults are attributes, which the test sets while frames pass."""

    def __init__(self, interface, terminals):
        self.terminals = terminals
        self.lock = threading.Lock()
        # Seconds by which answers are late; every how many-th frame is lost; what is added to working counters of process data.
        self.delay, self.loses, self.counter_error = 0.0, 0, 0
        self.frames = self.answers = 0
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETHERTYPE))
        self.socket.bind((interface, ETHERTYPE))
        self.socket.settimeout(0.02)
        self.is_over = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.is_over:
            try:
                frame, about = self.socket.recvfrom(2048)
            except (TimeoutError, OSError):
                with self.lock:
                    for terminal in self.terminals:
                        terminal.before_frame()
                continue
            if about[2] == socket.PACKET_OUTGOING or frame[6] & PASSED:
                continue
            self.frames += 1
            if self.loses and self.frames % self.loses == 0:
                continue
            with self.lock:
                answer = self.passes(bytearray(frame))
            if self.delay:
                late = threading.Timer(self.delay, self.send, (answer,))
                late.daemon = True
                late.start()
            else:
                self.send(answer)

    def send(self, frame):
        try:
            self.socket.send(frame)
            self.answers += 1
        except OSError as error:
            # The cable is pulled, or nobody takes so many.
            if error.errno not in (errno.ENETDOWN, errno.ENXIO, errno.ENOBUFS, errno.EBADF):
                raise

    def close(self):
        self.is_over = True
        self.thread.join()
        self.socket.close()

    def present(self):
        """The terminals that frames reach: those behind a silent one are cut off."""
        found = []
        for terminal in self.terminals:
            if terminal.silent:
                break
            found.append(terminal)
        return found

    def passes(self, frame):
        terminals = self.present()
        for terminal in terminals:
            terminal.before_frame()
        frame[6] |= PASSED
        at, more = 16, True
        while more and at + 12 <= len(frame):
            command, _, adp, ado, length, _ = struct.unpack_from("<BBHHHH", frame, at)
            length, more = length & 0x7FF, bool(length & 0x8000)
            data = frame[at + 10 : at + 10 + length]
            (counter,) = struct.unpack_from("<H", frame, at + 10 + length)
            adp, added = self.datagram(command, adp, ado, data, terminals)
            frame[at + 10 : at + 10 + length] = data
            struct.pack_into("<H", frame, at + 2, adp)
            if command in (10, 11, 12) and added:
                added += self.counter_error
            struct.pack_into("<H", frame, at + 10 + length, (counter + added) & 0xFFFF)
            at += 12 + length
        return bytes(frame)

    def datagram(self, command, adp, ado, data, terminals):
        added = 0
        for position, terminal in enumerate(terminals):
            # Ports 0 and 1 have links, the last terminal's port 1 has none.
            links = 0x0010 | (0x0020 if position + 1 < len(terminals) else 0)
            links *= not terminal.has_no_links
            if command in (10, 11, 12):
                was_read, was_written = terminal.logical(adp | ado << 16, data, command != 11, command != 10)
                added += was_read + (2 if command == 12 else 1) * was_written
                continue
            kind, access = {1: "A", 2: "A", 4: "F", 5: "F", 7: "B", 8: "B"}.get(command), command in (2, 5, 8)
            (station,) = struct.unpack_from("<H", terminal.memory, 0x0010)
            is_meant = kind == "B" or kind == "A" and adp == 0 or kind == "F" and adp == station
            if is_meant and access:
                terminal.write(ado, bytes(data))
                added += 1
            elif is_meant:
                found = terminal.read(ado, len(data), links)
                data[:] = bytes(a | b for a, b in zip(data, found)) if kind == "B" else found
                added += 1
            if kind in ("A", "B"):
                adp = (adp + 1) & 0xFFFF
        return adp, added
