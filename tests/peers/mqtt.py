"""plcio's edge node of Sparkplug B with the broker mosquitto and the messages of pysparkplug."""

import pathlib
import queue
import signal
import socket
import subprocess
import sys
import threading

import paho.mqtt.client as mqtt
from pysparkplug import Message, MessageType, Metric, DataType, NCmd, Topic, get_current_timestamp

from plant import PATIENCE, Plant, wait_until

WIRING = """[plcio]
mqtt-broker = "mqtts://localhost:{port}"
mqtt-ca = "{work}/ca.pem"
mqtt-group = "shop"
mqtt-user = "lathe"
mqtt-password = "{work}/password"
silence_ms = 1500
log = "plcio.jsonl"
[[io]]
name = "DOOR"
driver = "mqtt"
timeout_ms = 0
[[io]]
name = "LEVEL"
driver = "mqtt"
timeout_ms = 0
scale = 0.5
[[io]]
name = "SPEED"
driver = "mqtt"
direction = "in"
description = "the speed of the pump"
[[io]]
name = "DRAIN"
driver = "mqtt"
timeout_ms = 300
[[io]]
name = "PUMP"
driver = "mqtt"
[[io]]
name = "COPY"
driver = "mqtt"
"""


def certificates(work):
    """An authority, and a certificate of the broker."""

    def openssl(*words):
        subprocess.run(["openssl", *words], cwd=work, check=True, capture_output=True)

    openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=authority",
            "-keyout", "ca.key", "-out", "ca.pem")
    openssl("req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-keyout", "broker.key", "-out", "broker.csr")
    (work / "names").write_text("subjectAltName=DNS:localhost\n")
    openssl("x509", "-req", "-in", "broker.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial",
            "-days", "2", "-extfile", "names", "-out", "broker.pem")


class Broker:
    """mosquitto, by TLS with passwords for plcio, and without either for the host on another port."""

    def __init__(self, work):
        self.work = work
        with socket.socket() as one, socket.socket() as other:
            one.bind(("127.0.0.1", 0))
            other.bind(("127.0.0.1", 0))
            self.port, self.plain = one.getsockname()[1], other.getsockname()[1]
        password = work / "password"
        password.touch(0o600)
        password.write_text("secret\n")
        self.set_password("secret")
        (work / "mosquitto.conf").write_text(
            f"per_listener_settings true\nuser root\nlistener {self.port}\ncertfile {work}/broker.pem\n"
            f"keyfile {work}/broker.key\npassword_file {work}/passwd\nallow_anonymous false\n"
            f"listener {self.plain} 127.0.0.1\nallow_anonymous true\n"
        )
        self.process = None
        self.start()

    def set_password(self, password):
        words = ["mosquitto_passwd", "-b", "-c", str(self.work / "passwd"), "lathe", password]
        subprocess.run(words, check=True)

    def start(self):
        program = "/usr/sbin/mosquitto"
        errors = open(self.work / "mosquitto.err", "ab")
        self.process = subprocess.Popen([program, "-c", str(self.work / "mosquitto.conf")], stdout=errors, stderr=errors)

    def stop(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(PATIENCE)


class Host:
    """A host application that sees all messages."""

    def __init__(self, port):
        self.messages = queue.Queue()
        self.client = mqtt.Client(client_id="host")
        self.subscribed = 0
        topics = [(f"spBv1.0/shop/{kind}/#", 1) for kind in ("NBIRTH", "NDATA", "NDEATH")]
        self.client.on_connect = lambda client, *_: client.subscribe(topics)
        self.client.on_subscribe = self.has_subscribed
        self.client.on_message = lambda _client, _data, message: self.messages.put(
            (message.topic, Message.from_mqtt_message(message).payload)
        )
        wait_until("the broker is there", lambda: self.connects(port))
        self.client.loop_start()
        wait_until("the host listens", lambda: self.subscribed)

    def has_subscribed(self, *_):
        self.subscribed += 1

    def connects(self, port):
        try:
            self.client.connect("127.0.0.1", port)
            return True
        except OSError:
            return False

    def next(self, kind):
        """The next message of a kind; those of others are left out."""
        while True:
            topic, payload = self.messages.get(timeout=PATIENCE)
            if topic == f"spBv1.0/shop/{kind}/lathe":
                return payload

    def metric(self, name, value, kind="NDATA"):
        """Waits until a metric gets a value, and gives all values that came with it."""
        while True:
            found = metrics(self.next(kind))
            if name in found and found[name].value == value:
                return found

    def command(self, *given):
        payload = NCmd(timestamp=get_current_timestamp(), metrics=list(given))
        topic = Topic(message_type=MessageType.NCMD, group_id="shop", edge_node_id="lathe")
        self.client.publish(str(topic), payload.encode(), qos=1).wait_for_publish(PATIENCE)


def metrics(payload):
    return {metric.name: metric for metric in payload.metrics}


def write(name, datatype, value):
    return Metric(timestamp=get_current_timestamp(), name=name, datatype=datatype, value=value)


def main():
    work = pathlib.Path(sys.argv[1])
    certificates(work)
    broker = Broker(work)
    try:
        host = Host(broker.plain)
        with Plant(WIRING.format(port=broker.port, work=work)) as plant:
            birth = host.next("NBIRTH")
            assert birth.seq == 0, birth
            born = metrics(birth)
            types = {name: metric.datatype for name, metric in born.items()}
            assert types == {
                "bdSeq": DataType.UINT64,
                "Node Control/Rebirth": DataType.BOOLEAN,
                "Control/State": DataType.STRING,
                "DOOR": DataType.BOOLEAN,
                "LEVEL": DataType.DOUBLE,
                "SPEED": DataType.INT32,
                "DRAIN": DataType.BOOLEAN,
                "PUMP": DataType.BOOLEAN,
                "COPY": DataType.UINT16,
            }, types
            values_and_commands(host, plant)
            exceptions_only(host, plant)
            # The control dies, and another one is started: the node dies and is born with it.
            plant.stop(plant.control, signal.SIGKILL)
            plant.start_control()
            host.next("NDEATH")
            host.next("NBIRTH")
            first = the_broker_goes_and_comes(host, plant, broker)
            # plcio is killed: the broker says so.
            plant.stop(plant.driver, signal.SIGKILL)
            death = host.next("NDEATH").bd_seq_metric
            assert (death.name, death.value) == ("bdSeq", first), (death, first)
            plant.start_driver()
            host.next("NBIRTH")
            the_broker_hangs(host, plant, broker)
            the_broker_refuses(host, plant, broker)
            a_host_floods(host, plant)
            # plcio ends: it says so itself.
            plant.stop(plant.driver)
            host.next("NDEATH")
    finally:
        broker.stop()
    commands_without_a_pause()
    print("MQTT: everything as it should be")


def values_and_commands(host, plant):
    host.command(write("DOOR", DataType.BOOLEAN, False), write("LEVEL", DataType.DOUBLE, 18.0))
    host.command(write("DOOR", DataType.BOOLEAN, True))
    host.metric("PUMP", False)
    host.command(write("DOOR", DataType.BOOLEAN, False))
    host.metric("PUMP", True)
    host.command(write("SPEED", DataType.INT32, -700))
    host.metric("SPEED", -700)
    # What nobody may write, does not fit or is not a message is refused.
    host.command(write("PUMP", DataType.BOOLEAN, False), write("LEVEL", DataType.DOUBLE, 99.0))
    host.client.publish("spBv1.0/shop/NCMD/lathe", b"\xff\xff\xff", qos=1)
    wait_until("commands are refused", lambda: {"PUMP", "LEVEL", ""} <= {e["name"] for e in plant.events("refused")})
    host.command(write("Node Control/Rebirth", DataType.BOOLEAN, True))
    birth = host.next("NBIRTH")
    born = metrics(birth)
    assert birth.seq == 0
    assert (born["PUMP"].value, born["SPEED"].value, born["COPY"].value) == (True, -700, 9), born
    assert born["LEVEL"].value == 18.0 and born["Control/State"].value == "running", born


def exceptions_only(host, plant):
    """Messages have numbers in order, and come when something changes only."""
    number = 0
    for value in range(1, 5):
        host.command(write("SPEED", DataType.INT32, value))
        payload = host.next("NDATA")
        number += 1
        assert payload.seq == number, (payload, number)
        assert {name: metric.value for name, metric in metrics(payload).items()} == {"SPEED": value}, payload


def the_broker_goes_and_comes(host, plant, broker):
    before, listened = len(plant.events("connected")), host.subscribed
    broker.stop(signal.SIGKILL)
    wait_until("it is noticed", lambda: plant.events("lost"))
    broker.start()
    wait_until("plcio is connected again", lambda: len(plant.events("connected")) > before)
    wait_until("the host is connected again", lambda: host.subscribed > listened)
    host.command(write("Node Control/Rebirth", DataType.BOOLEAN, True))
    return metrics(host.next("NBIRTH"))["bdSeq"].value


def the_broker_hangs(host, plant, broker):
    """A broker that says nothing counts as lost, and inputs that nobody gives become safe; both come back."""
    before, lost, late = len(plant.events("connected")), len(plant.events("lost")), plant.input_changes("late")
    host.command(write("DRAIN", DataType.BOOLEAN, True))
    wait_until("nobody gives the input any more", lambda: plant.input_changes("late") > late)
    broker.process.send_signal(signal.SIGSTOP)
    wait_until("it is noticed", lambda: len(plant.events("lost")) > lost)
    broker.process.send_signal(signal.SIGCONT)
    wait_until("plcio is connected again", lambda: len(plant.events("connected")) > before)
    recovered = plant.input_changes("recovered")

    def is_given():
        host.command(write("DRAIN", DataType.BOOLEAN, True))
        return plant.input_changes("recovered") > recovered

    wait_until("commands come again", is_given)


def the_broker_refuses(host, plant, broker):
    """A broker that refuses the password is asked again, until it takes it."""
    before, listened, lost = len(plant.events("connected")), host.subscribed, len(plant.events("lost"))
    broker.stop()
    broker.set_password("another")
    broker.start()

    def is_refused():
        return any("refused" in event["why"] and "NotAuthorized" in event["why"] for event in plant.events("lost")[lost:])

    wait_until("the broker refuses it", is_refused)
    broker.stop()
    broker.set_password("secret")
    broker.start()
    wait_until("plcio is connected again", lambda: len(plant.events("connected")) > before)
    wait_until("the host is connected again", lambda: host.subscribed > listened)


def a_host_floods(host, plant):
    """Commands that nobody may give, in a flood: the events are few, and good commands still come through."""
    host.client.max_inflight_messages_set(1000)
    for number in range(20000):
        payload = NCmd(timestamp=1, metrics=[write(f"NONE{number % 500}", DataType.INT32, number)])
        host.client.publish("spBv1.0/shop/NCMD/lathe", payload.encode(), qos=0)
    host.command(write("SPEED", DataType.INT32, 1234))
    host.metric("SPEED", 1234)
    assert len(plant.events("refused")) <= 100, len(plant.events("refused"))
    # Values are published while commands come one after the other, too.
    stop = threading.Event()

    def commands_one_after_the_other():
        topic, number = "spBv1.0/shop/NCMD/lathe", 0
        while not stop.is_set():
            number += 1
            payload = NCmd(timestamp=1, metrics=[write("SPEED", DataType.INT32, number % 1000)])
            # No more than the broker takes: it drops what is too much.
            host.client.publish(topic, payload.encode(), qos=1).wait_for_publish(PATIENCE)

    flood = [threading.Thread(target=commands_one_after_the_other) for _ in range(4)]
    for thread in flood:
        thread.start()
    try:
        for _ in range(20):
            assert "SPEED" in metrics(host.next("NDATA"))
    finally:
        stop.set()
        for thread in flood:
            thread.join()


class FloodingBroker:
    """A broker that sends commands without a pause: there is always another one to read, whatever plcio does. mosquitto
    makes pauses, and drops what is too much."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.values = queue.Queue()
        self.is_over, self.is_pinged = threading.Event(), threading.Event()

    def packet(self, kind, body):
        length, digits = len(body), b""
        while True:
            length, digit = divmod(length, 128)
            digits += bytes([digit | (0x80 if length else 0)])
            if not length:
                return bytes([kind]) + digits + body

    def read(self, file):
        """The next packet of plcio: its kind and what follows its head."""
        [kind] = file.read(1)
        length = shift = 0
        while True:
            [digit] = file.read(1)
            length |= (digit & 0x7F) << shift
            shift += 7
            if not digit & 0x80:
                return kind, file.read(length)

    def serve(self):
        """One connection, until plcio ends it or the test is over."""
        connection, _ = self.listener.accept()
        file = connection.makefile("rb")
        assert self.read(file)[0] == 0x10
        connection.sendall(self.packet(0x20, b"\0\0"))
        kind, body = self.read(file)
        assert kind == 0x82, kind
        connection.sendall(self.packet(0x90, body[:2] + b"\1"))
        sender = threading.Thread(target=self.flood, args=(connection,), daemon=True)
        sender.start()
        try:
            while True:
                kind, body = self.read(file)
                if kind == 0xC0:
                    self.is_pinged.set()
                    continue
                topic = body[2 : 2 + int.from_bytes(body[:2], "big")].decode()
                if kind & 0xF0 == 0x30 and "/NDATA/" in topic:
                    self.values.put(topic)
        except (OSError, ValueError):
            pass
        self.is_over.set()
        sender.join()

    def flood(self, connection):
        topic = b"spBv1.0/shop/NCMD/lathe"
        commands = b""
        for number in range(1000):
            payload = NCmd(timestamp=1, metrics=[write("SPEED", DataType.INT32, number)]).encode()
            commands += self.packet(0x30, len(topic).to_bytes(2, "big") + topic + payload)
        try:
            while not self.is_over.is_set():
                connection.sendall(commands)
                if self.is_pinged.is_set():
                    self.is_pinged.clear()
                    connection.sendall(b"\xd0\0")
        except OSError:
            pass


def commands_without_a_pause():
    """Values are published while commands come without a pause, too."""
    broker = FloodingBroker()
    server = threading.Thread(target=broker.serve, daemon=True)
    server.start()
    wiring = f'''[plcio]
mqtt-broker = "mqtt://127.0.0.1:{broker.port}"
mqtt-group = "shop"
log = "plcio.jsonl"
[[io]]
name = "SPEED"
driver = "mqtt"
direction = "in"
'''
    with Plant(wiring) as plant:
        for _ in range(20):
            broker.values.get(timeout=PATIENCE)
        broker.is_over.set()
        plant.stop(plant.driver, signal.SIGKILL)
    server.join()


main()
