//! Inputs of a mebibyte that are made to cost a compiler as much as possible: every construct of each
//! language, repeated.

use plcc_abi::Dialect;
use plcc_random::Rng;

/// The length of the inputs in bytes.
pub const MEBIBYTE: usize = 1 << 20;

/// A source of about a mebibyte.
#[derive(Clone, Debug)]
pub struct HostileInput {
    /// What it is made of.
    pub name: String,
    /// The source.
    pub bytes: Vec<u8>,
    /// Files that the source includes, by their names.
    pub included: Vec<(String, String)>,
    /// Whether it is for Turbo PMAC.
    pub turbo: bool,
}

/// The inputs for a language.
pub fn inputs(dialect: Dialect) -> Vec<HostileInput> {
    let mut all = vec![
        input("noise", noise()),
        input("one letter", vec![b'A'; MEBIBYTE]),
        input("one line end", vec![b'\n'; MEBIBYTE]),
        input("blanks", vec![b' '; MEBIBYTE]),
    ];
    let (head, tail) = match dialect {
        Dialect::Pmi => ("$INTEGER\nA,B\n$END\n", ""),
        Dialect::Nct => (":000\nJ0\n:001\n", "J1\n"),
        Dialect::Pmac => ("OPEN PLC 1 CLEAR\n", "CLOSE\n"),
    };
    for sign in (b'!'..=b'/').chain(b':'..=b'@').chain(b'['..=b'`').chain(b'{'..=b'~') {
        let name = format!("sign {}", char::from(sign));
        all.push(repeated(&name, head, |_| char::from(sign).to_string(), tail));
    }
    match dialect {
        Dialect::Pmi => pmi(&mut all),
        Dialect::Nct => nct(&mut all),
        Dialect::Pmac => pmac(&mut all),
    }
    all
}

fn input(name: &str, bytes: Vec<u8>) -> HostileInput {
    HostileInput { name: name.into(), bytes, included: vec![], turbo: false }
}

fn noise() -> Vec<u8> {
    let mut rng = Rng::new(1);
    (0..MEBIBYTE).map(|_| rng.below(256) as u8).collect()
}

/// `head`, then `unit(0)`, `unit(1)` and so on up to a mebibyte, then `tail`.
fn repeated(name: &str, head: &str, unit: impl Fn(usize) -> String, tail: &str) -> HostileInput {
    let mut text = String::from(head);
    let mut n = 0;
    while text.len() + tail.len() < MEBIBYTE {
        text.push_str(&unit(n));
        n += 1;
    }
    text.push_str(tail);
    input(name, text.into_bytes())
}

/// The unit `n` times inside of itself: `open` `n` times, `inner`, `close` `n` times.
fn nested(open: &str, inner: &str, close: &str, n: usize) -> String {
    format!("{}{inner}{}", open.repeat(n), close.repeat(n))
}

/// Each unit of text repeated between a head and a tail; the unit is its own name. `{n}` in it is
/// replaced by a number that rises, `{r}` by one that is smaller than 1000.
fn units(all: &mut Vec<HostileInput>, head: &str, units: &[&str], tail: &str) {
    for unit in units {
        let name: String = unit.replace('\n', " ").chars().take(40).collect();
        let text = |n: usize| {
            unit.replace("{n}", &n.to_string()).replace("{r}", &(n * 7919 % 1000).to_string())
        };
        all.push(repeated(&name, head, text, tail));
    }
}

fn pmi(all: &mut Vec<HostileInput>) {
    let declared = "$LOGICAL\nX,Y,Z\n$INTEGER\nA,B,C,D[200]\n$LONG\nL\n$END\n";
    let statements = [
        "A=B\n",
        "A = B + C * 2\n",
        "A=B*C/A%B\n",
        "X=Y&Z!/X\n",
        "D[A]=D[B]\n",
        "D[D[D[A]]]=1\n",
        "L=L+A\n",
        "IF (A > {r})\nB = 1\nENDIF\n",
        "IF(X)\nA=1\nELSE\nA=2\nENDIF\n",
        "IF(X)\nA=1\nELSEIF(Y)\nA=2\nELSEIF(Z)\nA=3\nELSE\nA=4\nENDIF\n",
        "IF(X)\n",
        "ELSE\n",
        "ENDIF\n",
        "P{n}: A=1\n",
        "GOTO P{n}\n",
        "P{n}:\nGOTO P{n}\n",
        "A=U{n}\n",
        "A=(((((((B)))))))\n",
        "A=1#\n",
        "A=\\\n#\n",
        "A=\"text\"\n",
        "A=\"text",
        "A=@FRO\n@FRO=A\n",
        "@ESTOP=X\n",
        "? comment\n",
        "A=B ? comment\n",
        "$INCLUDE other.pmi\n",
        "$INCLUDE none{n}.pmi\n",
        "$INTEGER\n",
        "$END\n",
    ];
    units(all, declared, &statements, "");
    let declarations = [
        ("LOGICAL", "X{n}\n"),
        ("INTEGER", "X{n},"),
        ("INTEGER", "X{n}[255]\n"),
        ("INTEGER", "X{n}[2]=1,2\n"),
        ("CONSTANT", "X{n}=5\n"),
        ("INPUT", "X{n}=0/0\n"),
        ("OUTPUT", "X{n}=0/0\n"),
        ("INPUT", "X{n}=0/0-0/7 B\n"),
        ("TIMER", "E/T{n}/D{n} = 5\n"),
        ("FLIPFLOP", "C{n}/D{n}/P{n}/L{n}/Q{n}\n"),
        ("MCODE", "@M03/P\n"),
        ("KEY", "K{n}\n"),
        ("FAULT", "F{n}=\"a text\"\n"),
        ("MESSAGE", "F{n}=\"a text\", X{n}\n"),
        ("MESSAGE", "F=\"a\",A,\"b\",A,"),
        ("AUXAXIS", "X{n}=1,2,3\n"),
    ];
    for (section, unit) in declarations {
        let head = format!("${section}\n");
        units(all, &head, &[unit], "\n$END\nA=1\n");
        if let Some(last) = all.last_mut() {
            last.name = format!("${section} {}", last.name);
        }
    }
    for (name, unit) in [("+", "A+"), ("*", "A*"), ("&", "X&"), ("=", "A="), ("unary", "-")] {
        let head = format!("{declared}A=");
        all.push(repeated(&format!("one expression of {name}"), &head, |_| unit.into(), "A\n"));
    }
    let deep = |n: usize| format!("A={}\n", nested("(", "B", ")", n));
    all.push(repeated("256 parentheses", declared, |_| deep(256), ""));
    let deep = format!("{}\n", nested("IF(X)\n", "A=1\n", "ENDIF\n", 256));
    all.push(repeated("256 IFs", declared, |_| deep.clone(), ""));
    lints_of_pmi(all);
    all.push(repeated("GOTOs forward", declared, |_| "GOTO P\n".into(), "P: A=1\n"));
    for last in all.iter_mut() {
        last.included = vec![("other.pmi".into(), "A=A+1\n".repeat(20))];
    }
    let mut large = repeated("a file included again and again", "", |_| "A=A+1\n".into(), "");
    let text = String::from_utf8_lossy(&large.bytes).into_owned();
    large.included = vec![("other.pmi".into(), text)];
    large.bytes = format!("{declared}{}", "$INCLUDE other.pmi\n".repeat(50_000)).into_bytes();
    all.push(large);
}

/// What the lints of PMI have to search.
fn lints_of_pmi(all: &mut Vec<HostileInput>) {
    let output = "$OUTPUT\nLAMP=2/0\n$END\n";
    let allow = |_| "? plcc: allow near-name, unassigned-output\n".into();
    all.push(repeated("comments that silence", output, allow, "A=B\n"));
    all.push(repeated("one long name", "$LOGICAL\n", |_| "A".into(), "\n$END\nA=1\n"));
    // Every output is assigned at the beginning and at the end, so that each lies around all others.
    let ports = (0..96).flat_map(|port| (0..16).map(move |bit| (port, bit)));
    let outputs: Vec<String> =
        ports.map(|(port, bit)| format!("O{port}B{bit}={port}/{bit}\n")).collect();
    let names: Vec<&str> = outputs.iter().filter_map(|line| line.split('=').next()).collect();
    let assigned: String = names.iter().map(|name| format!("{name}=X\n")).collect();
    let head = format!("$OUTPUT\n{}$LOGICAL\nX\n$END\n{assigned}", outputs.concat());
    let between = |n: usize| format!("P{n}: X=X\n");
    all.push(repeated("outputs assigned twice", &head, between, &assigned));
}

fn nct(all: &mut Vec<HostileInput>) {
    let statements = [
        "LF500SF501\n",
        "LF500+F501SF502\n",
        "LF500*F501\n",
        "LF500/F501\n",
        "LI000 AI001 OI002 SY000\n",
        "(I000)U001Z\n",
        "(I000AY000)U010ED010Z\n",
        "I000 U000 Z\n",
        "(((I000)))U001Z\n",
        "L[F500+[F501*5]]\n",
        "+SF500-SF502\n",
        "<<1>>1\n",
        "BIN BCD\n",
        "HF120PF130MR140MW150\n",
        "ADD200SUB200MUL200DIV200CMP200\n",
        "LFI500SFI500\n",
        ":{r}\n",
        "G010\n",
        "C010\n",
        "GF500CF500\n",
        "(I000)G010Z\n",
        "(I000)C010Z\n",
        "(I000)",
        "(I000)U000E",
        "Z\n",
        "R\n",
        "J1\n",
        "QU01QD01\n",
        "T00=5\n",
        "(F500=5)U000Z\n",
        "(V000)U000Z\n",
        "L$FFFF\n",
        "L*9\n",
        "/* comment */",
        "/*",
        "NL I000\n",
        "PI000 UO001\n",
    ];
    units(all, ":000\nJ0\n:001\n", &statements, "J1\n:010 R\n");
    all.push(repeated(
        "one condition",
        ":000\nJ0\n:001\n(I000",
        |_| "AI001".into(),
        ")U000Z\nJ1\n",
    ));
    all.push(repeated("one bracket", ":000\nJ0\n:001\nL[F500", |_| "+F500".into(), "]\nJ1\n"));
    for text in ["197", "198", "199", "200"] {
        let head = format!(":000\nJ0\n:001\nJ1\n:{text}\n");
        units(all, &head, &["A TEXT$\n", "A TEXT,", "A"], "$\n");
    }
    let deep = |n: usize| format!("{}\n", nested("(I000)", "U000", "Z", n));
    all.push(repeated("256 conditions", ":000\nJ0\n:001\n", |_| deep(256), "J1\n"));
    let deep = |n: usize| format!("{}U000Z\n", nested("(", "I000", ")", n));
    all.push(repeated("256 parentheses", ":000\nJ0\n:001\n", |_| deep(256), "J1\n"));
    let labels = |n: usize| format!(":{:03}LF500\nGF502\n", 10 + n % 150);
    all.push(repeated("labels and indirect jumps", ":000\nJ0\n:001\nJ1\n", labels, "R\n"));
}

fn pmac(all: &mut Vec<HostileInput>) {
    let plc = "I5=2\nM1->Y:$FFC2,8\nM2->X:$07F0,0,24,S\n#define NAME P1\nOPEN PLC 1 CLEAR\n";
    let statements = [
        "P1=P1+1\n",
        "P1=0P2=1",
        "M1=1\n",
        "M{r}=M2+1\n",
        "P{r}=P{r}*P7%3\n",
        "P1=P2&P3|P4^P5\n",
        "Q1=SIN(P1)*2\n",
        "P(P(P(P1)))=M(P1)\n",
        "P1&=P2\n",
        "I{r}=P1\n",
        "NAME=NAME\n",
        "P1=NAME{n}\n",
        "IF(P1=1)P2=1 ENDIF\n",
        "IF(P1=1)\nP2=1\nELSE\nP2=2\nENDIF\n",
        "IF(P1=1 AND P2>2 OR P3<3)P1=1 ENDIF\n",
        "IF(P1=1)\nAND(P2=1)\nOR(P3=1)\nP1=1 ENDIF\n",
        "IF(P1=1)\n",
        "ENDIF\n",
        "ELSE\n",
        "WHILE(P1=1)ENDWHILE\n",
        "WHILE(P1=1)\n",
        "SEND\"",
        "SEND\"text\"",
        "SEND\u{201c}",
        "SEND^A",
        "DISPLAY 1,8.3,P1\n",
        "DISPLAY 1\"text\"\n",
        "CMD\"P1=1\"",
        "CMD\"I0..1023=*\"",
        "CMD\"M0..1023->*\"",
        "CMD\"WX$0,1,2,3\"",
        "CMD\"NAME\"",
        "CMD\"nonsense\"",
        "ADDRESS&2\n",
        "ADDRESS&P1\n",
        "ENABLE PLC 1,3,5,7,9,11,13,15,17\n",
        "ENABLE PLC 1..31\n",
        "P0..1023=P1\n",
        "P0..7=P1\n",
        "M0..1023=P1\n",
        "I0..1023=P1\n",
        "M1==1\n",
        "FOO{n}=BAR\n",
        "P1=$FFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF\n",
        "P1=1111111111111111111111111111111111111.5\n",
        "OPEN PLC 1\n",
        "CLOSE\nOPEN PLC 2 CLEAR\n",
        "CLOSE\nOPEN PROG 1 CLEAR X1Y2\n",
        "M1->Y:$FFC2,8\n",
        "\u{e9}",
    ];
    units(all, plc, &statements, "\nCLOSE\n");
    let compiled = "L0..1023->X:$0700,0,24,S\nOPEN PLCC 1 CLEAR\n";
    let statements =
        ["L1=L2+1\n", "L{r}=L{r}/L7%3\n", "L0..1023=L1\n", "L1=P1\n", "IF(L1=1)L2=1 ENDIF\n"];
    units(all, compiled, &statements, "\nCLOSE\n");
    let online = [
        "P1=1 ",
        "P{r}=P1+1\n",
        "P0..1023=1\n",
        "I0..1023=*\n",
        "M0..1023->Y:$C000,0,24\n",
        "M{r}->Y:$C000,0,24\n",
        "L0..1023->X:$0700,0\n",
        "WY$0,1,1,1,1,1,1,1\n",
        "WX$800,1\n",
        "5 ",
        "DEFINE GATHER\n",
        "DEFINE COMP 5,1,2\n1 2 3\n",
        "OPEN PLC 1 CLEAR CLOSE\n",
        "OPEN PLC 1 CLEAR\n",
        "OPEN PROG 1 CLEAR CLOSE\n",
        "DELETE PLCC 1\n",
        "ENABLE PLC 1\n",
        "&1#1->X\n",
        "SAVE\n",
        "#1J+ ",
        "#define A{n} P{r}\n",
        "#define A P1\n",
        "#undef A{n}\n",
        "#ifdef A\n#endif\n",
        "#ifdef A\n",
        "#else\n",
        "#include \"other.pmc\"\n",
        "#include \"none{n}.pmc\"\n",
        "#define $(A{n}) 5\n",
        "P$(A=1)=1 ",
        "P$(A=1)=1\n",
        "$(A=",
        "$(A)\n",
        "/* */",
        "/*",
        "; comment\n",
        "## heading\n",
    ];
    units(all, "I5=2\n", &online, "");
    units(all, "#define $(B) 1\n#define A\n", &["A ", "$(B) ", "A\n", "$(B)\n"], "");
    for (name, unit) in
        [("+", "P1+"), ("&", "P1&"), ("%", "P1%"), ("unary", "-"), ("P(", "P1+P(P1)+")]
    {
        let head = format!("{plc}P1=");
        all.push(repeated(
            &format!("one expression of {name}"),
            &head,
            |_| unit.into(),
            "P1\nCLOSE\n",
        ));
    }
    for (name, unit) in [("AND", " AND P1=1"), ("OR", " OR M1=1")] {
        let head = format!("{plc}IF(P1=1");
        all.push(repeated(
            &format!("one condition of {name}"),
            &head,
            |_| unit.into(),
            ")ENDIF\nCLOSE\n",
        ));
    }
    let deep = |n: usize| format!("P1={}\n", nested("(", "P2", ")", n));
    all.push(repeated("256 parentheses", plc, |_| deep(256), "CLOSE\n"));
    let deep = |n: usize| format!("{}\n", nested("IF(P1=1) ", "P1=1 ", "ENDIF ", n));
    all.push(repeated("256 IFs", plc, |_| deep(256), "CLOSE\n"));
    let deep = |n: usize| format!("{}\n", nested("WHILE(P1=1) ", "P1=1 ", "ENDWHILE ", n));
    all.push(repeated("256 WHILEs", plc, |_| deep(256), "CLOSE\n"));
    macros(all);
    for last in all.iter_mut() {
        last.included = vec![("other.pmc".into(), "P1=P1+1\n".repeat(20))];
    }
    includes(all);
    let wide =
        ["P0..8191=1\n", "I0..8191=*\n", "M0..8191->Y:$C000,0,24\n", "L0..8191->X:$0700,0\n"];
    let from = all.len();
    units(all, "I5=2\n", &wide, "");
    units(
        all,
        "I5=2\nOPEN PLC 1 CLEAR\n",
        &["CMD\"I0..8191=*\"\n", "CMD\"P0..8191=1\"\n"],
        "CLOSE\n",
    );
    for turbo in all.iter_mut().skip(from) {
        turbo.turbo = true;
        turbo.name = format!("turbo {}", turbo.name);
    }
}

/// Small files of definitions that double a text again and again, in several ways.
fn macros(all: &mut Vec<HostileInput>) {
    let doubling = |first: &str, each: &str, last: &str| {
        let mut text = format!("I5=2\n#define A0 {first}\n");
        for n in 1..60 {
            let before = format!("A{}", n - 1);
            text.push_str(&format!("#define A{n} {}\n", each.replace("{before}", &before)));
        }
        text + last
    };
    let plc = "OPEN PLC 1 CLEAR\nA59\nCLOSE\n";
    for (name, first, each, last) in [
        ("statements that double", "P1=P1+1", "{before} {before}", plc),
        ("terms that double", "P1", "{before}+{before}", "OPEN PLC 1 CLEAR\nP1=A59\nCLOSE\n"),
        ("nothing that doubles", "", "{before} {before}", plc),
        ("M-variables that double", "M1=P1", "{before} {before}", plc),
        ("IFs that double", "IF(P1=1) P2=1 ENDIF", "{before} {before}", plc),
        ("on-line commands that double", "P1=1", "{before} {before}", "A59\n"),
        ("errors that double", "FOO", "{before} {before}", plc),
        ("signs that double", ")", "{before} {before}", plc),
    ] {
        all.push(input(&format!("macros: {name}"), doubling(first, each, last).into_bytes()));
    }
    let names = |n: usize| format!("A{} ", n % 50);
    let mut head: String = (0..50).map(|n| format!("#define A{n} P1=P1+{n}\n")).collect();
    head.push_str("OPEN PLC 1 CLEAR\n");
    all.push(repeated("macros: many uses", &head, names, "CLOSE\n"));
    let long = format!("#define A {}\nOPEN PLC 1 CLEAR\n", "P1=1 ".repeat(1000));
    all.push(repeated("macros: a long one", &long, |_| "A\n".into(), "CLOSE\n"));
    let chain: String = (0..20_000).map(|n| format!("#define A{n} A{}\n", n + 1)).collect();
    all.push(repeated("macros: a chain", &chain, |_| "A0 ".into(), ""));
}

/// Small files that include one another many times over.
fn includes(all: &mut Vec<HostileInput>) {
    let mut doubling = input("includes that double", b"I5=2\n#include \"f0\"\n".to_vec());
    for n in 0..40 {
        let next = format!("#include \"f{}\"\n", n + 1).repeat(2);
        doubling.included.push((format!("f{n}"), next));
    }
    let plc = format!("OPEN PLC 1\n{}CLOSE\n", "P1=P1+1\n".repeat(1000));
    doubling.included.push(("f40".into(), plc));
    all.push(doubling.clone());
    doubling.name = "includes that double, of nothing".into();
    if let Some((_, text)) = doubling.included.last_mut() {
        text.clear();
    }
    all.push(doubling);
    let mut large =
        input("a file included again and again", "#include \"f\"\n".repeat(80_000).into());
    large.included = vec![("f".into(), "P1=1 ".repeat(200_000))];
    all.push(large);
}
