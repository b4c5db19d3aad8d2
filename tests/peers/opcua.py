"""plcio's server for OPC UA with the client asyncua."""

import asyncio
import logging
import os
import pathlib
import signal
import socket
import sys

from asyncua import Client, ua
from asyncua.crypto.cert_gen import setup_self_signed_certificate
from asyncua.crypto.security_policies import (
    SecurityPolicyAes128Sha256RsaOaep,
    SecurityPolicyAes256Sha256RsaPss,
    SecurityPolicyBasic256Sha256,
)
from cryptography.x509.oid import ExtendedKeyUsageOID

from plant import PATIENCE, Plant, wait_until

WIRING = """[plcio]
opcua-server = "127.0.0.1:{port}"
opcua-users = "users"
log = "plcio.jsonl"
{more}
[[io]]
name = "SPEED"
driver = "opcua"
direction = "in"
description = "the speed of the pump"
timeout_ms = 0
[[io]]
name = "DOOR"
driver = "opcua"
timeout_ms = 0
[[io]]
name = "DRAIN"
driver = "opcua"
timeout_ms = 300
[[io]]
name = "LEVEL"
driver = "opcua"
timeout_ms = 0
scale = 0.5
"""
POLICIES = [
    SecurityPolicyBasic256Sha256,
    SecurityPolicyAes128Sha256RsaOaep,
    SecurityPolicyAes256Sha256RsaPss,
]


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Values:
    """What a subscription has brought."""

    def __init__(self):
        self.seen = {}

    def datachange_notification(self, node, value, _data):
        self.seen.setdefault(node.nodeid.Identifier, []).append(value)


async def eventually(what, check):
    end = asyncio.get_running_loop().time() + PATIENCE
    while True:
        found = await check()
        if found:
            return found
        assert asyncio.get_running_loop().time() < end, f"this has not happened: {what}"
        await asyncio.sleep(0.05)


async def refused(work, *statuses):
    """Whether some work is refused, with one of these statuses if any are given."""
    try:
        await work
    except ua.UaStatusCodeError as error:
        assert not statuses or error.code in statuses, error
        return True
    except (ConnectionError, asyncio.TimeoutError, ua.UaError):
        return not statuses
    return False


async def connect(plant, port, certificate, policy=POLICIES[0], user=("panel", "secret"), mode=None):
    client = Client(f"opc.tcp://127.0.0.1:{port}/", timeout=30)
    client.application_uri = "urn:example:panel"
    if policy:
        await client.set_security(
            policy,
            certificate=str(certificate[0]),
            private_key=str(certificate[1]),
            server_certificate=str(plant.folder / "opcua/own/cert.der"),
            mode=mode or ua.MessageSecurityMode.SignAndEncrypt,
        )
    if user:
        client.set_user(user[0])
        client.set_password(user[1])
    await client.connect()
    return client


async def node(client, name):
    spaces = await client.get_namespace_array()
    index = next(number for number, uri in enumerate(spaces) if uri.endswith(":plcc:lathe"))
    return client.get_node(ua.NodeId(name, index))


async def anonymous_is_off_and_security_is_on(plant, port, certificate):
    assert await refused(connect(plant, port, certificate, policy=None, user=None))
    # A certificate that nobody trusts is refused, and kept where it can be trusted from.
    assert await refused(connect(plant, port, certificate), ua.StatusCodes.BadCertificateUntrusted)
    event = wait_until("plcio says it", lambda: plant.events("certificate_refused"))[0]
    file = pathlib.Path(event["file"])
    file = file if file.is_absolute() else plant.folder / file
    file.rename(plant.folder / "opcua/trusted" / file.name)
    assert await refused(connect(plant, port, certificate, user=None))
    assert await refused(connect(plant, port, certificate, user=("panel", "wrong")))
    assert await refused(connect(plant, port, certificate, user=("nobody", "secret")))
    for policy in POLICIES:
        for mode in (ua.MessageSecurityMode.Sign, ua.MessageSecurityMode.SignAndEncrypt):
            client = await connect(plant, port, certificate, policy, mode=mode)
            await client.disconnect()
    assert (plant.folder / "opcua/private/private.pem").stat().st_mode & 0o77 == 0


async def everything_can_be_browsed_and_read(client):
    control = await client.nodes.objects.get_child([await name_of(client)])
    found = {}
    for folder in await control.get_children():
        for child in await folder.get_children():
            found.setdefault((await folder.read_browse_name()).Name, []).append(
                (await child.read_browse_name()).Name
            )
    assert sorted(found["Inputs"]) == ["DOOR", "DRAIN", "LEVEL"], found
    assert sorted(found["Outputs"]) == ["COPY", "PUMP"], found
    assert {"SPEED", "LIST"} <= set(found["Variables"]), found
    door, level, speed, listed = [
        await node(client, name) for name in ("DOOR", "LEVEL", "SPEED", "LIST")
    ]
    assert (await door.read_data_type_as_variant_type()) == ua.VariantType.Boolean
    assert (await level.read_data_type_as_variant_type()) == ua.VariantType.Double
    assert (await speed.read_data_type_as_variant_type()) == ua.VariantType.Int16
    words = (await speed.read_description()).Text
    assert words == "the speed of the pump: a variable (integer)", words
    assert (await listed.read_value()) == [0, 0, 0, 0]
    assert (await (await node(client, "plcio:State")).read_value()) == "running"


async def name_of(client):
    index = (await node(client, "DOOR")).nodeid.NamespaceIndex
    return ua.QualifiedName("lathe", index)


async def writes_reach_the_program_and_subscriptions_see_it(client):
    door, level, speed, pump, copy, listed = [
        await node(client, name) for name in ("DOOR", "LEVEL", "SPEED", "PUMP", "COPY", "LIST")
    ]
    values = Values()
    subscription = await client.create_subscription(100, values)
    await subscription.subscribe_data_change([pump, copy, listed])
    await door.write_value(ua.Variant(True, ua.VariantType.Boolean))
    await level.write_value(ua.Variant(18.0, ua.VariantType.Double))
    await speed.write_value(ua.Variant(-700, ua.VariantType.Int16))

    async def seen(name, value):
        return value in values.seen.get(name, [])

    await eventually("the pump stands", lambda: seen("PUMP", False))
    await eventually("the level is copied", lambda: seen("COPY", 9))
    await eventually("the speed is copied", lambda: seen("LIST", [0, 0, -700, 0]))
    await door.write_value(ua.Variant(False, ua.VariantType.Boolean))
    await eventually("the pump runs", lambda: seen("PUMP", True))
    bad = ua.StatusCodes
    # What is not allowed, does not fit, or is of another type is refused.
    for target, value, statuses in [
        (pump, ua.Variant(False), (bad.BadUserAccessDenied, bad.BadNotWritable)),
        (listed, ua.Variant([0, 0, 0, 0], ua.VariantType.Int16), (bad.BadUserAccessDenied, bad.BadNotWritable)),
        (level, ua.Variant(99.0, ua.VariantType.Double), (bad.BadOutOfRange,)),
        (level, ua.Variant(float("nan"), ua.VariantType.Double), (bad.BadOutOfRange,)),
        (speed, ua.Variant(1.5, ua.VariantType.Double), (bad.BadTypeMismatch,)),
        (speed, ua.Variant("x"), (bad.BadTypeMismatch,)),
    ]:
        assert await refused(target.write_value(value), *statuses), (target, value)
    assert (await speed.read_value()) == -700
    await subscription.delete()


async def the_next_control_is_served(plant, port, certificate):
    client = await connect(plant, port, certificate)
    plant.stop(plant.control, signal.SIGKILL)
    # The pump ran; it is safe now, and clients see that nobody computes the values.
    state, pump = await node(client, "plcio:State"), await node(client, "PUMP")

    async def is_safe():
        value = await pump.read_data_value(raise_on_bad_status=False)
        uncertain = value.StatusCode.value == ua.StatusCodes.UncertainLastUsableValue
        return uncertain and value.Value.Value is False and await state.read_value() == "silent"

    await eventually("the values are those of a dead control", is_safe)
    try:
        await client.disconnect()
    except Exception:
        pass  # The server has ended its connections.
    plant.start_control()
    await eventually("plcio leaves the control", lambda: told(plant, "control_left", 1))
    await eventually("plcio finds the control", lambda: told(plant, "control_found", 2))

    await eventually("the next control is served", lambda: serves(plant, port, certificate))


async def a_dead_control_is_told_from_a_dead_network(plant, port, certificate):
    """The server goes on when the control has died or ended, until the next one is found."""
    for how in (signal.SIGKILL, signal.SIGTERM):
        client = await connect(plant, port, certificate)
        await eventually("the control runs", lambda: runs(client))
        left, off = len(plant.events("control_left")), len(plant.events("server_off"))
        state, pump, speed = [await node(client, name) for name in ("plcio:State", "PUMP", "SPEED")]
        await (await node(client, "DOOR")).write_value(ua.Variant(False, ua.VariantType.Boolean))

        async def pumps():
            return await pump.read_value()

        await eventually("the pump runs", pumps)
        if how == signal.SIGKILL:
            # The supervisor writes that the control is dead.
            children = pathlib.Path(f"/proc/{plant.control.pid}/task/{plant.control.pid}/children").read_text()
            os.kill(int(children.split()[0]), how)
            plant.control.wait(PATIENCE)
        else:
            plant.stop(plant.control, how)
        await eventually("plcio has left the control", lambda: told(plant, "control_left", left + 1))

        async def says_so(client):
            state, pump = await node(client, "plcio:State"), await node(client, "PUMP")
            value = await pump.read_data_value(raise_on_bad_status=False)
            assert value.StatusCode.value == ua.StatusCodes.UncertainLastUsableValue, value
            assert value.Value.Value is False, value
            assert await state.read_value() == "ended"

        await asyncio.sleep(1)
        await says_so(client)
        # Who connects now sees the same.
        another = await connect(plant, port, certificate)
        await says_so(another)
        await another.disconnect()
        value = ua.Variant(7, ua.VariantType.Int16)
        assert await refused(speed.write_value(value), ua.StatusCodes.BadOutOfService)
        assert len(plant.events("server_off")) == off
        try:
            plant.start_control()
            await eventually("the server ends", lambda: told(plant, "server_off", off + 1))
            await client.disconnect()
        except Exception:
            pass  # The server has ended its connections.
        await eventually("the next control is served", lambda: serves(plant, port, certificate))
    assert plant.events("server_off")[-1]["why"] == "another image file is served", plant.events("server_off")


async def serves(plant, port, certificate):
    try:
        client = await connect(plant, port, certificate)
    except Exception:
        return False
    value = await (await node(client, "plcio:State")).read_value()
    await client.disconnect()
    return value == "running"


def raw_connection(port, *parts):
    """A connection that sends bytes, and nothing after that."""
    connection = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
    for part in parts:
        try:
            connection.sendall(part)
        except OSError:
            break  # The server has closed it already.
    return connection


async def clients_that_misbehave_harm_nobody(plant, port, certificate):
    panel = await connect(plant, port, certificate)
    drain, speed = await node(panel, "DRAIN"), await node(panel, "SPEED")

    async def is_served(value):
        await speed.write_value(ua.Variant(value, ua.VariantType.Int16))

        async def is_read():
            return await speed.read_value() == value

        await eventually("the program has the value", is_read)

    # Who sends garbage, a message that is too long or half of one, and then hangs.
    endless = b"HELF" + (0x7FFFFFFF).to_bytes(4, "little")
    open_secure_channel = b"OPNF" + (64).to_bytes(4, "little") + bytes(20)
    silent = [raw_connection(port, *parts) for parts in ([], [b"\xff" * 65536], [endless], [b"HEL"], [open_secure_channel])]
    # Who makes many connections and says nothing.
    silent += [raw_connection(port) for _ in range(200)]
    await is_served(1)
    another = await connect(plant, port, certificate)
    await another.disconnect()
    # Who subscribes and then reads nothing.
    deaf = await connect(plant, port, certificate)
    subscription = await deaf.create_subscription(100, Values())
    await subscription.subscribe_data_change([await node(deaf, "SPEED"), await node(deaf, "LIST")])
    deaf.uaclient.protocol.transport.pause_reading()
    for value in range(100):
        await is_served(value)
    # Who leaves without a word: an input that was given is late, until somebody gives it again.
    late, recovered = plant.input_changes("late"), plant.input_changes("recovered")
    leaving = await connect(plant, port, certificate)
    await (await node(leaving, "DRAIN")).write_value(ua.Variant(True))
    leaving.uaclient.protocol.transport.abort()

    async def is_late():
        return plant.input_changes("late") > late

    await eventually("the input is late", is_late)

    async def is_given():
        await drain.write_value(ua.Variant(True))
        return plant.input_changes("recovered") > recovered

    await eventually("the input is given again", is_given)
    # Who takes all sessions, and leaves without a word. The panel keeps its own, and sessions become free again.
    many = []
    while not await refused(connect_too(many, plant, port, certificate), ua.StatusCodes.BadTooManySessions):
        assert len(many) <= 16, "more sessions than are served at once"
    await is_served(2)
    for client in [*many, deaf]:
        client.uaclient.protocol.transport.abort()
    for connection in silent:
        connection.close()

    async def gets_in():
        try:
            client = await connect(plant, port, certificate)
        except ua.UaStatusCodeError as error:
            assert error.code == ua.StatusCodes.BadTooManySessions, error
            return False
        await client.disconnect()
        return True

    await eventually("sessions are free again", gets_in)
    await is_served(3)
    await panel.disconnect()


async def connect_too(many, *arguments):
    many.append(await connect(*arguments))


async def told(plant, kind, count):
    return len(plant.events(kind)) >= count


async def everybody_may_read_where_that_is_permitted(certificate):
    port = free_port()
    with Plant(WIRING.format(port=port, more="opcua-anonymous = true")) as plant:
        prepare(plant)
        client = await connect(plant, port, certificate, policy=None, user=None)
        await eventually("the control runs", lambda: runs(client))
        speed = await node(client, "SPEED")
        value = ua.Variant(5, ua.VariantType.Int16)
        assert await refused(speed.write_value(value), ua.StatusCodes.BadUserAccessDenied)
        assert await speed.read_value() == 0
        # A password never goes over a connection without encryption.
        assert await refused(connect(plant, port, certificate, policy=None))
        await client.disconnect()


async def runs(client):
    try:
        return await (await node(client, "plcio:State")).read_value() == "running"
    except ua.UaStatusCodeError:
        return False


def prepare(plant):
    """Gives the server a user, and waits for it."""
    users = plant.folder / "users"
    users.touch(0o600)
    users.write_text("panel:secret\n")
    wait_until("the server listens", lambda: plant.events("server_on"))


async def main():
    # What clients meet here are the faults that they make themselves.
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    folder = pathlib.Path(sys.argv[1])
    certificate = (folder / "panel.der", folder / "panel.pem")
    await setup_self_signed_certificate(
        certificate[1], certificate[0], "urn:example:panel", "localhost",
        [ExtendedKeyUsageOID.CLIENT_AUTH], {"countryName": "XX", "commonName": "panel"},
    )
    port = free_port()
    with Plant(WIRING.format(port=port, more="")) as plant:
        prepare(plant)
        await anonymous_is_off_and_security_is_on(plant, port, certificate)
        client = await connect(plant, port, certificate)
        await eventually("the control runs", lambda: runs(client))
        await everything_can_be_browsed_and_read(client)
        await writes_reach_the_program_and_subscriptions_see_it(client)
        await client.disconnect()
        await clients_that_misbehave_harm_nobody(plant, port, certificate)
        await the_next_control_is_served(plant, port, certificate)
        plant.stop(plant.control)
        plant.is_supervised = True
        plant.start_control()
        await eventually("the control is served", lambda: serves(plant, port, certificate))
        await a_dead_control_is_told_from_a_dead_network(plant, port, certificate)
        plant.stop(plant.driver)
        assert plant.events("server_off")[-1]["why"] == "plcio ends", plant.events("server_off")
    await everybody_may_read_where_that_is_permitted(certificate)
    print("OPC UA: everything as it should be")


asyncio.run(main())
