//! `plcc io`: what is wired, by the drawing, and what the control gives and takes.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::Folder;

const LATHE: &str = "$INPUT\nDOOR = 3/1 ? door closed, X11 pin 7\nTPOS = 0/0-3/BCD\nSTART = 0/5\n$OUTPUT\nPUMP = 2/7\nLAMP = 2/0\n$MCODE\n@M03/P\n$END\n\
                     IF (@SCODE > 0)\n @SPDAC = 100\n @M03 = 0\nENDIF\nLAMP = TPOS = 4 & START & /@ESTOP\nPUMP = DOOR\n";

const NAMES: &str = "[names]\nDOOR = { alias = \"GATE\", text = \"safety door\", device = \"-S12\", at = \"X11:7\", drawing = \"14.3\" }\n";

/// The names of the entries of a template, in their order.
fn entries(template: &str) -> Vec<&str> {
    let names = template.lines().filter_map(|line| line.strip_prefix("name = \""));
    names.filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn wires_stand_in_the_order_of_ports_and_bits_and_the_control_apart() {
    let folder = Folder::with(&[("lathe.pmi", LATHE), ("lathe.machine.toml", NAMES)]);
    let template = folder.plcc("io lathe.pmi").exits(0).stdout;
    assert_eq!(entries(&template), ["TPOS", "START", "LAMP", "PUMP", "DOOR"]);
    for part in [
        "name = \"TPOS\"  # an input, port 0 bits 0-3\n",
        "address = \"\"  # 4 lines:",
        "name = \"START\"  # an input, port 0 bit 5\n",
        "name = \"PUMP\"  # an output, port 2 bit 7\n",
        "name = \"DOOR\"  # an input, port 3 bit 1, GATE\ndescription = \"safety door, -S12, at X11:7, drawing 14.3\"\n",
    ] {
        assert!(template.contains(part), "{part} is not in\n{template}");
    }
    let control = template.split_once("\n# What the control gives").unwrap().1;
    for name in ["@ESTOP", "@SCODE", "@SPDAC", "@M03"] {
        assert!(control.contains(&format!("# {name}")), "{control}");
    }
    let (gives, takes) = control.split_once("# What the program gives the control").unwrap();
    assert!(gives.contains("# @SCODE") && takes.contains("# @SPDAC"), "{control}");
}

#[test]
fn flags_of_the_nc_are_no_wires() {
    let text = ":001\nI002 E D013 Z ; door\nI012 E D014 Z\nI477 E D547 Z\nLI02 SRH060\nLRH000 SRH061\nJ1\n:000\nJ0\n";
    let folder = Folder::with(&[("s.nct", text)]);
    let template = folder.plcc("io s.nct").exits(0).stdout;
    let wires = entries(&template);
    assert_eq!(wires.first(), Some(&"I002"));
    assert!(wires.contains(&"I037") && wires.last() == Some(&"Y014"), "{wires:?}");
    assert!(!wires.iter().any(|name| ["I477", "Y547", "I02"].contains(name)), "{wires:?}");
    assert!(template.contains("# an input, P012, board 1 I1-10"), "{template}");
    for name in ["I477", "Y547", "RH000", "RH060", "RH061"] {
        assert!(template.contains(&format!("\n# {name}")), "{template}");
    }
}

#[test]
fn an_input_of_a_pmac_that_is_assigned_stays_an_input() {
    let text = "M11->Y:$FFC2,0\nM1->Y:$FFC2,8 ; lamp\nM9->Y:$FFC2,10,4\nI5=2\nOPEN PLC 1 CLEAR\nM11=0\nM1=1\nM9=3\nCLOSE\n";
    let folder = Folder::with(&[("m.pmc", text)]);
    let done = folder.plcc("io m.pmc").exits(0).says(&["M11 is an input", "m.pmc:6"]);
    assert_eq!(entries(&done.stdout), ["M11", "M1", "M9"]);
    assert!(done.stdout.contains("\"M11\"  # an input, Y:$FFC2,0\n"), "{}", done.stdout);
    assert!(
        done.stdout.contains("\"M9\"  # an output, Y:$FFC2,10 to Y:$FFC2,13\n"),
        "{}",
        done.stdout
    );
}

#[test]
fn a_list_leads_from_the_old_terminal_to_the_new_point() {
    let configuration = "artifact = \"p\"\n\
        [[io]]\nname = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4..7\"\n\
        [[io]]\nname = \"GATE\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/8\"\n";
    let folder = Folder::with(&[
        ("lathe.pmi", LATHE),
        ("lathe.machine.toml", NAMES),
        ("c.toml", configuration),
    ]);
    let csv = folder.plcc("io lathe.pmi --config c.toml --to csv").exits(0).stdout;
    let rows: Vec<&str> = csv.lines().collect();
    assert_eq!(
        rows[..5],
        [
            "side,name,alias,line,old place,description,device,terminal,drawing,new point,checked",
            "input,TPOS,,PORT0.0,port 0 bits 0-3,,,,,gpio gpiochip0/4,",
            "input,TPOS,,PORT0.1,port 0 bits 0-3,,,,,gpio gpiochip0/5,",
            "input,TPOS,,PORT0.2,port 0 bits 0-3,,,,,gpio gpiochip0/6,",
            "input,TPOS,,PORT0.3,port 0 bits 0-3,,,,,gpio gpiochip0/7,",
        ]
    );
    let door =
        "input,DOOR,GATE,PORT3.1,port 3 bit 1,safety door,-S12,X11:7,14.3,modbus-tcp h/1/coil/8,";
    assert!(rows.contains(&door), "{csv}");
    assert!(csv.contains("\nfrom the control,@SCODE,"), "{csv}");
    let html = folder.plcc("io lathe.pmi --config c.toml --to html").exits(0).stdout;
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"), "{html}");
    assert!(
        html.contains("<td>X11:7</td><td>14.3</td><td>modbus-tcp h/1/coil/8</td><td>\u{2610}</td>"),
        "{html}"
    );
    folder.write("c.toml", configuration.replace("GATE", "GATTE"));
    let wrong = folder.plcc("io lathe.pmi --config c.toml --to csv").exits(2);
    wrong.says(&[
        "c.toml",
        "line 6: the program has no variable named `GATTE`; did you mean `GATE`?",
    ]);
}
