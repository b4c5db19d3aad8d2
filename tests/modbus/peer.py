#!/usr/bin/env python3
"""Peers from pymodbus, of another make than plcio.

peer.py device PORT|TTY  serves a device: unit 1, discrete input 0 is 0, input register 0 is 9
peer.py look PORT        prints coil 0 and holding register 0 of such a device
peer.py ask PORT         reads and writes what plcio serves, and prints the answers
peer.py numbers PORT     prints numbers of two and four registers that plcio serves from holding/10 on
"""
import sys

from pymodbus.client import ModbusTcpClient
from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
from pymodbus.framer import FramerType
from pymodbus.server import StartSerialServer, StartTcpServer


def device(where):
    def block(value):
        # Addresses of a device context count from 1.
        return ModbusSequentialDataBlock(1, [value] * 64)

    unit = ModbusDeviceContext(di=block(0), ir=block(9), co=block(0), hr=block(0))
    context = ModbusServerContext(devices={1: unit}, single=False)
    if where.isdigit():
        StartTcpServer(context=context, address=("127.0.0.1", int(where)))
    else:
        StartSerialServer(context=context, port=where, framer=FramerType.RTU, baudrate=19200, parity="N")


def look(port):
    with ModbusTcpClient("127.0.0.1", port=port) as peer:
        coil = peer.read_coils(0, count=1, device_id=1).bits[0]
        print(int(coil), peer.read_holding_registers(0, count=1, device_id=1).registers[0])


def ask(port):
    with ModbusTcpClient("127.0.0.1", port=port) as peer:
        print("coil", int(peer.read_coils(0, count=1).bits[0]))
        print("register", peer.read_holding_registers(0, count=1).registers[0])
        print("write", peer.write_register(1, 65526).isError())
        for name, answer in [
            ("an output", peer.write_register(0, 1)),
            ("a coil", peer.write_coil(0, True)),
            ("nothing", peer.read_holding_registers(5, count=1)),
        ]:
            print(name, answer.isError() and answer.exception_code)


def numbers(port):
    with ModbusTcpClient("127.0.0.1", port=port) as peer:
        types = peer.DATATYPE
        for number, kind, order in [
            (10, types.FLOAT32, "big"),
            (12, types.FLOAT32, "little"),
            (14, types.INT64, "big"),
            (18, types.FLOAT64, "little"),
        ]:
            registers = peer.read_holding_registers(number, count=kind.value[1]).registers
            print(peer.convert_from_registers(registers, data_type=kind, word_order=order))


if __name__ == "__main__":
    what, where = sys.argv[1:]
    if what == "device":
        device(where)
    else:
        {"look": look, "ask": ask, "numbers": numbers}[what](int(where))
