//! The auxiliary axes of a PMI control (PMI 3.2.2).

use plcc_abi::Dialect;

use super::Desk;

/// A control that is on, with an auxiliary axis whose loop is closed. 6400 counts in 128 ms are 1000 counts in a tick.
fn ready() -> Desk {
    let machine = "[simulator]\nhome_ms = 100\n[[simulator.aux]]\ncounts = 1000\nmax = 7000\n";
    let mut desk = Desk::new(Dialect::Pmi, machine, &[], None);
    desk.set("@MONRQ", 1);
    desk.step();
    desk.set("@MCRDY", 1);
    desk.set("@AUMOD[0]", 2);
    desk.step();
    desk.set("@AUMOD[0]", 1);
    desk.set("@AUVEL[0]", 6400);
    assert_eq!(desk.see(["@AUACK[0]", "@AUCMP[0]", "@AUHOM[0]"]), [0, 1, 0]);
    desk
}

const SEEN: [&str; 3] = ["@AUACK[0]", "@AUCMP[0]", "@AUCRG[0]"];

/// Gives a request, after the one before was taken away.
fn request(desk: &mut Desk, number: i64) {
    desk.set("@AUREQ[0]", 0);
    assert_eq!(desk.see(["@AUACK[0]"]), [0]);
    desk.set("@AUREQ[0]", number);
}

#[test]
fn an_axis_is_jogged_and_stopped_where_it_is() {
    let mut desk = ready();
    request(&mut desk, 1);
    assert_eq!(desk.see(SEEN), [1, 0, 0], "no movement in the step in which it begins");
    assert_eq!(desk.see(SEEN), [1, 0, 1000]);
    assert_eq!(desk.see(["@AUCRG[0]", "@AUPRG[0]"]), [2000, 0]);
    assert_eq!(desk.see(["@AUCRG[0]", "@AUPRG[0]"]), [3000, 1000]);
    desk.set("@AUVEL[0]", -3200);
    assert_eq!(desk.see(["@AUCRG[0]"]), [2500], "the speed is live");
    desk.set("@AUXFH", 1);
    assert_eq!(desk.see(SEEN), [1, 0, 2500]);
    desk.set("@AUXFH", 0);
    // The same request changes nothing.
    request(&mut desk, 1);
    assert_eq!(desk.see(["@AUACK[0]"]), [1]);
    desk.set("@AUCNC[0]", 1);
    assert_eq!(desk.see(SEEN), [1, 1, 1500]);
    assert_eq!(desk.see(SEEN), [1, 1, 1500]);
}

#[test]
fn an_axis_goes_to_a_position_when_it_is_homed() {
    let mut desk = ready();
    desk.set("@AUPOS[0]", -2500);
    request(&mut desk, 6);
    assert_eq!(desk.see(SEEN), [-1, 1, 0], "not homed");
    request(&mut desk, 3);
    assert_eq!(desk.see(SEEN), [1, 0, 0]);
    for _ in 0..4 {
        assert_eq!(desk.see(["@AUHOM[0]", "@AUCMP[0]"]), [0, 0]);
    }
    assert_eq!(desk.see(["@AUHOM[0]", "@AUCMP[0]", "@AUCRG[0]"]), [1, 1, 0]);
    request(&mut desk, 6);
    assert_eq!(desk.see(SEEN), [1, 0, 0]);
    assert_eq!(desk.see(SEEN), [1, 0, -1000]);
    assert_eq!(desk.see(SEEN), [1, 0, -2000]);
    assert_eq!(desk.see(SEEN), [1, 1, -2500]);
    request(&mut desk, 6);
    assert_eq!(desk.see(SEEN), [1, 1, -2500], "it is there");
    desk.set("@AUVEL[0]", -1);
    request(&mut desk, 6);
    assert_eq!(desk.see(SEEN), [-1, 1, -2500]);
    desk.set("@AUMOD[0]", 0);
    assert_eq!(desk.see(["@AUHOM[0]"]), [0]);
}

#[test]
fn requests_are_refused_and_a_speed_that_is_too_high_is_an_error() {
    let mut desk = ready();
    for wrong in [2, 4, 7, -1] {
        request(&mut desk, wrong);
        assert_eq!(desk.see(SEEN), [-1, 1, 0], "{wrong}");
    }
    desk.set("@AUVEL[0]", 0);
    request(&mut desk, 1);
    assert_eq!(desk.see(SEEN), [-1, 1, 0], "no speed");
    desk.set("@AUVEL[0]", 6400);
    request(&mut desk, 1);
    desk.step();
    desk.set("@AUVEL[0]", 7001);
    assert_eq!(desk.see(["@AUVER[0]", "@AUCRG[0]"]), [1, 0]);
    desk.set("@AUVEL[0]", 6400);
    assert_eq!(desk.see(["@AUVER[0]", "@AUCRG[0]"]), [1, 0]);
    request(&mut desk, 8);
    assert_eq!(desk.see(["@AUACK[0]", "@AUVER[0]", "@AUCRG[0]"]), [1, 0, 1000]);
    // Emergency stop drops the movement, and @AUCMP stays.
    desk.set("@ESTPB", 1);
    assert_eq!(desk.see(["@AUCMP[0]", "@AUCRG[0]"]), [0, 1000]);
    assert_eq!(desk.see(["@AUCMP[0]", "@AUCRG[0]"]), [0, 1000]);
    request(&mut desk, 3);
    assert_eq!(desk.see(["@AUACK[0]"]), [-1], "the loop is open");
}
