#!/usr/bin/env python3
"""The panel of the example, and its operator, who moves the carriage to both ends, switches the spindle on, presses
both buttons at once, and says what the lamps show. Ends with status 0 if the machine has done all of it.

panel.py opcua PORT FOLDER       the panel is a client of OPC UA; the folder holds its key and password
panel.py modbus PORT             the panel asks by Modbus TCP
panel.py certificate FOLDER      makes the key, the certificate and the password for OPC UA, and runs nothing

The buttons are bits: 1 carriage to the left, 2 to the right, 4 spindle. The lamps are, too: 1 moves to the left, 2 to
the right, 4 spindle on, 8 spindle at speed.
"""
import pathlib
import secrets
import socket
import struct
import sys
import time

BUTTONS = ["PBLEFT", "PBRGHT", "PBSPIN"]
LAMPS = ["LEFT", "RIGHT", "SPINON", "SPINOK"]


class ModbusPanel:
    """Buttons are coils, lamps are discrete inputs, and the number of stops is an input register."""

    def __init__(self, port):
        self.peer = socket.create_connection(("127.0.0.1", port), timeout=5)

    def ask(self, request):
        self.peer.sendall(struct.pack(">HHHB", 1, 0, len(request) + 1, 1) + request)
        length = struct.unpack(">HHHB", self.receive(7))[2]
        answer = self.receive(length - 1)
        if answer[0] & 0x80:
            raise ConnectionError(f"the control answers with exception {answer[1]}")
        return answer

    def receive(self, count):
        data = b""
        while len(data) < count:
            more = self.peer.recv(count - len(data))
            if not more:
                raise ConnectionError("the control has closed the connection")
            data += more
        return data

    def exchange(self, buttons):
        """Gives the buttons to the control; returns the lamps, and how often a switch has stopped the carriage."""
        self.ask(struct.pack(">BHHBB", 15, 0, len(BUTTONS), 1, buttons))
        lamps = self.ask(struct.pack(">BHH", 2, 0, len(LAMPS)))[2]
        return lamps, struct.unpack(">H", self.ask(struct.pack(">BHH", 4, 0, 1))[2:4])[0]


class OpcUaPanel:
    """Every variable of the program is a node, whose identifier is its name."""

    def __init__(self, port, folder):
        import logging

        from asyncua import ua
        from asyncua.sync import Client
        from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

        server = folder / "opcua/own/cert.der"
        if not server.exists():
            raise ConnectionError("the server has no certificate yet")
        self.ua = ua
        # What goes wrong is an exception; the first time the server does not know the panel.
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)
        client = Client(f"opc.tcp://127.0.0.1:{port}/", timeout=30)
        try:
            client.application_uri = "urn:example:panel"
            client.set_security(
                SecurityPolicyBasic256Sha256, str(folder / "panel.der"), str(folder / "panel.pem"), None, str(server)
            )
            client.set_user("panel")
            client.set_password((folder / "users").read_text().strip().removeprefix("panel:"))
            client.connect()
            spaces = client.get_namespace_array()
            space = next(index for index, uri in enumerate(spaces) if uri.endswith(":plcc:image"))
        except BaseException:
            client.tloop.stop()
            trust(folder)
            raise
        self.client = client

        def node(name):
            return client.get_node(ua.NodeId(name, space))

        self.buttons = [node(name) for name in BUTTONS]
        self.lamps = [node(name) for name in [*LAMPS, "STOPS"]]

    def exchange(self, buttons):
        """Gives the buttons to the control; returns the lamps, and how often a switch has stopped the carriage."""
        pressed = [self.ua.Variant(bool(buttons >> bit & 1)) for bit in range(len(BUTTONS))]
        self.client.write_values(self.buttons, pressed)
        *lamps, stops = self.client.read_values(self.lamps)
        return sum(on << bit for bit, on in enumerate(lamps)), stops


def trust(folder):
    """Lets the server trust the panel. It puts a certificate that it does not know among those that it has rejected, from
    where somebody moves it who knows whose it is."""
    own = (folder / "panel.der").read_bytes()
    for rejected in (folder / "opcua/rejected").glob("*.der"):
        if rejected.read_bytes() == own:
            rejected.rename(folder / "opcua/trusted" / rejected.name)


def make_certificate(folder):
    """A key and a certificate of the panel, and a password that nobody else knows."""
    import asyncio

    from asyncua.crypto.cert_gen import setup_self_signed_certificate
    from cryptography.x509.oid import ExtendedKeyUsageOID

    asyncio.run(setup_self_signed_certificate(
        folder / "panel.pem", folder / "panel.der", "urn:example:panel", "localhost",
        [ExtendedKeyUsageOID.CLIENT_AUTH], {"countryName": "XX", "commonName": "panel"},
    ))
    users = folder / "users"
    users.touch(0o600)
    users.write_text(f"panel:{secrets.token_urlsafe()}\n")


def connect(make):
    """Waits until the control answers."""
    why = None
    for _ in range(1200):
        try:
            panel = make()
            panel.exchange(0)
            return panel
        except Exception as error:
            why = error
            time.sleep(0.1)
    raise SystemExit(f"panel: there is no control: {why!r}")


def operate(panel):
    def hold(buttons, what, until):
        """Holds buttons until something is so."""
        for _ in range(3000):
            lamps, stops = panel.exchange(buttons)
            if until(lamps, stops):
                print(f"{what}: lamps {lamps:04b}, stopped by switches {stops} times", flush=True)
                return stops
            time.sleep(0.02)
        raise SystemExit(f"panel: {what}: it does not happen")

    stopped = hold(0b001, "to the left", lambda lamps, _: lamps == 0b0001)
    hold(0b001, "at the left end", lambda lamps, stops: lamps == 0 and stops > stopped)
    stopped = hold(0b010, "to the right", lambda lamps, _: lamps == 0b0010)
    hold(0b010, "at the right end", lambda lamps, stops: lamps == 0 and stops > stopped)
    hold(0b100, "spindle on", lambda lamps, _: lamps == 0b0100)
    hold(0b100, "spindle at speed", lambda lamps, _: lamps == 0b1100)
    hold(0b011, "both buttons", lambda lamps, _: lamps == 0)


def main():
    match sys.argv[1:]:
        case ["opcua", port, folder]:
            panel = connect(lambda: OpcUaPanel(int(port), pathlib.Path(folder)))
        case ["modbus", port]:
            panel = connect(lambda: ModbusPanel(int(port)))
        case ["certificate", folder]:
            return make_certificate(pathlib.Path(folder))
        case _:
            raise SystemExit(__doc__)
    operate(panel)
    if isinstance(panel, OpcUaPanel):
        panel.client.disconnect()


main()
