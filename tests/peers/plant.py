"""A control with a small program, and plcio, for the tests with peers of another make.

The programs are named by the environment: PLCC, PLCRT and PLCIO."""

import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time

# The pump runs while the door is closed, and a number goes from an input to an output.
PROGRAM = """$INPUT
DOOR = 0/0
LEVEL = 1/0-3/B
DRAIN = 0/1
$OUTPUT
PUMP = 2/0
COPY = 3/0-3/B
$INTEGER
SPEED
LIST[4]
$END
PUMP = /DOOR
COPY = LEVEL
LIST[2] = SPEED
"""
# How long is waited for something that happens soon, on a machine that does much else.
PATIENCE = 120


def wait_until(what, check):
    """Waits until `check` gives something true, and gives that."""
    end = time.monotonic() + PATIENCE
    while True:
        found = check()
        if found:
            return found
        if time.monotonic() > end:
            raise AssertionError(f"this has not happened: {what}")
        time.sleep(0.02)


class Plant:
    """`wiring` is the rest of the configuration: the table [plcio] and the entries [[io]]."""

    # Whether a control that is started has a supervisor.
    is_supervised = False

    def __init__(self, wiring):
        self.temporary = tempfile.TemporaryDirectory(prefix="plcc-peers-")
        self.folder = pathlib.Path(self.temporary.name)
        (self.folder / "p.pmi").write_text(PROGRAM)
        head = 'artifact = "p.plcx"\nimage = "lathe.image"\nperiod = 5\nlog = "log.jsonl"\n'
        (self.folder / "c.toml").write_text(head + wiring)
        self.run(os.environ["PLCC"], "build", "p.pmi", "-o", "p.plcx")
        self.control = self.driver = None
        self.start_control()
        self.start_driver()

    def run(self, *command):
        subprocess.run(command, cwd=self.folder, check=True)

    def start(self, *command, name):
        errors = open(self.folder / f"{name}.err", "ab")
        return subprocess.Popen(command, cwd=self.folder, stdout=errors, stderr=errors)

    def start_control(self):
        # A control without a supervisor is gone when it is killed, and the next one can be started at once.
        command = [os.environ["PLCRT"], "--config", "c.toml"]
        supervisor = [] if self.is_supervised else ["--no-supervisor"]
        self.control = self.start(*command, *supervisor, name="plcrt")

    def start_driver(self):
        self.driver = self.start(os.environ["PLCIO"], "c.toml", name="plcio")

    def stop(self, process, how=signal.SIGTERM):
        process.send_signal(how)
        process.wait(PATIENCE)

    def events(self, kind=None):
        """The events of plcio, or those of one kind."""
        path = self.folder / "plcio.jsonl"
        lines = path.read_text().splitlines() if path.exists() else []
        found = [json.loads(line) for line in lines]
        return [event for event in found if kind is None or event["kind"] == kind]

    def input_changes(self, change):
        """How often inputs became `late` or `recovered`, by the control's own log."""
        path = self.folder / "log.jsonl"
        found = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
        return len([entry for entry in found if entry["kind"] == "inputs" and entry["change"] == change])

    def __enter__(self):
        return self

    def __exit__(self, failed, *_):
        for process in (self.driver, self.control):
            if process and process.poll() is None:
                self.stop(process)
        if failed:
            for path in sorted(self.folder.glob("*.err")) + [self.folder / "plcio.jsonl"]:
                print(f"--- {path.name}", path.read_text() if path.exists() else "", sep="\n")
        self.temporary.cleanup()
