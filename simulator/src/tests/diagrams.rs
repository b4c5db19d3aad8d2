//! The timing diagrams of NCT 6.7, in the manual's order. The test plays the PLC, as the diagrams show it.

use plcc_abi::Dialect;

use super::Desk;
use super::nct::ready;
use crate::event::Told;

impl Desk {
    /// Sets several variables.
    fn set_all(&mut self, values: &[(&str, i64)]) {
        for (name, value) in values {
            self.set(name, *value);
        }
    }

    /// Does steps until a variable has a value, and gives how many.
    fn until(&mut self, name: &str, value: i64) -> u64 {
        for steps in 1..1000 {
            if self.see([name]) == [value] {
                return steps;
            }
        }
        panic!("{name} never becomes {value}");
    }

    fn steps(&mut self, count: usize) {
        (0..count).for_each(|_| self.step());
    }
}

/// A signed number as a register shows it.
fn word(number: i16) -> i64 {
    i64::from(number as u16)
}

#[test]
fn the_machine_on_request() {
    let mut desk = Desk::new(Dialect::Nct, "", &[], None);
    assert_eq!(desk.see(["I541", "I542", "I540"]), [1, 0, 0]);
    // The button, and the timer T01 in which the emergency input has to come.
    desk.set("Y540", 1);
    assert_eq!(desk.see(["I540"]), [1]);
    desk.set("Y540", 0);
    assert_eq!(desk.see(["I540"]), [0], "the timer has run off without it");
    desk.set("Y540", 1);
    assert_eq!(desk.see(["I540", "I900", "I907"]), [1, 1, 1]);
}

#[test]
fn a_servo_error_switches_everything_off_until_the_run_ends() {
    let mut desk = ready("", None);
    desk.set_all(&[("RH060", 500), ("Y652", 1), ("Y653", 1)]);
    desk.until("I656", 1);
    desk.key("SERVO 1", 1);
    assert_eq!(desk.see(["I540", "I542", "RH020"]), [0, 1, 0]);
    desk.set("Y540", 0);
    desk.steps(10);
    assert_eq!(desk.get("RH010"), 0, "the spindle has no command");
    desk.set("Y540", 1);
    assert_eq!(desk.see(["I540", "I542"]), [0, 1]);
}

#[test]
fn strobes_and_transfer_registers_of_functions() {
    let mut desk = ready("[simulator]\nmisc = \"B\"\n", Some("M3 M8 S500 T12 B90\nM30\n"));
    desk.set("Y470", 1);
    let strobes = ["I520", "I521", "I522", "I525", "I526", "I527", "I530"];
    assert_eq!(desk.see(strobes), [1, 1, 0, 1, 1, 0, 1]);
    desk.set("Y547", 0);
    assert_eq!(desk.see(strobes), [0; 7], "till the end of the period");
    let registers = ["RH000", "RH001", "RH005", "RH006", "RH008"];
    assert_eq!(desk.see(registers), [3, 8, 500, 12, 90]);
    desk.steps(5);
    desk.set("Y547", 1);
    assert_eq!(desk.see(["I520", "RH000"]), [1, 30]);
}

#[test]
fn functions_in_a_single_block() {
    let mut desk = ready("", None);
    desk.set("Y403", 1);
    desk.key("BLOCK 1", 1);
    assert_eq!(desk.see(["I546"]), [1]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I520", "RH000", "I525", "RH005", "I546"]), [1, 3, 1, 500, 1]);
    desk.set("Y547", 0);
    desk.steps(4);
    assert_eq!(desk.get("I546"), 1);
    desk.set("Y547", 1);
    assert_eq!(desk.see(["I546"]), [0]);
    desk.set("Y470", 0);
    assert_eq!(desk.see(["I546", "I547"]), [0, 0]);
}

#[test]
fn the_spindle_starts_and_stops() {
    let mut desk = ready("", None);
    desk.set_all(&[("Y650", 0), ("RH060", 600), ("Y653", 1), ("Y654", 0), ("Y652", 1)]);
    // 60 revolutions a minute in a tick; the actual speed is 100 ms behind.
    assert_eq!(desk.until("I650", 1), 10);
    assert_eq!(desk.until("I656", 1), 4);
    desk.set("Y650", 1);
    // M5: the voltage, at 0.
    desk.set_all(&[("RH061", 0), ("Y654", 1)]);
    assert_eq!(desk.until("I650", 1), 10);
    assert_eq!(desk.until("I657", 1), 5);
    desk.set_all(&[("Y652", 0), ("Y650", 0)]);
    assert_eq!(desk.see(["I650", "I656", "I657"]), [1, 1, 1]);
}

#[test]
fn the_spindle_is_oriented_from_rotation() {
    let mut desk = ready("", None);
    desk.set_all(&[("RH060", 600), ("Y653", 1), ("Y652", 1)]);
    desk.until("I656", 1);
    desk.set_all(&[("RH061", -100), ("Y654", 1)]);
    desk.steps(30);
    assert_eq!(desk.see(["I650", "I656", "I651"]), [1, 1, 0]);
    desk.set("Y651", 1);
    assert_eq!(desk.until("I651", 1), 26, "500 ms after its first step");
    assert_eq!(desk.until("I652", 1), 5);
    assert_eq!(desk.see(["RH010", "I657"]), [0, 1]);
}

#[test]
fn a_single_block_with_a_way_and_functions_is_stopped_and_goes_on() {
    let machine = "[simulator]\nblocks = [\"G0 X15 M3 S500\"]\n";
    let mut desk = ready(machine, None);
    desk.set("Y403", 1);
    desk.key("BLOCK 1", 1);
    desk.step();
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I550", "I551", "I553", "I520", "I610", "I620"]), [0, 0, 0, 1, 1, 1]);
    desk.set("Y547", 0);
    desk.steps(2);
    desk.set("Y547", 1);
    desk.step();
    // STOP: it decelerates for 100 ms.
    desk.set_all(&[("Y470", 0), ("Y471", 1)]);
    assert_eq!(desk.until("I550", 1), 6);
    assert_eq!(desk.see(["I551", "I546", "RH100"]), [0, 1, 9000]);
    desk.set_all(&[("Y470", 1), ("Y471", 0)]);
    assert_eq!(desk.see(["I550", "I551", "I610"]), [0, 0, 1]);
    // 6 mm are left, 3 in a tick; FIN is there.
    desk.step();
    assert_eq!(desk.see(["I550", "I551", "I610", "I546"]), [1, 1, 0, 0]);
}

#[test]
fn a_single_block_with_a_feed_whose_function_comes_after_it() {
    let machine = "[simulator]\nblocks = [\"G1 X2 F3000 M5\"]\n";
    let mut desk = ready(machine, None);
    desk.set("Y403", 1);
    desk.key("BLOCK 1", 1);
    desk.step();
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I553", "I550", "I551", "I520", "RH000"]), [1, 0, 0, 1, 5]);
    // The PLC waits with M5 for the empty interpolator.
    desk.set("Y547", 0);
    assert_eq!(desk.until("I551", 1), 2);
    assert_eq!(desk.see(["I553", "I546"]), [0, 1]);
    desk.set("Y547", 1);
    assert_eq!(desk.see(["I546"]), [0]);
}

#[test]
fn a_feed_asks_for_the_spindle() {
    let mut desk = ready("", Some("G1 X3 F3000\nM30\n"));
    desk.set_all(&[("Y650", 0), ("Y470", 1)]);
    assert_eq!(desk.see(["I553"]), [1]);
    desk.steps(4);
    assert_eq!(desk.see(["I551", "RH100", "RH102"]), [0, 0, 0]);
    desk.set("Y650", 1);
    assert_eq!(desk.until("I551", 1), 3);
    assert_eq!(desk.get("I553"), 0);
}

/// A spindle that turns at 600 revolutions a minute.
fn turning(part: &str) -> Desk {
    let mut desk = ready("", Some(part));
    desk.set_all(&[("RH060", 600), ("Y653", 1), ("Y652", 1), ("Y650", 1)]);
    desk.steps(20);
    desk
}

#[test]
fn a_thread_is_cut_by_the_spindle_and_stop_does_not_stop_it() {
    let mut desk = turning("G33 Z4 F2\nM30\n");
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I552", "I553", "I554", "I612", "I622"]), [1, 1, 1, 1, 0]);
    // 2 mm a revolution, 600 of them a minute: 0.4 mm in a tick, whatever F% says.
    desk.set_all(&[("RH078", 0), ("Y471", 1)]);
    assert_eq!(desk.see(["RH110", "RH112"]), [0, 400]);
    assert_eq!(desk.see(["RH112", "I550"]), [800, 0]);
    desk.set("Y650", 0);
    desk.steps(6);
    assert_eq!(desk.see(["RH110", "I550", "I552"]), [800, 0, 1], "no pulses of the encoder");
    desk.set("Y650", 1);
    assert_eq!(desk.until("I551", 1), 8);
    assert_eq!(desk.see(["I552", "I553", "I554"]), [0, 0, 0]);
}

#[test]
fn tapping_goes_down_and_up_by_its_feed_and_only_feed_hold_stops_it() {
    for code in ["G74", "G84"] {
        let mut desk = turning(&format!("{code} X3 R-1 Z-3 F3000\nM30\n"));
        desk.set("Y470", 1);
        let flags = ["I552", "I553", "I554", "I610", "I620", "I612"];
        assert_eq!(desk.see(flags), [1, 0, 0, 1, 1, 0], "rapid to X");
        assert_eq!(desk.see(flags), [1, 0, 0, 0, 0, 1], "rapid to R");
        assert_eq!(desk.see(flags), [1, 1, 0, 0, 0, 1], "feed to Z");
        desk.set_all(&[("RH078", 3), ("Y471", 1)]);
        assert_eq!(desk.see(["RH112"]), [word(-2000)], "neither F% nor STOP counts");
        desk.set("Y542", 1);
        desk.steps(6);
        assert_eq!(desk.see(["I550", "RH110"]), [1, word(-2000)]);
        desk.set("Y542", 0);
        assert_eq!(desk.see(["I550", "I553"]), [0, 1]);
        assert_eq!(desk.see(["RH112"]), [word(-1000)], "at the bottom");
        assert_eq!(desk.until("I551", 1), 2, "and back to R");
        assert_eq!(desk.see(["I552", "I553", "I612"]), [0, 0, 0]);
        desk.steps(2);
        assert_eq!(desk.see(["RH100", "RH110"]), [3000, word(-1000)]);
    }
}

#[test]
fn reset_brings_the_interpolator_to_rest() {
    let mut desk = turning("G33 Z9 F2\nM30\n");
    desk.set("Y470", 1);
    desk.steps(3);
    desk.set("I477", 1);
    assert_eq!(desk.until("I550", 1), 6);
    assert_eq!(desk.see(["I551", "I552", "I553", "I554"]), [1, 0, 0, 0]);
}

#[test]
fn automatic_mode_is_interrupted_and_taken_up_again() {
    let mut desk = ready("", Some("M8 G1 X5 F3000\nM30\n"));
    desk.set("Y470", 1);
    desk.step();
    desk.set("Y547", 0);
    desk.steps(2);
    desk.set("Y540", 0);
    assert_eq!(desk.see(["I511", "I550", "I551"]), [1, 1, 1]);
    desk.set_all(&[("Y547", 1), ("Y470", 0), ("Y540", 1)]);
    assert_eq!(desk.see(["I546", "I547"]), [1, 0]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I547"]), [1], "STOP is asked for");
    desk.set_all(&[("Y470", 0), ("Y471", 1)]);
    assert_eq!(desk.see(["I547", "RH020"]), [0, 3549]);
    desk.key("Y", 1);
    assert_eq!(desk.see(["I511", "RH020"]), [1, 0]);
    desk.set_all(&[("Y470", 1), ("Y471", 0)]);
    assert_eq!(desk.see(["I511", "I550", "I551", "I520"]), [0, 0, 0, 0]);
    desk.set("Y547", 0);
    assert_eq!(desk.until("I551", 1), 3);
}

#[test]
fn block_by_block() {
    let mut desk = ready("", Some("G0 X3\nG0 X6\nM30\n"));
    desk.set_all(&[("Y447", 1), ("Y470", 1)]);
    desk.step();
    assert_eq!(desk.see(["I551", "I547", "I546"]), [1, 1, 1]);
    desk.set_all(&[("Y470", 0), ("Y471", 1)]);
    assert_eq!(desk.see(["I547", "I546"]), [0, 1]);
    desk.set_all(&[("Y470", 1), ("Y471", 0)]);
    assert_eq!(desk.see(["I551"]), [0]);
}

#[test]
fn an_axis_with_a_brake_asks_for_its_movement() {
    let mut desk = ready("", Some("G0 X9 Y3\nM30\n"));
    desk.set_all(&[("Y610", 1), ("Y470", 1)]);
    assert_eq!(desk.see(["I610", "I611"]), [1, 1]);
    desk.steps(5);
    assert_eq!(desk.see(["RH102", "RH107"]), [0, 0], "no axis starts without the other");
    desk.set("Y610", 0);
    assert_eq!(desk.see(["RH102", "I560"]), [3000, 0]);
    assert_eq!(desk.until("I610", 0), 2);
    assert_eq!(desk.get("I560"), 0);
    assert_eq!(desk.until("I560", 1), 2, "in position");
    desk.set("Y610", 1);
    assert_eq!(desk.see(["I610"]), [0]);
}

/// A table with an axis of the PLC, the fourth one.
const PLC_AXIS: &str = "[simulator]\nhome_ms = 100\n[[simulator.axis]]\nname = \"X\"\n\
    [[simulator.axis]]\nname = \"Y\"\n[[simulator.axis]]\nname = \"Z\"\n\
    [[simulator.axis]]\nhome = 5\n";

#[test]
fn an_axis_of_the_plc_returns_to_its_reference_point() {
    let mut desk = ready(PLC_AXIS, None);
    desk.set("Y633", 1);
    assert_eq!(desk.see(["I930", "I931", "I933"]), [1, 1, 0]);
    desk.set_all(&[("Y934", 1), ("Y930", 1)]);
    assert_eq!(desk.see(["I930", "I931", "I933", "I613"]), [0, 0, 0, 1], "without a strobe");
    assert_eq!(desk.until("I933", 1), 5);
    assert_eq!(desk.see(["I930", "I931", "I613"]), [1, 1, 0]);
    desk.step();
    assert_eq!(desk.get("RH115"), 5000);
    // AXRANDOM gives a strobe, too.
    desk.set_all(&[("Y930", 0), ("Y931", 1)]);
    assert_eq!(desk.see(["I930", "I931", "I933"]), [1, 0, 0]);
    desk.set_all(&[("Y930", 1), ("Y931", 0)]);
    assert_eq!(desk.see(["I930", "I613"]), [0, 1]);
    assert_eq!(desk.until("I933", 1), 5);
}

#[test]
fn an_axis_of_the_plc_is_moved_and_stopped() {
    let mut desk = ready(PLC_AXIS, None);
    // 10 mm from where it stands, at 1500 mm a minute: half a millimetre in a tick.
    desk.set_all(&[("Y633", 1), ("Y932", 1), ("Y933", 1)]);
    desk.set_all(&[("RH165", 2000), ("RH166", 0), ("RH167", 28_896), ("RH168", 114), ("Y931", 1)]);
    assert_eq!(desk.see(["I931", "I930", "I613"]), [0, 1, 0]);
    desk.set("Y931", 0);
    desk.set("Y930", 1);
    assert_eq!(desk.see(["I930", "I613", "I623", "RH117"]), [0, 1, 0, 0]);
    assert_eq!(desk.see(["RH117"]), [500], "fifths of increments a minute");
    desk.set("Y930", 0);
    assert_eq!(desk.until("I930", 1), 6);
    assert_eq!(desk.see(["I931", "I613", "RH115"]), [0, 0, 500]);
    desk.set("Y930", 1);
    assert_eq!(desk.see(["I930", "I613"]), [0, 1]);
    assert_eq!(desk.until("I931", 1), 3);
    assert_eq!(desk.see(["I930", "I613", "I563"]), [1, 0, 0]);
    desk.set("Y930", 0);
    assert_eq!(desk.until("I563", 1), 1);
}

#[test]
fn an_axis_of_the_plc_is_reset() {
    let mut desk = ready(PLC_AXIS, None);
    desk.set_all(&[("Y633", 1), ("RH165", 30_000), ("Y931", 1), ("Y930", 1)]);
    assert_eq!(desk.see(["I930", "I931", "I623"]), [0, 0, 1], "rapid traverse");
    desk.step();
    desk.set("Y935", 1);
    assert_eq!(desk.until("I930", 1), 6);
    assert_eq!(desk.see(["I931", "I613", "RH115"]), [1, 0, 3000], "the command is gone");
    desk.steps(5);
    assert_eq!(desk.get("RH115"), 3000);
}

#[test]
fn axes_are_jogged_moved_by_increments_and_referenced_by_hand() {
    let machine = "[simulator]\nhome_ms = 100\n[[simulator.axis]]\nname = \"X\"\nhome = 2\n\
        [[simulator.axis]]\nname = \"Y\"\nreference = \"switch\"\nref_direction = -1\n\
        [[simulator.axis]]\nname = \"Z\"\n";
    let mut desk = ready(machine, None);
    desk.set_all(&[("Y403", 1), ("Y430", 1)]);
    assert_eq!(desk.see(["I610", "I620", "I550", "I551"]), [1, 0, 0, 0]);
    assert_eq!(desk.see(["RH102"]), [1000], "3000 mm a minute");
    desk.set("Y430", 0);
    assert_eq!(desk.until("I550", 1), 6);
    assert_eq!(desk.see(["I610", "I551", "RH100"]), [0, 1, 1000]);
    // The selected axis, in rapid traverse.
    desk.set_all(&[("Y411", 1), ("Y437", 1), ("Y427", 1)]);
    assert_eq!(desk.see(["I611", "I621"]), [1, 1]);
    assert_eq!(desk.see(["RH107"]), [word(-3000)]);
    desk.set_all(&[("Y437", 0), ("Y427", 0), ("Y403", 0)]);
    desk.steps(7);
    // INCR: 100 increments for each time that the button is pressed.
    desk.set_all(&[("Y402", 1), ("Y422", 1), ("Y430", 1)]);
    assert_eq!(desk.see(["I610"]), [1]);
    assert_eq!(desk.see(["I610", "RH102"]), [0, 100]);
    desk.steps(3);
    assert_eq!(desk.see(["I610", "RH100"]), [0, 1100], "it is held");
    desk.set_all(&[("Y430", 0), ("Y402", 0), ("Y400", 1)]);
    desk.step();
    // REF of X after its time, of Y by its switch.
    desk.set_all(&[("Y430", 1), ("Y435", 1)]);
    assert_eq!(desk.see(["I610", "I611", "I903", "I913"]), [1, 1, 0, 0]);
    assert_eq!(desk.see(["RH107"]), [word(-500)], "1500 mm a minute");
    desk.set("Y551", 1);
    assert_eq!(desk.see(["RH107"]), [word(-500)]);
    assert_eq!(desk.see(["RH105", "RH107"]), [word(-3500), 50], "back at a tenth");
    desk.set("Y551", 0);
    assert_eq!(desk.see(["RH105", "RH107", "I913", "I611"]), [0, 0, 1, 0]);
    assert_eq!(desk.see(["I903", "I610", "I550"]), [1, 0, 1]);
    desk.step();
    assert_eq!(desk.see(["RH100", "RH105"]), [2000, 0]);
}

#[test]
fn a_reference_point_is_programmed() {
    let machine = "[[simulator.axis]]\nname = \"X\"\nhome = 3\n[[simulator.axis]]\nname = \"Z\"\n";
    let mut desk = ready(machine, Some("G28 X6\nM30\n"));
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I545", "I610", "I620", "I553", "I903"]), [1, 1, 1, 0, 0]);
    desk.step();
    assert_eq!(desk.see(["RH102", "I545"]), [6000, 1], "at the point");
    assert_eq!(desk.see(["I903", "I545", "I551", "I913"]), [1, 0, 1, 0]);
    desk.steps(2);
    assert_eq!(desk.get("RH100"), 3000);
}

#[test]
fn chopping_is_a_function_and_its_flags_take_their_time() {
    let mut desk = ready("", Some("G80\nG81.1\nG80\nM30\n"));
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I532", "I675"]), [0, 0], "nothing chops");
    assert_eq!(desk.see(["I532", "I675", "I677"]), [1, 1, 1]);
    desk.set_all(&[("Y547", 0), ("Y675", 1)]);
    assert_eq!(desk.see(["I532", "I675", "I676", "I677"]), [0, 1, 0, 0]);
    assert_eq!(desk.until("I676", 1), 10);
    desk.set("Y547", 1);
    assert_eq!(desk.see(["I532", "I675", "I676"]), [1, 0, 1]);
    desk.set_all(&[("Y547", 0), ("Y675", 0)]);
    assert_eq!(desk.see(["I676", "I677"]), [0, 0]);
    assert_eq!(desk.until("I677", 1), 10);
}

#[test]
fn records_go_over_the_serial_line() {
    let mut desk = ready("[simulator]\nserial = \"ABCDEFGHIJKLMNOPQRSTU\"\n", None);
    desk.set_all(&[("F100", 0x4241), ("F102", 0x43), ("RH051", 100), ("RH052", 3), ("Y606", 1)]);
    assert_eq!(desk.see(["I606"]), [0]);
    assert_eq!(desk.see(["I606"]), [1], "16 characters in a tick");
    assert_eq!(desk.told.last().unwrap().1, Told::Serial);
    assert_eq!(desk.simulator.take_sent().len(), 1);
    assert_eq!(desk.see(["I606"]), [1], "it is sent once");
    desk.set("Y606", 0);
    assert_eq!(desk.see(["I606"]), [0]);
    desk.set_all(&[("RH054", 200), ("RH055", 17), ("Y605", 1)]);
    desk.steps(2);
    assert_eq!(desk.see(["I607", "F200"]), [1, 0x41]);
    desk.set("Y607", 1);
    // Only four characters are left.
    assert_eq!(desk.see(["I607"]), [0]);
    desk.set("Y607", 0);
    desk.steps(10);
    assert_eq!(desk.get("I607"), 0);
    desk.set("RH055", 4);
    assert_eq!(desk.until("I607", 1), 2);
}
