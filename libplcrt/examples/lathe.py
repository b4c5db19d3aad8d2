"""Runs a lathe's program for 2 seconds from Python, with nothing but ctypes.

    plcc build examples/pmi/lathe.pmi
    python3 libplcrt/examples/lathe.py target/release/libplcrt.so lathe.plcx
"""

import ctypes
import json
import sys


class Control:
    """A control with its program."""

    OK, STOPPED, FAILED = 0, 1, -1

    def __init__(self, library, artifact, options=""):
        self.library = ctypes.CDLL(library)
        pointer, text = ctypes.c_void_p, ctypes.c_char_p
        double = ctypes.POINTER(ctypes.c_double)
        for name, result, arguments in [
            ("plcrt_error", text, []),
            ("plcrt_open", pointer, [text, text]),
            ("plcrt_close", None, [pointer]),
            ("plcrt_tick", ctypes.c_int, [pointer]),
            ("plcrt_ticks", ctypes.c_uint64, [pointer]),
            ("plcrt_get", ctypes.c_int, [pointer, text, double]),
            ("plcrt_set", ctypes.c_int, [pointer, text, ctypes.c_double]),
            ("plcrt_next_event", text, [pointer]),
            ("plcrt_dump", text, [pointer]),
            ("plcrt_retained", ctypes.c_int64, [pointer, text, ctypes.c_size_t]),
            ("plcrt_restore", ctypes.c_int, [pointer, text, ctypes.c_size_t]),
        ]:
            function = getattr(self.library, name)
            function.restype, function.argtypes = result, arguments
        self.control = self.library.plcrt_open(artifact.encode(), options.encode())
        if not self.control:
            raise OSError(self.error())

    def error(self):
        return self.library.plcrt_error().decode()

    def close(self):
        self.library.plcrt_close(self.control)
        self.control = None

    def tick(self):
        """Does one base tick; whether the program goes on."""
        status = self.library.plcrt_tick(self.control)
        if status == self.FAILED:
            raise RuntimeError(self.error())
        return status == self.OK

    def __getitem__(self, name):
        value = ctypes.c_double()
        if self.library.plcrt_get(self.control, name.encode(), ctypes.byref(value)) != self.OK:
            raise KeyError(self.error())
        return value.value

    def __setitem__(self, name, value):
        if self.library.plcrt_set(self.control, name.encode(), value) != self.OK:
            raise KeyError(self.error())

    def events(self):
        """The events that were not taken yet."""
        while (event := self.library.plcrt_next_event(self.control)) is not None:
            yield json.loads(event)

    def dump(self):
        return json.loads(self.library.plcrt_dump(self.control))

    def retained(self):
        length = self.library.plcrt_retained(self.control, None, 0)
        buffer = ctypes.create_string_buffer(length)
        self.library.plcrt_retained(self.control, buffer, length)
        return buffer.raw

    def restore(self, retained):
        if self.library.plcrt_restore(self.control, retained, len(retained)) != self.OK:
            raise ValueError(self.error())


def main():
    library, artifact = sys.argv[1:]
    control = Control(library, artifact)
    control["@NVINT[3]"] = 7
    for _ in range(100):
        if not control.tick():
            break
    for event in control.events():
        print("event", event)
    dump = control.dump()
    print(dump["state"], "after", dump["ticks"], "ticks, @NVINT[3] is", control["@NVINT[3]"])
    retained = control.retained()
    control.close()

    # The next morning: what was retained is there again.
    control = Control(library, artifact)
    control.restore(retained)
    print("@NVINT[3] was retained:", control["@NVINT[3]"])
    try:
        control["NOBODY"] = 1
    except KeyError as error:
        print(error.args[0])
    control.close()


if __name__ == "__main__":
    main()
