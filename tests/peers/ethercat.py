"""plcio's EtherCAT terminals with a simulated segment (ethercat_segment.py), in a network name space of its own."""

import os
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

from ethercat_segment import ETHERTYPE, INIT, OP, Segment, Terminal
from plant import Plant, wait_until

HEAD = """[plcio]
answer_ms = 300
silence_ms = 1500
log = "plcio.jsonl"
ethercat-terminals = ["EK1100", "EL1008", "0x2:0x07d83052", "EL3102", "*"]
"""
WIRING = (
    HEAD
    + """[[io]]
name = "DOOR"
driver = "ethercat"
address = "ec0/1/in/0.3"
safe = 1
timeout_ms = 1000
[[io]]
name = "LEVEL"
driver = "ethercat"
address = "ec0/3/in/2:i16"
timeout_ms = 1000
[[io]]
name = "PUMP"
driver = "ethercat"
address = "ec0/2/out/0.7"
[[io]]
name = "COPY"
driver = "ethercat"
address = "ec0/4/out/0:i16"
scale = -0.001
[[io]]
name = "COPY"
driver = "ethercat"
address = "ec0/4/out/2:u8"
scale = 0.05
"""
)


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def link(name, way):
    ip("link", "set", name, way)


def terminals():
    """A coupler with digital inputs and outputs, and analogue ones, which have a mailbox."""
    return [
        Terminal("EK1100", 0x044C2C52),
        Terminal("EL1008", 0x03F03052, inputs=[1] * 8),
        Terminal("EL2008", 0x07D83052, outputs=[1] * 8),
        Terminal("EL3102", 0x0C1E3052, inputs=[16, 16, 16, 16], coe=True),
        Terminal("EL4102", 0x10063052, outputs=[16, 16], coe=True),
    ]


class Wired(Plant):
    """The plant, and the segment."""

    def __init__(self, segment, wiring=WIRING):
        self.segment = segment
        self.door(1)
        super().__init__(wiring)

    def door(self, bit):
        self.segment.terminals[1].inputs[0] = 0xF7 | bit << 3

    def level(self, value):
        struct.pack_into("<h", self.segment.terminals[3].inputs, 2, value)

    def pump(self):
        return self.segment.terminals[2].outputs

    def copies(self):
        return struct.unpack("<hBx", self.segment.terminals[4].outputs)

    def follows(self):
        """The pump runs while the door is closed."""
        self.door(1)
        wait_until("the pump stands", lambda: self.pump() == b"\x00")
        self.door(0)
        wait_until("the pump runs", lambda: self.pump() == b"\x80")

    def is_lost(self, since, why):
        wait_until(f"this is noticed: {why}", lambda: any(why in event["why"] for event in self.events("lost")[since:]))

    def is_lost_and_found(self, begin, why, meanwhile=lambda: None):
        """The connection is lost, for a reason, and comes again by itself after what is done meanwhile."""
        lost, connected = len(self.events("lost")), len(self.events("connected"))
        begin()
        self.is_lost(lost, why)
        meanwhile()
        wait_until("it is connected again", lambda: len(self.events("connected")) > connected)
        self.follows()

    def recovers_from(self, what, begin, end, why):
        """What is wrong is an event, inputs become safe and outputs are off, and all recover by themselves."""
        print(what, flush=True)
        late = self.input_changes("late")

        def meanwhile():
            wait_until("the inputs are late", lambda: self.input_changes("late") > late)
            wait_until("the outputs are off", lambda: not any(self.pump()) and not any(self.copies()))
            end()

        self.is_lost_and_found(begin, why, meanwhile)

    def bears(self, what, begin, end, seconds=2):
        """What is wrong does not end the connection."""
        print(what, flush=True)
        lost = len(self.events("lost"))
        begin()
        time.sleep(seconds)
        self.follows()
        end()
        assert len(self.events("lost")) == lost, self.events("lost")[lost:]


def main():
    ip("link", "add", "ec0", "type", "veth", "peer", "name", "ec1")
    link("ec0", "up")
    link("ec1", "up")
    segment = Segment("ec1", terminals())
    with Wired(segment) as plant:
        plant.follows()
        [connected] = plant.events("connected")
        assert (connected["device"], connected["terminals"]) == ("ec0", "EK1100, EL1008, EL2008, EL3102, EL4102"), connected
        values(plant)
        # The control dies: outputs are safe, and the terminals stay in OP. The next one works with them.
        plant.stop(plant.control, signal.SIGKILL)
        wait_until("the pump stands", lambda: not any(plant.pump()))
        plant.start_control()
        plant.follows()
        answers(plant, segment)
        terminals_misbehave(plant, segment)
        frames_of_others(plant)
        ends(plant, segment)
    with Wired(segment, HEAD + '[[io]]\nname = "DOOR"\ndriver = "ethercat"\naddress = "ec0/1/in/1.0"\n') as plant:
        plant.is_lost(0, "terminal 1 (EL1008) has 1 bytes of inputs, and byte 1 is wired")
        assert OP not in [terminal.state for terminal in segment.terminals]
    segment.close()
    print("EtherCAT: everything as it should be")


def values(plant):
    plant.level(12)
    wait_until("numbers arrive", lambda: plant.copies() == (-12000, 240))
    # 13 is 260 outside, which 8 bits can't hold: they stay as they are.
    plant.level(13)
    wait_until("the other number arrives", lambda: plant.copies() == (-13000, 240))
    wait_until("it is refused", lambda: any(event["name"] == "COPY" for event in plant.events("refused")))
    plant.level(3)
    wait_until("numbers arrive", lambda: plant.copies() == (-3000, 60))
    assert plant.events("accepted"), plant.events()
    # 99 is not a value of four lines: the input becomes late.
    late, recovered = plant.input_changes("late"), plant.input_changes("recovered")
    plant.level(99)
    wait_until("the input is late", lambda: plant.input_changes("late") > late)
    plant.level(0)
    wait_until("it is given again", lambda: plant.input_changes("recovered") > recovered)


def answers(plant, segment):
    """Frames that are delayed or lost."""

    def set(**what):
        return lambda: [setattr(segment, name, value) for name, value in what.items()]

    plant.recovers_from("the cable is pulled", lambda: link("ec1", "down"), lambda: link("ec1", "up"), "do not answer")
    down = lambda: link("ec0", "down")
    plant.recovers_from("the interface is switched off", down, lambda: link("ec0", "up"), "is down")
    plant.bears("answers take 10 ms", set(delay=0.01), set(delay=0))
    plant.bears("every fourth frame is lost", set(loses=4), set(loses=0))
    plant.recovers_from("answers come too late", set(delay=0.4), set(delay=0), "do not answer")
    plant.recovers_from("all frames are lost", set(loses=1), set(loses=0), "do not answer")
    plant.recovers_from("the working counter is wrong", set(counter_error=1), set(counter_error=0), "the working counter is")


def terminals_misbehave(plant, segment):
    inputs, outputs, analogue = segment.terminals[1:4]

    def set(terminal, **what):
        return lambda: [setattr(terminal, name, value) for name, value in what.items()]

    def nothing():
        pass

    def falls_back():
        with segment.lock:
            outputs.falls_back(0x001B)

    why = "terminal 2 (EL2008) is in the state SAFE-OP, since: 0x001b: Sync manager watchdog"
    plant.is_lost_and_found(falls_back, why)
    cut, joined = set(analogue, silent=True), set(analogue, silent=False)
    plant.recovers_from("the last terminals are cut off", cut, joined, "terminal 3 (EL3102) is silent")

    def loses_power():
        with segment.lock:
            for terminal in segment.terminals:
                terminal.switch_on()

    plant.is_lost_and_found(loses_power, "terminal 0 (EK1100) is")

    def refuses():
        outputs.refuses_op = True
        falls_back()

    plant.recovers_from("a terminal refuses to work", refuses, set(outputs, refuses_op=False), "No valid outputs")

    def swap():
        with segment.lock:
            segment.terminals[1:3] = [outputs, inputs]
            for terminal in segment.terminals:
                terminal.switch_on()

    def swap_back():
        assert not any(outputs.outputs) and outputs.state != OP
        with segment.lock:
            segment.terminals[1:3] = [inputs, outputs]

    plant.is_lost_and_found(swap, "terminal 1 is EL2008 (0x2:0x7d83052:0x110000), not EL1008", swap_back)

    def sends_emergencies():
        analogue.emergency = True
        falls_back()

    plant.recovers_from("a mailbox gives an emergency", sends_emergencies, set(analogue, emergency=False), "wire")

    def has_no_links():
        inputs.has_no_links = True
        falls_back()

    # The library ends by a panic there.
    plant.recovers_from("a terminal without links", has_no_links, set(inputs, has_no_links=False), "the library for EtherCAT")


def frames_of_others(plant):
    """Frames that are not answers, and more frames than can be read."""
    sender = socket.socket(socket.AF_PACKET, socket.SOCK_RAW)
    sender.bind(("ec1", ETHERTYPE))
    numbers = random.Random(7)

    def frame():
        source = bytes([0x12 if numbers.random() < 0.8 else 0x10]) + b"\x10" * 5
        kind = ETHERTYPE if numbers.random() < 0.9 else numbers.randrange(1 << 16)
        body = numbers.randbytes(numbers.randrange(0, 100))
        if numbers.random() < 0.5:
            # A header that says a length, and datagrams that say anything.
            body = struct.pack("<HBB", 0x1000 | len(body), numbers.choice([4, 7, 12]), numbers.randrange(256)) + body
        return b"\xff" * 6 + source + struct.pack(">H", kind) + body

    def send_for(seconds, pause):
        frames = [frame() for _ in range(2000)]
        end = time.monotonic() + seconds
        count = 0
        while time.monotonic() < end:
            try:
                sender.send(frames[count % len(frames)])
            except OSError:
                pass
            count += 1
            if pause:
                time.sleep(pause)
        print(f"{count} frames of others", flush=True)

    # Some may be taken for answers, so that the connection may be lost; it comes again while they go on.
    noise = threading.Thread(target=send_for, args=(6, 0.002))
    noise.start()
    plant.follows()
    noise.join()
    plant.follows()
    send_for(4, 0)
    plant.follows()
    assert plant.driver.poll() is None and plant.control.poll() is None
    sender.close()


def ends(plant, segment):
    """plcio hangs, is killed, is ended, and may not open sockets."""
    def hangs():
        plant.driver.send_signal(signal.SIGSTOP)
        wait_until("the terminals switch off by themselves", lambda: not any(plant.pump()))
        plant.driver.send_signal(signal.SIGCONT)

    plant.is_lost_and_found(hangs, "Sync manager watchdog")
    plant.stop(plant.driver, signal.SIGKILL)
    wait_until("the terminals switch off by themselves", lambda: not any(plant.pump()))
    plant.start_driver()
    plant.follows()
    plant.stop(plant.driver)
    assert [terminal.state for terminal in segment.terminals] == [INIT] * 5
    assert not any(plant.pump()) and not any(plant.copies())
    lost = len(plant.events("lost"))
    words = ["setpriv", "--bounding-set", "-net_raw", os.environ["PLCIO"], "c.toml"]
    plant.driver = plant.start(*words, name="plcio")
    plant.is_lost(lost, "CAP_NET_RAW")
    plant.stop(plant.driver)


if __name__ == "__main__":
    main()
