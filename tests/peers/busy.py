"""Keeps a driver of plcio busy without a pause, until SIGTERM; then prints how much it has done.

busy.py opcua PORT FOLDER           four clients of OPC UA read all variables of examples/retrofit and write STOPS; the
                                    folder holds the key and the password of its panel
busy.py mqtt PORT GROUP/NODE NAME   a host sends commands that set a bit, and asks for birth certificates
"""

import asyncio
import pathlib
import signal
import sys
import time

done = {}


def say_and_end(*_):
    print(" ".join(f"{what}: {count}" for what, count in done.items()), flush=True)
    raise SystemExit(0)


async def opcua_client(port, folder):
    from asyncua import Client, ua
    from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

    client = Client(f"opc.tcp://127.0.0.1:{port}/", timeout=30)
    client.application_uri = "urn:example:panel"
    await client.set_security(
        SecurityPolicyBasic256Sha256, str(folder / "panel.der"), str(folder / "panel.pem"),
        server_certificate=str(folder / "opcua/own/cert.der"),
    )
    client.set_user("panel")
    client.set_password((folder / "users").read_text().strip().removeprefix("panel:"))
    try:
        await client.connect()
    except ua.UaError:
        # The server does not know the certificate the first time.
        for rejected in (folder / "opcua/rejected").glob("*.der"):
            rejected.rename(folder / "opcua/trusted" / rejected.name)
        raise
    spaces = await client.get_namespace_array()
    space = next(index for index, uri in enumerate(spaces) if ":plcc:" in uri)
    names = ["LSLEFT", "LSRGHT", "GUARD", "ATSPD", "LEFT", "RIGHT", "SPINON", "SPINOK", "STOPS", "ATEND", "WASEND"]
    nodes = [client.get_node(ua.NodeId(name, space)) for name in names]
    subscription = await client.create_subscription(100, Changes())
    await subscription.subscribe_data_change(nodes)
    stops = nodes[names.index("STOPS")]
    while True:
        await client.read_values(nodes)
        await stops.write_value(ua.Variant(done["OPC UA requests"] % 1000, ua.VariantType.Int16))
        done["OPC UA requests"] += 2


class Changes:
    def datachange_notification(self, *_):
        pass


async def opcua(port, folder):
    done["OPC UA requests"] = 0
    while not (folder / "opcua/own/cert.der").exists():
        await asyncio.sleep(0.1)

    async def again():
        while True:
            try:
                await opcua_client(port, folder)
            except Exception as error:
                print(repr(error), file=sys.stderr)
                await asyncio.sleep(0.5)

    await asyncio.gather(*(again() for _ in range(4)))


def mqtt(port, node, name):
    import paho.mqtt.client as client_of
    from pysparkplug import DataType, Metric, NCmd, get_current_timestamp

    done.update({"MQTT commands": 0, "messages": 0})

    def count(*_):
        done["messages"] += 1

    group, edge = node.split("/")
    client = client_of.Client(client_id="busy")
    client.on_message = count
    client.on_connect = lambda client, *_: client.subscribe(f"spBv1.0/{group}/#")
    while True:
        try:
            client.connect("127.0.0.1", port)
            break
        except OSError:
            time.sleep(0.1)
    client.loop_start()

    def command(metric, datatype, value):
        metrics = [Metric(timestamp=get_current_timestamp(), name=metric, datatype=datatype, value=value)]
        payload = NCmd(timestamp=get_current_timestamp(), metrics=metrics).encode()
        sent = client.publish(f"spBv1.0/{group}/NCMD/{edge}", payload, qos=1)
        done["MQTT commands"] += 1
        # At most twenty are on their way.
        if done["MQTT commands"] % 20 == 0:
            sent.wait_for_publish(60)

    while True:
        for value in range(100):
            command(name, DataType.BOOLEAN, value % 2 == 1)
        command("Node Control/Rebirth", DataType.BOOLEAN, True)


signal.signal(signal.SIGTERM, say_and_end)
match sys.argv[1:]:
    case ["opcua", port, folder]:
        asyncio.run(opcua(int(port), pathlib.Path(folder)))
    case ["mqtt", port, node, name]:
        mqtt(int(port), node, name)
    case _:
        raise SystemExit(__doc__)
