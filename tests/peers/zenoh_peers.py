"""Three controls of a plant with a router of zenoh, and eclipse-zenoh (from PyPI) as the dashboard.

`zenoh_peers.py WORK` is the test. `zenoh_peers.py router PORT` is the router, `zenoh_peers.py silent PORT KEY` a dashboard that
subscribes, says so, and can be stopped. `zenoh_peers.py costs` measures what the driver costs."""

import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import threading
import time

import zenoh

from plant import PATIENCE, Plant, wait_until

# The mill follows the lathe, and the saw the mill.
WIRING = """[plcio]
zenoh-connect = "tcp/127.0.0.1:{port}"
zenoh-prefix = "hall"
zenoh-name = "{name}"
silence_ms = 1500
log = "plcio.jsonl"
[[io]]
name = "DOOR"
driver = "zenoh"
{door}
[[io]]
name = "LEVEL"
driver = "zenoh"
{level}
[[io]]
name = "SPEED"
driver = "zenoh"
direction = "in"
timeout_ms = 0
scale = 0.5
[[io]]
name = "PUMP"
driver = "zenoh"
[[io]]
name = "COPY"
driver = "zenoh"
"""
WRITTEN = "timeout_ms = 0"


def followed(address):
    return f'address = "{address}"\ntimeout_ms = 1000\nsafe = 1'


def session(port, mode="client"):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    end = "listen" if mode == "router" else "connect"
    config.insert_json5(f"{end}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    return zenoh.open(config)


class Router:
    """A router in a process of its own."""

    def __init__(self, port):
        self.port = port
        self.start()

    def start(self):
        words = [sys.executable, __file__, "router", str(self.port)]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"

    def kill(self):
        self.process.kill()
        self.process.wait(PATIENCE)


class Dashboard:
    """Keeps the newest message of each key, and counts them."""

    def __init__(self, port):
        self.newest, self.counts = {}, {}
        self.session = session(port)
        self.values = self.session.declare_subscriber("hall/**", self.take)
        self.tokens = self.session.liveliness().declare_subscriber("hall/*", self.token, history=True)
        self.alive = set()

    def take(self, sample):
        key = str(sample.key_expr)
        self.newest[key] = sample.payload.to_bytes()
        self.counts[key] = self.counts.get(key, 0) + 1

    def token(self, sample):
        change = self.alive.add if sample.kind == zenoh.SampleKind.PUT else self.alive.discard
        change(str(sample.key_expr))

    def json(self, key):
        try:
            return json.loads(self.newest[key]) if key in self.newest else None
        except ValueError:
            return None

    def put(self, key, value):
        self.session.put(f"hall/{key}", value if isinstance(value, (bytes, str)) else json.dumps(value))

    def get(self, selector):
        """What is replied: by key, or the text of an error under None."""
        found = {}
        for reply in self.session.get(f"hall/{selector}", timeout=float(PATIENCE)):
            if reply.ok:
                found[str(reply.ok.key_expr)] = reply.ok.payload.to_bytes()
            else:
                found[None] = reply.err.payload.to_string()
        return found

    def value(self, key):
        """The value of a variable, as in lathe/values/PUMP, by the newest image. What a connection can't take is dropped, and only
        images come again."""
        control, _, name = key.split("/")
        image = self.json(f"hall/{control}/image")
        return image["values"].get(name) if isinstance(image, dict) and "values" in image else None

    def wait(self, key, value):
        wait_until(f"{key} becomes {value}", lambda: self.value(key) == value)


def set_lathe(board, **values):
    """Writes inputs of the lathe. What a connection drops is written again."""
    for name, value in values.items():
        def arrives():
            board.put(f"lathe/set/{name}", value)
            return board.value(f"lathe/values/{name}") == value
        wait_until(f"{name} becomes {value}", arrives)


def passes_through(board):
    """A value goes from the dashboard through all three controls; each inverts it."""
    for door in (True, False):
        set_lathe(board, DOOR=door, LEVEL=9 + door)
        board.wait("lathe/values/PUMP", not door)
        board.wait("mill/values/PUMP", door)
        board.wait("saw/values/PUMP", not door)
        board.wait("saw/values/COPY", 9 + door)


def main():
    work = pathlib.Path(sys.argv[1])
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    router = Router(port)

    def wiring(name, door, level):
        return WIRING.format(port=port, name=name, door=door, level=level)

    with (
        Plant(wiring("lathe", WRITTEN, WRITTEN)) as lathe,
        Plant(wiring("mill", followed("lathe/PUMP"), followed("lathe/COPY"))) as mill,
        Plant(wiring("saw", followed("mill/PUMP"), followed("mill/COPY"))) as saw,
    ):
        try:
            board = Dashboard(port)
            wait_until("all are there", lambda: board.alive == {"hall/lathe", "hall/mill", "hall/saw"})
            passes_through(board)
            queries(board)
            refusals(board, lathe)
            flood(board, port, lathe)
            a_dashboard_that_hangs(board, port)
            a_false_control(board, lathe, mill)
            a_driver_is_killed(board, mill, saw)
            a_control_is_killed(board, lathe, mill)
            router_goes_and_comes(board, router, lathe, mill)
            record(board, work)
            # plcio ends: its token vanishes.
            lathe.stop(lathe.driver)
            wait_until("the lathe has left", lambda: "hall/lathe" not in board.alive)
            board.session.close()
        finally:
            router.kill()
    a_driver_is_the_router()
    print("zenoh: everything as it should be")


def a_driver_is_the_router():
    """Two controls without a router: the plcio of one of them is it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    first = WIRING.format(port=port, name="lathe", plcc="plcc", door=WRITTEN, level=WRITTEN).replace("zenoh-connect", "zenoh-listen")
    second = WIRING.format(port=port, name="mill", plcc="plcc", door=followed("lathe/PUMP"), level=followed("lathe/COPY"))

    def connects():
        try:
            return Dashboard(port)
        except zenoh.ZError:
            return None

    with Plant(first) as lathe, Plant(second) as mill:
        for end in (signal.SIGKILL, None):
            board = wait_until("the lathe listens", connects)
            wait_until("both are there", lambda: board.alive == {"hall/lathe", "hall/mill"})
            for door in (True, False):
                set_lathe(board, DOOR=door)
                board.wait("mill/values/PUMP", door)
            board.session.close()
            if end:
                lost = len(mill.events("lost"))
                lathe.stop(lathe.driver, end)
                wait_until("the mill notices it", lambda: len(mill.events("lost")) > lost)
                lathe.start_driver()


def queries(board):
    values = board.get("*/values/*")
    assert len(values) == 15 and values["hall/saw/values/COPY"] == b"9", values
    set_lathe(board, SPEED=700)
    found = board.get("lathe/**")
    image = json.loads(found["hall/lathe/image"])
    expected = {"DOOR": False, "LEVEL": 9, "SPEED": 700, "PUMP": True, "COPY": 9}
    assert image["state"] == "running" and image["tick"] > 0 and image["values"] == expected, image
    assert found["hall/lathe/state"] == b'"running"'
    events = [json.loads(line)["kind"] for line in found["hall/lathe/events/plcio"].decode().splitlines()]
    assert "control_found" in events and "connected" in events, events
    assert not any("record" in key for key in found), found.keys()
    assert board.counts["hall/lathe/values/PUMP"] > 1 and "hall/lathe/values/NONE" not in board.counts
    wait_until("images come without a change", lambda: board.counts["hall/saw/image"] > 5)


def refusals(board, lathe):
    """Nobody may write outputs, what is not a variable, or values that do not fit."""
    for name, value in [
        ("PUMP", True), ("NONE", 1), ("LEVEL", 16), ("LEVEL", -1), ("LEVEL", 1e300), ("SPEED", "fast"), ("DOOR", 2),
        ("DOOR", b"\xff\0"), ("DOOR", b""), ("DOOR", b"[" * 100000), ("SPEED", b"9" * 1000000), ("SPEED", b"null"),
    ]:
        board.put(f"lathe/set/{name}", value)
    board.session.delete("hall/lathe/set/SPEED")
    # Beyond the longest message: the connection may end, and comes again.
    board.put("lathe/set/SPEED", b"7" * (20 << 20))
    wait_until("they are refused", lambda: {"PUMP", "NONE", "LEVEL", "SPEED", "DOOR"} <= {e["name"] for e in lathe.events("refused")})
    set_lathe(board, SPEED=702)
    passes_through(board)


def flood(board, port, lathe):
    """A peer writes without a pause, most of it wrong: values still come, and good ones still arrive."""
    stop = threading.Event()

    def write():
        own = session(port)
        number = 0
        while not stop.is_set():
            number += 1
            own.put(f"hall/lathe/set/NONE{number % 500}", "1")
            own.put("hall/lathe/set/SPEED", str(2 * (number % 500)))
        own.close()

    thread = threading.Thread(target=write)
    thread.start()
    try:
        before = board.counts["hall/lathe/image"]
        wait_until("images come meanwhile", lambda: board.counts["hall/lathe/image"] > before + 20)
        set_lathe(board, LEVEL=3)
        board.wait("saw/values/COPY", 3)
    finally:
        stop.set()
        thread.join()
    assert len(lathe.events("refused")) <= 100, len(lathe.events("refused"))
    passes_through(board)


def a_dashboard_that_hangs(board, port):
    """A dashboard that subscribes to everything and reads nothing holds up nobody else."""
    words = [sys.executable, __file__, "silent", str(port), "hall/**"]
    other = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert other.stdout.readline() == "ready\n"
    other.send_signal(signal.SIGSTOP)
    try:
        before = board.counts["hall/lathe/image"]
        wait_until("images come meanwhile", lambda: board.counts["hall/lathe/image"] > before + 50)
        passes_through(board)
    finally:
        other.kill()
        other.wait(PATIENCE)


def a_false_control(board, lathe, mill):
    """Somebody publishes under the name of the lathe: that is an event there; what is not a message changes nothing at the mill."""
    for message in (b"", b"\xff", b"[1,2]", b'{"state":"running"}', b'{"state":"running","values":{}}'):
        board.put("lathe/image", message)
    wait_until("the lathe notices it", lambda: any(e["name"] == "hall/lathe" for e in lathe.events("refused")))
    wait_until("the mill has missed values", lambda: any(e.get("device") == "zenoh/lathe" for e in mill.events("refused")))
    passes_through(board)


def a_driver_is_killed(board, mill, saw):
    late, lost = saw.input_changes("late"), len(saw.events("lost"))
    mill.stop(mill.driver, signal.SIGKILL)
    wait_until("the mill has left", lambda: "hall/mill" not in board.alive)
    wait_until("the inputs of the saw are late", lambda: saw.input_changes("late") > late)
    wait_until("its plcio says so", lambda: len(saw.events("lost")) > lost)
    # LEVEL has its safe value.
    board.wait("saw/values/COPY", 1)
    mill.start_driver()
    wait_until("the mill is there again", lambda: "hall/mill" in board.alive)
    passes_through(board)


def a_control_is_killed(board, lathe, mill):
    late, events = mill.input_changes("late"), board.counts.get("hall/mill/events/control", 0)
    set_lathe(board, DOOR=False)
    lathe.stop(lathe.control, signal.SIGKILL)
    wait_until("its state says so", lambda: (board.json("hall/lathe/image") or {}).get("state") in ("silent", "ended"))
    board.wait("lathe/values/PUMP", False)
    wait_until("the inputs of the mill are late", lambda: mill.input_changes("late") > late)
    wait_until("that is an event", lambda: board.counts.get("hall/mill/events/control", 0) > events)
    lathe.start_control()
    passes_through(board)


def router_goes_and_comes(board, router, lathe, mill):
    late, connected = mill.input_changes("late"), len(lathe.events("connected"))
    router.kill()
    wait_until("it is noticed", lambda: any(event["device"] == "zenoh" for event in lathe.events("lost")))
    wait_until("the inputs of the mill are late", lambda: mill.input_changes("late") > late)
    router.start()
    wait_until("plcio is connected again", lambda: len(lathe.events("connected")) > connected)
    passes_through(board)


def record(board, work):
    """The file of the recorder is asked for."""
    found = board.get("lathe/record/**")
    parts = [found[key] for key in sorted(found) if "/newer/" in key]
    (work / "copy.plcrec").write_bytes(b"".join(parts))
    done = subprocess.run([os.environ["PLCC"], "replay", str(work / "copy.plcrec"), "--to", "20"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def costs():
    """Prints what the driver costs for plants of several sizes, in one of which a value changes in each tick of 5 ms."""
    import plant

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    router, tick = Router(port), os.sysconf("SC_CLK_TCK")
    print("points  changes  plcio, % of a core  router, %  images a second  bytes an image  from control to control, ms", flush=True)
    try:
        for points, changes in ((10, 0), (10, 1), (1000, 0), (1000, 1), (8000, 0), (8000, 1)):
            names = [f"V{number:04}" for number in range(points)]
            count = "V0000 = V0000 + 1\n" if changes else ""
            plant.PROGRAM = "$INPUT\nDOOR = 0/0\n$OUTPUT\nPUMP = 2/0\n$INTEGER\n" + "\n".join(names) + "\n$END\nPUMP = /DOOR\n" + count
            entries = "".join(f'[[io]]\nname = "{name}"\ndriver = "zenoh"\n' for name in [*names, "PUMP"])
            head = f'[plcio]\nzenoh-connect = "tcp/127.0.0.1:{port}"\nzenoh-prefix = "hall"\nlog = "plcio.jsonl"\n'
            door = '[[io]]\nname = "DOOR"\ndriver = "zenoh"\ntimeout_ms = 0\n{}\n'
            second = "[[io]]\nname = \"PUMP\"\ndriver = \"zenoh\"\n" + door.format('address = "one/PUMP"')
            with Plant(head + 'zenoh-name = "one"\n' + entries + door.format("")) as one, Plant(head + 'zenoh-name = "two"\n' + second):
                board = Dashboard(port)
                wait_until("both are there", lambda: board.alive == {"hall/one", "hall/two"})

                def used(process):
                    words = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
                    return (int(words[11]) + int(words[12])) / tick

                time.sleep(2)
                start, images = time.monotonic(), board.counts["hall/one/image"]
                before = used(one.driver), used(router.process)
                time.sleep(15)
                seconds = time.monotonic() - start
                shares = [100 * (used(p) - b) / seconds for p, b in zip((one.driver, router.process), before)]
                rate = (board.counts["hall/one/image"] - images) / seconds
                times = []
                for number in range(40):
                    begun = time.monotonic()
                    board.put("one/set/DOOR", number % 2 == 0)
                    expected = b"true" if number % 2 == 0 else b"false"
                    while board.newest.get("hall/two/values/PUMP") != expected:
                        time.sleep(0.0005)
                        assert time.monotonic() < begun + PATIENCE
                    times.append(time.monotonic() - begun)
                median = 1000 * sorted(times)[len(times) // 2]
                size = len(board.newest["hall/one/image"])
                print(f"{points:6}  {changes:7}  {shares[0]:18.1f}  {shares[1]:9.1f}  {rate:15.1f}  {size:14}  {median:10.1f} (longest {1000 * max(times):.0f})", flush=True)
                board.session.close()
    finally:
        router.kill()


if sys.argv[1] == "costs":
    costs()
elif sys.argv[1] == "router":
    with session(sys.argv[2], "router"):
        print("ready", flush=True)
        time.sleep(3600)
elif sys.argv[1] == "silent":
    subscribed = session(sys.argv[2])
    subscriber = subscribed.declare_subscriber(sys.argv[3], lambda sample: None)
    print("ready", flush=True)
    time.sleep(3600)
else:
    main()
