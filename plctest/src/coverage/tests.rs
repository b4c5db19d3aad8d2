use plcc_abi::Dialect;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::language;

use super::*;

/// The contacts of a program, each with its line and column.
fn contacts(dialect: Dialect, name: &str, text: &str) -> Vec<String> {
    let mut sources = SourceMap::new();
    let file = sources.add(name, text.as_bytes());
    let (program, found) =
        language(dialect).check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    let program = program.unwrap_or_else(|| panic!("{found:?}"));
    let map = Map::new(program.as_ref(), &sources);
    let coverage = Coverage::new(&map, &sources, &[]);
    let all = coverage.statements.iter().flat_map(|statement| &statement.contacts);
    all.map(|contact| {
        let (line, column) = sources.line_col(contact.span.file, contact.span.start);
        assert_eq!(column, contact.column);
        format!("{line}:{column} {}", contact.name)
    })
    .collect()
}

#[test]
fn pmi_has_contacts_in_conditions_and_logical_assignments() {
    let text = "$INTEGER\nN,A[3]\n$LOGICAL\nX,Y,Z,B[2]\n$END\nX = Y & /(Z ! N > 3 + A[N]) & T\nN = N + 1\n\
                IF (X = Y & /B[1])\nZ = T\nELSEIF ((N+1)*2 = 4 ! B[N - 1])\nZ = X\nENDIF\n";
    assert_eq!(
        contacts(Dialect::Pmi, "a.pmi", text),
        [
            "6:5 Y",
            "6:11 Z",
            "6:15 N>3+A[N]",
            "8:5 X=Y",
            "8:14 B[1]",
            "10:9 (N+1)*2=4",
            "10:23 B[N-1]",
            "11:5 X"
        ]
    );
}

#[test]
fn nct_has_contacts_in_conditions() {
    let text = ":000\nJ0\n:001\nI002 U012 Z\n(I000 A NI001 O =5) U013 E D013 Z\nNT00 (V003 X (F0103 A >.00FF)) U1 Z Z\nJ1\n";
    let text = text.replace("U1 ", "U014 ");
    assert_eq!(
        contacts(Dialect::Nct, "a.nct", &text),
        [
            "4:1 I002",
            "5:2 I000",
            "5:10 I001",
            "5:17 =5",
            "6:2 T00",
            "6:7 V003",
            "6:15 F0103",
            "6:23 >.00FF"
        ]
    );
}

#[test]
fn pmac_has_contacts_in_conditions() {
    let text = "#define DOOR M7\nM7->Y:$07F0,0,1\nI5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nIF (DOOR=1 AND P1>3) ; AND (\nOR (P2 = 0)\n\
                P3=P3+1\nENDIF\nWHILE (P1<(5+P2) AND (P2=1 OR P3=2))\nP4=1\nENDWHILE\nCLOSE\n";
    assert_eq!(
        contacts(Dialect::Pmac, "a.pmc", text),
        ["6:5 DOOR=1", "6:16 P1>3", "7:5 P2=0", "10:8 P1<(5+P2)", "10:23 P2=1", "10:31 P3=2"]
    );
}

/// What two scans of a program count, with a variable that is set before each.
#[test]
fn contacts_are_counted_as_they_decide() {
    let text = "$LOGICAL\nA,B,X\n$END\nX = A & B\n";
    let mut sources = SourceMap::new();
    let file = sources.add("a.pmi", text.as_bytes());
    let pmi = language(Dialect::Pmi);
    let program =
        pmi.check(&mut sources, &[file], &MemoryLoader::new(), &Options::default()).0.unwrap();
    let map = Map::new(program.as_ref(), &sources);
    let tables = program.lower().unwrap().program;
    let mut engine = ObservedEngine::new(program.as_ref(), &map);
    let mut image = vec![0; tables.image_size as usize];
    let at = |name: &str| {
        let set = |value: u8| {
            let mut trial = image.clone();
            (0..trial.len()).find(|&at| {
                trial[at] ^= value;
                let found = program.expression(name).unwrap().evaluate(&trial).unwrap().is_true();
                trial[at] ^= value;
                found
            })
        };
        set(1).unwrap()
    };
    let (a, b) = (at("A"), at("B"));
    for (first, second) in [(0, 0), (1, 0), (1, 1)] {
        (image[a], image[b]) = (first, second);
        let mut host = plcc_abi::engine::NoHost;
        plcc_abi::Engine::call(
            &mut engine,
            0,
            None,
            &mut plcc_abi::Scan::new(&mut image, &mut host),
        );
    }
    let coverage = Coverage::new(&map, &sources, &[("t".into(), engine.take())]);
    let of = |index: usize| coverage.statements[0].contacts[index].counts;
    assert_eq!(of(0), ContactCounts { zero: 1, one: 2, decided_zero: 0, decided_one: 1 });
    assert_eq!(of(1), ContactCounts { zero: 2, one: 1, decided_zero: 1, decided_one: 1 });
    assert_eq!(coverage.summary(), Summary { statements: (1, 1), contacts: (1, 2) });
    assert_eq!(
        json(std::slice::from_ref(&coverage)),
        "{\"file\":\"a.pmi\",\"line\":4,\"runs\":3,\"contacts\":[{\"name\":\"A\",\"column\":5,\"zero\":1,\"one\":2,\
         \"decided_zero\":0,\"decided_one\":1},{\"name\":\"B\",\"column\":9,\"zero\":2,\"one\":1,\"decided_zero\":1,\
         \"decided_one\":1}]}\n{\"statements\":[1,1],\"contacts\":[1,2]}\n"
    );
    let page = html(std::slice::from_ref(&coverage));
    assert!(
        page.contains("<b class=\"y\" title=\"A: 0 in 1, 1 in 2 scans;")
            && page.contains("<b class=\"g\" title=\"B:"),
        "{page}"
    );
    assert!(lcov(&[coverage], &str::to_owned).contains("BRDA:4,0,0,0\nBRDA:4,0,1,1\n"));
}
