use super::*;

fn picture(table: &str) -> Picture {
    read_table(table).unwrap()
}

#[test]
fn each_quantity_has_its_panel_and_bits_have_bars() {
    let table = "tick,ms,name,value\n0,0,#1.CMD,0\n0,0,#1.VEL,0\n0,0,N,7\n0,0,M1,0\n\
                 1,2,#1.CMD,10\n1,2,#1.VEL,-3.5\n1,2,M1,1\n9,18,M1,0\n";
    let picture = picture(table);
    let of = |quantity| picture.of(quantity).map(|(_, s)| s.name.as_str()).collect::<Vec<_>>();
    assert_eq!(of(Quantity::Position), ["#1.CMD"]);
    assert_eq!(of(Quantity::Velocity), ["#1.VEL"]);
    assert_eq!(of(Quantity::Number), ["N"]);
    assert_eq!(of(Quantity::Bit), ["M1"]);
    let svg = picture.draw();
    for part in
        ["width=\"960\" height=\"720\"", ">position<", ">velocity<", ">value<", ">ms<", ">M1<"]
    {
        assert!(svg.contains(part), "{part}\n{svg}");
    }
    // The bar of M1 goes from 2 to 18 ms of 18.
    assert!(svg.contains("<rect x=\"179.56\""), "{svg}");
    assert!(!svg.contains(">path<"));
}

#[test]
fn x_and_y_of_a_system_make_a_path() {
    let svg = picture("tick,name,value\n0,&1.X,0\n0,&1.Y,0\n1,&1.X,10\n2,&1.Y,5\n").draw();
    assert!(svg.contains(">path<") && svg.contains(">&amp;1.X, &amp;1.Y<"), "{svg}");
    let path = svg.lines().rfind(|line| line.starts_with("<polyline")).unwrap();
    let points = path.split("points=\"").nth(1).unwrap().trim_end_matches("\"/>");
    let points: Vec<Vec<f64>> = points
        .split(' ')
        .map(|point| point.split(',').map(|number| number.parse().unwrap()).collect())
        .collect();
    assert_eq!(points.len(), 3);
    // Ten units to the right are twice as long as five units up.
    let (right, up) = (points[1][0] - points[0][0], points[1][1] - points[2][1]);
    assert!((right - 2.0 * up).abs() < 0.03, "{right} {up}");
}

#[test]
fn arrays_are_drawn_by_their_elements() {
    let picture = picture("tick,name,value\n0,A,\"[3,1]\"\n4,A,\"[3,0]\"\n");
    let names: Vec<_> = picture.series.iter().map(|series| series.name.as_str()).collect();
    assert_eq!(names, ["A[0]", "A[1]"]);
    assert_eq!(picture.series[1].samples.len(), 2);
}

#[test]
fn a_long_trace_gives_a_short_picture() {
    let mut table = String::from("tick,name,value\n");
    for tick in 0..100_000 {
        table.push_str(&format!("{tick},P1,{}\n{tick},M1,{}\n", tick % 977, tick % 2));
    }
    let svg = picture(&table).draw();
    assert!(svg.len() < 60_000, "{}", svg.len());
    assert_eq!(svg, picture(&table).draw());
}

#[test]
fn mistakes_are_told_with_their_lines() {
    let table = "tick,name,value\n0,A,1\nx,A,1\n2,A,one\n3\n1,A,NaN\n1,A,0\n";
    let wrong: Vec<_> = read_table(table).unwrap_err();
    let lines: Vec<_> = wrong.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [3, 4, 5, 6]);
    assert!(wrong[1].1.contains("`one` is not a number"), "{wrong:?}");
    assert!(read_table("$date\n").unwrap_err()[0].1.contains("the header"));
    assert!(
        read_table("tick,name,value\n3,A,1\n2,A,0\n").unwrap_err()[0].1.contains("comes after")
    );
    let many = format!("tick,name,value\n{}", "?\n".repeat(100));
    let wrong = read_table(&many).unwrap_err();
    assert!(wrong.len() == 20 && wrong[19].1.contains("and 80 more"), "{wrong:?}");
    assert!(read_table(&"\u{0}".repeat(1 << 21)).is_err());
}
