"""A component of LinuxCNC's HAL whose pins plcio reads and writes. plcio starts it; it is not a program of its own.

Standard input begins with a line of JSON: the component's name, its pins (name, type, whether it is an input of
the program, safe value), the period and the time after which pins become safe, in seconds. After that each line on
standard output, with the values of all inputs, is answered by a line on standard input: `1` or `0`, whether the
control is alive, and the values of all outputs; or `-`, where there is no control at the moment.
"""

import sys

# A file of the current folder is not one of Python's or LinuxCNC's modules.
sys.path[:] = [path for path in sys.path if path]

import json
import os
import select
import signal
import time


class Unloaded(Exception):
    """HAL wants the component to end."""


def unloaded(*_):
    raise Unloaded


class Lines:
    """The lines of standard input, with a limit to how long is waited for one."""

    def __init__(self):
        self.text = b""

    def next(self, seconds):
        """The next line; None where it does not come in time. Ends where there will be none."""
        end = time.monotonic() + seconds
        while b"\n" not in self.text:
            wait = end - time.monotonic()
            if wait <= 0 or not select.select([0], [], [], wait)[0]:
                return None
            more = os.read(0, 65536)
            if not more:
                raise EOFError
            self.text += more
        line, self.text = self.text.split(b"\n", 1)
        return line.decode()


def number(kind, text):
    return float(text) if kind == "float" else bool(int(text)) if kind == "bit" else int(text)


def main():
    import hal

    types = {"bit": hal.HAL_BIT, "s32": hal.HAL_S32, "u32": hal.HAL_U32, "float": hal.HAL_FLOAT}
    lines = Lines()
    setup = json.loads(lines.next(10) or sys.exit("error: nothing to do"))
    component = hal.component(setup["component"])
    pins = [(pin["name"], pin["type"], pin["input"], pin["safe"]) for pin in setup["pins"]]
    for name, kind, is_input, _ in pins:
        component.newpin(name, types[kind], hal.HAL_IN if is_input else hal.HAL_OUT)
    component.newpin("running", hal.HAL_BIT, hal.HAL_OUT)
    component.newpin("heartbeat", hal.HAL_BIT, hal.HAL_OUT)
    inputs = [(name, kind) for name, kind, is_input, _ in pins if is_input]
    outputs = [(name, kind, safe) for name, kind, is_input, safe in pins if not is_input]

    def be_safe():
        component["running"] = False
        for name, kind, safe in outputs:
            component[name] = number(kind, safe)

    signal.signal(signal.SIGTERM, unloaded)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        be_safe()
        component.ready()
        heard = time.monotonic()
        while True:
            values = (float(component[name]) if kind == "float" else int(component[name]) for name, kind in inputs)
            sys.stdout.write(" ".join(map(repr, values)) + "\n")
            sys.stdout.flush()
            while (line := lines.next(setup["silence"])) is None:
                be_safe()
            if line == "-":
                if time.monotonic() - heard > setup["silence"]:
                    be_safe()
            else:
                heard = time.monotonic()
                alive, *words = line.split()
                component["running"] = alive == "1"
                if alive == "1":
                    component["heartbeat"] = not component["heartbeat"]
                for (name, kind, _), word in zip(outputs, words):
                    component[name] = number(kind, word)
            time.sleep(setup["period"])
    except Unloaded:
        print("unloaded", flush=True)
    except (EOFError, BrokenPipeError):
        pass
    finally:
        be_safe()
        component.exit()


try:
    main()
except Exception as error:
    print(f"error: {type(error).__name__}: {error}", flush=True)
