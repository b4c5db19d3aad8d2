"""plcio's lines of Linux's GPIO character device, with a chip that is a library between plcio and the kernel (fake_gpio.c)."""

import os
import pathlib
import signal
import subprocess
import sys

from plant import Plant, wait_until

WIRING = """[plcio]
answer_ms = 300
silence_ms = 1500
log = "plcio.jsonl"
[[io]]
name = "DOOR"
driver = "gpio"
address = "gpiochip77/3:pull-up"
safe = 1
timeout_ms = 1000
[[io]]
name = "PUMP"
driver = "gpio"
address = "gpiochip77/5:open-drain"
[[io]]
name = "PUMP"
driver = "gpio"
address = "/dev/gpiochip77/6"
invert = true
"""
# GPIO_V2_LINE_FLAG_… of <linux/gpio.h>.
INPUT, OUTPUT, OPEN_DRAIN, PULL_UP = 1 << 2, 1 << 3, 1 << 6, 1 << 8


class Wired(Plant):
    """The plant, and the chip: line 3 is the door, lines 5 and 6 the pump, the latter inverted."""

    def __init__(self, library, state):
        self.library, self.state = library, state
        self.door(1)
        super().__init__(WIRING)

    def start_driver(self):
        words = [f"LD_PRELOAD={self.library}", f"FAKE_GPIO={self.state}"]
        self.driver = self.start("env", *words, os.environ["PLCIO"], "c.toml", name="plcio")

    def put(self, name, text):
        """Replaces a file of the chip's state as a whole."""
        new = self.state / f"{name}.py"
        new.write_text(text)
        new.rename(self.state / name)

    def door(self, bit):
        self.put("inputs", f"000{bit}0000")

    def conduct(self, how):
        self.put("conduct", how)

    def outputs(self):
        path = self.state / "outputs"
        return path.read_text()[5:7] if path.exists() else ""

    def follows(self):
        """The pump runs while the door is closed."""
        self.door(1)
        wait_until("the pump stands", lambda: self.outputs() == "01")
        self.door(0)
        wait_until("the pump runs", lambda: self.outputs() == "10")

    def recovers_from(self, conduct, why):
        """A chip that fails is an event, its input becomes safe, and both recover by themselves."""
        lost, connected = len(self.events("lost")), len(self.events("connected"))
        late = self.input_changes("late")
        self.conduct(conduct)
        wait_until(f"{conduct} is noticed", lambda: len(self.events("lost")) > lost)
        assert any(why in event["why"] for event in self.events("lost")[lost:]), self.events("lost")
        wait_until("the input is late", lambda: self.input_changes("late") > late)
        self.conduct("")
        wait_until("it is connected again", lambda: len(self.events("connected")) > connected)
        self.follows()


def main():
    work = pathlib.Path(sys.argv[1]) / "gpio"
    state = work / "state"
    state.mkdir(parents=True)
    library = work / "fake_gpio.so"
    source = pathlib.Path(__file__).with_name("fake_gpio.c")
    compiler = os.environ.get("CC", "cc")
    subprocess.run([compiler, "-shared", "-fPIC", "-Wall", "-Werror", "-o", str(library), str(source)], check=True)
    with Wired(library, state) as plant:
        plant.follows()
        flags = dict(map(int, line.split()) for line in (state / "flags").read_text().splitlines())
        assert flags == {3: INPUT | PULL_UP, 5: OUTPUT | OPEN_DRAIN, 6: OUTPUT}, flags
        # The control dies: outputs are safe. The next one works with the same lines.
        plant.stop(plant.control, signal.SIGKILL)
        wait_until("the pump stands", lambda: plant.outputs() == "01")
        plant.start_control()
        plant.follows()
        plant.recovers_from("hangs", "does not answer")
        plant.recovers_from("gone", "No such device")
        # The chip is gone when the control ends: the outputs become safe when it is there again, without a control.
        lost = len(plant.events("lost"))
        plant.conduct("gone")
        wait_until("the chip is lost", lambda: len(plant.events("lost")) > lost)
        left = len(plant.events("control_left"))
        plant.stop(plant.control)
        wait_until("the control has left", lambda: len(plant.events("control_left")) > left)
        assert plant.outputs() == "10", "nobody could write them"
        plant.conduct("")
        wait_until("the pump stands", lambda: plant.outputs() == "01")
        plant.start_control()
        plant.follows()
        # A line that belongs to another program is not given; it is asked for again.
        plant.conduct("gone")
        count = len(plant.events("lost"))
        wait_until("the chip is lost", lambda: len(plant.events("lost")) > count)
        plant.conduct("busy")
        wait_until("the line is busy", lambda: "busy" in plant.events("lost")[-1]["why"])
        plant.conduct("")
        plant.follows()
        plant.stop(plant.driver)
        assert plant.outputs() == "01", "outputs are safe when plcio ends"
        # It also ends while a chip does not answer.
        plant.start_driver()
        plant.follows()
        lost = len(plant.events("lost"))
        plant.conduct("hangs")
        wait_until("the chip is lost", lambda: len(plant.events("lost")) > lost)
        plant.stop(plant.driver)
    print("GPIO: everything as it should be")


if __name__ == "__main__":
    main()
