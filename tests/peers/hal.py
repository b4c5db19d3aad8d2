"""plcio's component of LinuxCNC's HAL, in a session that nobody else sees.

Needs root, for a name space of its own; the session itself belongs to the user nobody."""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile

from plant import Plant, wait_until

REALTIME = "/usr/lib/linuxcnc/realtime"
WIRING = """[plcio]
hal-component = "lathe"
silence_ms = 1500
log = "plcio.jsonl"
[[io]]
name = "DOOR"
driver = "hal"
safe = 1
[[io]]
name = "LEVEL"
driver = "hal"
scale = 0.5
[[io]]
name = "SPEED"
driver = "hal"
direction = "in"
[[io]]
name = "PUMP"
driver = "hal"
[[io]]
name = "COPY"
driver = "hal"
"""


def halcmd(*words, check=True):
    # HAL's own process keeps what it gets as standard output, so that a pipe would not end.
    with tempfile.TemporaryFile("w+") as output:
        done = subprocess.run(["halcmd", *words], stdout=output, stderr=output, check=False)
        output.seek(0)
        text = output.read().strip()
    assert not check or done.returncode == 0, (words, text)
    return text


def get(pin):
    return halcmd("getp", pin, check=False)


def process(words):
    """The process with this command line."""
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if path.read_bytes().decode().split("\0")[:-1] == words:
                return int(path.parent.name)
        except (OSError, UnicodeDecodeError):
            pass
    raise AssertionError(f"{words} does not run")


def children(process):
    files = pathlib.Path(f"/proc/{process}/task").glob("*/children")
    return [int(word) for file in files for word in file.read_text().split()]


EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"


class Example(Plant):
    """examples/linuxcnc, as its README says."""

    def __init__(self):
        super().__init__("")

    def start_control(self):
        program = EXAMPLES / "retrofit/lathe.pmi"
        self.run(os.environ["PLCC"], "build", str(program), "-o", "lathe.plcx")
        for name in ("controller.toml", "lathe.hal"):
            text = (EXAMPLES / "linuxcnc" / name).read_text()
            (self.folder / name).write_text(text.replace("/dev/shm/lathe", "image"))
        command = [os.environ["PLCRT"], "--config", "controller.toml", "--no-supervisor"]
        self.control = self.start(*command, name="plcrt")

    def start_driver(self):
        subprocess.run([REALTIME, "start"], check=True)
        path = f"{pathlib.Path(os.environ['PLCIO']).parent}:{os.environ['PATH']}"
        subprocess.run(["halcmd", "-f", "lathe.hal"], cwd=self.folder, check=True, env=os.environ | {"PATH": path})

    def __exit__(self, *how):
        leave(super().__exit__, how)


def leave(then, how):
    """Ends the session of HAL, and then the plant."""
    try:
        halcmd("stop", check=False)
        halcmd("unload", "all", check=False)
        subprocess.run([REALTIME, "stop"], check=False)
    finally:
        then(*how)


class Session(Plant):
    """The plant whose plcio is loaded by HAL."""

    def start_driver(self):
        subprocess.run([REALTIME, "start"], check=True)
        halcmd("loadrt", "threads", "name1=servo", "period1=1000000")
        halcmd("loadrt", "sampler", "depth=1000", "cfg=bs")
        halcmd("addf", "sampler.0", "servo")
        halcmd("loadusr", "-Wn", "lathe", os.environ["PLCIO"], str(self.folder / "c.toml"))
        halcmd("net", "door", "lathe.door")
        halcmd("net", "pump", "lathe.pump", "sampler.0.pin.0")
        halcmd("net", "copy", "lathe.copy", "sampler.0.pin.1")
        halcmd("start")

    def __exit__(self, *how):
        leave(super().__exit__, how)


class HalrunSession(Plant):
    """The plant whose session of HAL halrun starts."""

    def __init__(self, wiring):
        self.halrun = None
        super().__init__(wiring)

    def start_driver(self):
        plcio, configuration = os.environ["PLCIO"], self.folder / "c.toml"
        text = f"loadrt threads name1=servo period1=1000000\nloadusr -Wn lathe {plcio} {configuration}\n"
        (self.folder / "session.hal").write_text(text + "net door lathe.door\nnet pump lathe.pump\nstart\n")
        self.start_halrun()

    def start_halrun(self):
        with open(self.folder / "halrun.err", "ab") as output:
            words = ["halrun", "-I", "-f", "session.hal"]
            self.halrun = subprocess.Popen(words, cwd=self.folder, stdin=subprocess.PIPE, stdout=output, stderr=output)

    def halrun_says(self):
        return (self.folder / "halrun.err").read_text()

    def end_session(self):
        """As a user does whose halrun was killed."""
        with tempfile.TemporaryFile() as output:
            subprocess.run(["halrun", "-U"], stdout=output, stderr=output, check=True)

    def __exit__(self, *how):
        self.halrun.kill()
        self.halrun.wait()
        leave(super().__exit__, how)


def halrun_is_killed():
    """The session goes on without halrun; it is ended by `halrun -U`, and a new one has the component again."""
    with HalrunSession(WIRING) as plant:
        def runs():
            wait_until("the control runs", lambda: get("lathe.running") == "TRUE")
            for door, pump in (("0", "TRUE"), ("1", "FALSE"), ("0", "TRUE")):
                wait_until("the session is there", lambda: "ERROR" not in halcmd("sets", "door", door, check=False))
                wait_until("the pump follows the door", lambda: get("lathe.pump") == pump)

        runs()
        plant.halrun.kill()
        plant.halrun.wait()
        runs()
        assert not plant.events("lost"), plant.events("lost")
        plant.start_halrun()
        plant.halrun.wait()
        assert "already running" in plant.halrun_says(), plant.halrun_says()
        runs()
        driver = process([os.environ["PLCIO"], str(plant.folder / "c.toml")])
        released = plant.input_changes("released")
        plant.end_session()
        wait_until("plcio has ended", lambda: not pathlib.Path(f"/proc/{driver}").exists())
        wait_until("the inputs are safe", lambda: plant.input_changes("released") > released)
        plant.start_halrun()
        runs()


def main():
    halrun_is_killed()
    with Session(WIRING) as plant:
        types = {line.split()[4]: line.split()[1:3] for line in halcmd("-s", "show", "pin").splitlines() if " lathe." in line}
        expected = {
            "lathe.door": ["bit", "IN"],
            "lathe.level": ["float", "IN"],
            "lathe.speed": ["s32", "IN"],
            "lathe.pump": ["bit", "OUT"],
            "lathe.copy": ["s32", "OUT"],
            "lathe.running": ["bit", "OUT"],
            "lathe.heartbeat": ["bit", "OUT"],
        }
        assert types == expected, types

        def gives_values():
            halcmd("sets", "door", "0")
            halcmd("setp", "lathe.level", "18")
            halcmd("setp", "lathe.speed", "-700")
            wait_until("the pump runs", lambda: get("lathe.pump") == "TRUE" and get("lathe.copy") == "9")
            wait_until("the control runs", lambda: get("lathe.running") == "TRUE")

        gives_values()
        for value in ("TRUE", "FALSE", "TRUE"):
            wait_until("the heart beats", lambda: get("lathe.heartbeat") == value)

        def sample():
            # The sampler keeps the oldest 1000 samples.
            done = subprocess.run(["halsampler", "-n", "1200"], capture_output=True, text=True, check=True)
            return done.stdout.splitlines()[-1].split()

        wait_until("a sampler sees it", lambda: sample() == ["1", "9"])
        halcmd("sets", "door", "1")
        wait_until("the pump stands", lambda: get("lathe.pump") == "FALSE")
        gives_values()
        # The control dies: outputs are safe. The next one works with the same pins, which are still connected.
        plant.stop(plant.control, signal.SIGKILL)
        wait_until("the pump stands", lambda: get("lathe.pump") == "FALSE" and get("lathe.running") == "FALSE")
        plant.start_control()
        gives_values()
        # The component hangs, and is made again.
        driver = process([os.environ["PLCIO"], str(plant.folder / "c.toml")])
        os.kill(children(driver)[0], signal.SIGSTOP)
        wait_until("it is noticed", lambda: plant.events("lost"))
        wait_until("it is made again", lambda: len(plant.events("connected")) >= 2)
        halcmd("net", "door", "lathe.door")
        gives_values()
        # HAL unloads it, as any other component: plcio ends.
        halcmd("unload", "lathe")
        wait_until("plcio has ended", lambda: not pathlib.Path(f"/proc/{driver}").exists())
    with Session(WIRING) as plant:
        # The component is killed: that is an event, and the inputs that it gave become safe.
        wait_until("the control runs", lambda: get("lathe.running") == "TRUE")
        driver = process([os.environ["PLCIO"], str(plant.folder / "c.toml")])
        late = plant.input_changes("late")
        os.kill(children(driver)[0], signal.SIGKILL)
        wait_until("it is noticed", lambda: plant.events("lost"))
        wait_until("the inputs are late", lambda: plant.input_changes("late") > late)
        os.kill(driver, signal.SIGTERM)
        wait_until("plcio has ended", lambda: not pathlib.Path(f"/proc/{driver}").exists())
    with Example():
        wait_until("the spindle turns", lambda: get("lathe.spinon") == "TRUE" and get("lathe.running") == "TRUE")
        for value in ("TRUE", "FALSE", "TRUE"):
            wait_until("the drive follows the button", lambda: get("lathe.left") == value)
        halcmd("sets", "guard", "0")
        wait_until("the spindle stands", lambda: get("lathe.spinon") == "FALSE")
    print("HAL: everything as it should be")


if __name__ == "__main__":
    if os.geteuid() == 0 and sys.argv[1:] != ["inside"]:
        work = pathlib.Path(os.environ["WORK"])
        os.chown(work, 65534, 65534)
        os.environ.update(HOME=str(work), TMPDIR=str(work), RTAPI_FIFO_PATH=str(work / "rtapi_fifo"))
        user = ["setpriv", "--reuid", "nobody", "--regid", "nogroup", "--clear-groups"]
        os.execvp("unshare", ["unshare", "-i", *user, sys.executable, __file__, "inside"])
    main()
