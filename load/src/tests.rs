//! Round trips, and a refusal of each kind.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::sync::Arc;

use plcc_abi::pmi::{PmiTables, Role, Symbol, Type};
use plcc_abi::{
    CodeLine, CodeParts, FunctionRange, OperatorPanel, Program, Region, SourceLine, Tables, Task,
    TrapCode, TrapSite, function_marker,
};

use super::header::{self, Header};
use super::signature::{self, PublicKey, Signature};
use super::{Artifact, ArtifactError, Attached, read, write};

fn program() -> Program {
    let symbol = Symbol {
        name: "A".into(),
        ty: Type::Integer,
        offset: 2,
        elements: Some(3),
        role: Role::Variable,
        dumped: true,
        retained: false,
    };
    let tables = PmiTables { symbols: vec![symbol], ports: 8, ..PmiTables::default() };
    Program {
        files: vec!["lathe.pmi".into()],
        image_size: 8 + 2048,
        regions: vec![
            Region { name: "integer".into(), offset: 0, size: 8, bits: false },
            Region { name: "port".into(), offset: 8, size: 2048, bits: false },
        ],
        tasks: vec![Task { name: "scan".into(), entry: 1, resume_points: vec![0] }],
        tables: Tables::Pmi(tables),
        names: vec![],
    }
}

fn code() -> CodeParts {
    let mut code = CodeParts {
        // Traps at once, in case a refused artifact is ever entered.
        bytes: vec![0xCC; 80],
        labels: vec![64, 16, 64],
        label_lines: Arc::new(vec![Some(SourceLine { file: 0, line: 4 }), None]),
        functions: vec![
            FunctionRange { name: "chunk0".into(), offset: 16, len: 20 },
            FunctionRange { name: "chunk1".into(), offset: 64, len: 16 },
        ],
        lines: Arc::new(vec![
            CodeLine { offset: 16, file: 0, line: 3 },
            CodeLine { offset: 23, file: 0, line: 4 },
        ]),
        trap_sites: Arc::new(vec![TrapSite {
            code: TrapCode::ArrayBounds,
            statement: SourceLine { file: 0, line: 4 },
            array: Some(0),
        }]),
        architecture: std::env::consts::ARCH.into(),
        features: vec![],
        image_size: 8 + 2048,
        // A CIE, and an FDE for `chunk1`.
        eh_frame: [8_u32, 0, 0, 12, 16, (64_u32).wrapping_sub(80 + 20), 16]
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .collect(),
    };
    function_marker::write(&mut code);
    code
}

fn parse(bytes: &[u8]) -> Result<Artifact, ArtifactError> {
    Artifact::parse(bytes, None)
}

/// An artifact without the checks that `encode` makes, to test those of the reader.
fn forged(program: &Program, code: &CodeParts) -> Vec<u8> {
    let payload = super::payload::encode(program, code, Attached::default()).unwrap();
    let header = Header {
        version: plcc_abi::ABI_VERSION,
        length: (header::LENGTH + payload.bytes.len()) as u64,
        parts: payload.parts,
        architecture: code.architecture.clone(),
        features: code.features.clone(),
        image_size: code.image_size,
    };
    [&header.encode(&payload.bytes).unwrap()[..], &payload.bytes].concat()
}

#[test]
fn an_artifact_that_was_written_reads_back() {
    let (program, code) = (program(), code());
    let bytes = write(&program, &code, Attached::default()).unwrap();
    assert!(Artifact::is_artifact(&bytes));
    let inspection = read(&bytes, None).unwrap();
    assert_eq!((inspection.program, inspection.code), (program, code.clone()));
    assert_eq!(*parse(&bytes).unwrap().code, code);
}

#[test]
fn an_artifact_may_have_a_debug_part_and_sources() {
    let panel = OperatorPanel { cells: vec![], key_texts: vec!["AUTO".into()] };
    let attached =
        Attached { debug: b"for debuggers", sources: b"for displays", operator: Some(&panel) };
    let bytes = write(&program(), &code(), attached).unwrap();
    let read = parse(&bytes).unwrap();
    assert_eq!((read.program, read.debug), (program(), b"for debuggers".to_vec()));
    assert_eq!((read.sources, read.operator), (b"for displays".to_vec(), Some(panel)));
    assert_eq!(*read.code, code());
    // As artifacts were before there was an operator's screen.
    let bare = parse(&write(&program(), &code(), Attached::default()).unwrap()).unwrap();
    assert!(bare.debug.is_empty() && bare.operator.is_none());
}

#[test]
fn every_shorter_file_is_refused() {
    let bytes = write(&program(), &code(), Attached::default()).unwrap();
    for length in 0..bytes.len() {
        match parse(&bytes[..length]) {
            Err(ArtifactError::NotAnArtifact) => assert_eq!(length, 0),
            Err(ArtifactError::Truncated { found, expected }) => {
                assert!(found == length as u64 && expected > found);
            }
            other => panic!("{length}: {other:?}"),
        }
    }
}

#[test]
fn every_changed_bit_is_refused() {
    let bytes = write(&program(), &code(), Attached::default()).unwrap();
    for at in 0..bytes.len() {
        for mask in (0..8).map(|bit| 1 << bit).chain([0xFF]) {
            let mut copy = bytes.clone();
            copy[at] ^= mask;
            let refused = parse(&copy).unwrap_err();
            let expected = match at {
                0..8 => matches!(refused, ArtifactError::NotAnArtifact),
                _ => matches!(refused, ArtifactError::Corrupt { .. }),
            };
            assert!(expected, "byte {at}: {refused}");
        }
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(matches!(parse(&longer), Err(ArtifactError::Corrupt { .. })));
}

/// Where the checksums are right, each byte is decoded whatever it is.
#[test]
fn changed_bytes_with_right_checksums_never_panic() {
    let bytes = write(&program(), &code(), Attached::default()).unwrap();
    let mut refused = 0;
    for at in header::LENGTH..bytes.len() {
        for value in [0, 1, 0x7F, 0x80, 0xFF] {
            let mut copy = bytes.clone();
            copy[at] = value;
            header::reseal(&mut copy);
            refused += u32::from(parse(&copy).is_err());
        }
    }
    assert!(refused > 100);
}

#[test]
fn artifacts_of_other_versions_and_machines_are_refused() {
    let bytes = write(&program(), &code(), Attached::default()).unwrap();
    let with = |at: usize, value: &[u8]| {
        let mut copy = bytes.clone();
        copy[at..at + value.len()].copy_from_slice(value);
        header::reseal(&mut copy);
        parse(&copy).unwrap_err()
    };
    assert!(matches!(with(8, &[0, 0, 0, 0]), ArtifactError::Older { version: 0 }));
    assert!(matches!(with(8, &[0xFF; 4]), ArtifactError::Newer { version: u32::MAX }));
    let error = with(40, b"pdp11\0\0\0");
    assert!(matches!(&error, ArtifactError::Architecture { artifact, .. } if artifact == "pdp11"));
    assert!(error.to_string().contains("pdp11"), "{error}");
    let error = with(64, b"warp9,sse99");
    assert!(
        matches!(&error, ArtifactError::Features { missing } if *missing == ["warp9", "sse99"])
    );
    assert!(matches!(with(40, b"\xFF"), ArtifactError::Inconsistent { .. }));
    assert!(matches!(parse(b""), Err(ArtifactError::NotAnArtifact)));
    assert!(matches!(parse(b"\x7FELF"), Err(ArtifactError::NotAnArtifact)));
}

#[test]
fn wrong_lengths_of_parts_are_refused() {
    let bytes = write(&program(), &code(), Attached::default()).unwrap();
    for at in [24, 28, 32, 36, 180] {
        for value in [0_u32, 1, 0x1000_0000, u32::MAX] {
            let mut copy = bytes.clone();
            copy[at..at + 4].copy_from_slice(&value.to_le_bytes());
            header::reseal(&mut copy);
            let refused = parse(&copy).unwrap_err();
            let expected = matches!(
                refused,
                ArtifactError::Inconsistent { .. } | ArtifactError::TooLarge { .. }
            );
            assert!(expected, "{refused}");
        }
    }
}

/// Makes a change after which program and code must be refused both when they are written and when
/// they are read.
fn inconsistent(change: impl Fn(&mut Program, &mut CodeParts)) {
    let (mut program, mut code) = (program(), code());
    change(&mut program, &mut code);
    let wrote = write(&program, &code, Attached::default()).unwrap_err();
    let read = parse(&forged(&program, &code)).unwrap_err();
    for error in [wrote, read] {
        let expected =
            matches!(error, ArtifactError::Inconsistent { .. } | ArtifactError::TooLarge { .. });
        assert!(expected, "{error}");
    }
}

fn pmi(program: &mut Program) -> &mut PmiTables {
    match &mut program.tables {
        Tables::Pmi(tables) => tables,
        _ => unreachable!(),
    }
}

#[test]
fn tables_that_point_outside_are_refused() {
    inconsistent(|_, code| code.image_size += 1);
    inconsistent(|_, code| code.eh_frame[20] += 1);
    inconsistent(|_, code| code.eh_frame[24] += 1);
    inconsistent(|_, code| code.eh_frame.push(0));
    inconsistent(|_, code| code.labels[0] = 17);
    inconsistent(|_, code| code.labels[0] = 16);
    inconsistent(|_, code| code.labels.swap(0, 1));
    inconsistent(|_, code| code.labels[0] = 4000);
    inconsistent(|_, code| {
        code.labels[0] = CodeParts::NO_CODE;
        plcc_abi::function_marker::write(code);
    });
    inconsistent(|_, code| code.functions[1].len = 17);
    inconsistent(|_, code| code.functions[0].len = 49);
    inconsistent(|_, code| code.functions[0].len = 0);
    inconsistent(|_, code| code.functions.swap(0, 1));
    inconsistent(|_, code| code.functions[1].offset = u32::MAX);
    inconsistent(|_, code| Arc::make_mut(&mut code.lines)[1].offset = 80);
    inconsistent(|_, code| Arc::make_mut(&mut code.lines)[1].file = 1);
    inconsistent(|_, code| Arc::make_mut(&mut code.lines)[1].line = 0);
    inconsistent(|_, code| Arc::make_mut(&mut code.lines).swap(0, 1));
    inconsistent(|_, code| Arc::make_mut(&mut code.trap_sites)[0].statement.file = 1);
    inconsistent(|_, code| {
        Arc::make_mut(&mut code.label_lines)[0] = Some(SourceLine { file: 1, line: 1 })
    });
    inconsistent(|_, code| code.label_lines = Arc::new(vec![None; 4]));
    inconsistent(|program, _| program.tasks[0].entry = 3);
    inconsistent(|program, _| program.image_size = u32::MAX);
    inconsistent(|program, _| program.image_size -= 1);
    inconsistent(|program, _| program.files.clear());
    inconsistent(|program, _| program.regions[1].offset = 4);
    inconsistent(|program, _| program.regions[0].size = 9);
    inconsistent(|program, _| program.regions[1].size = u32::MAX);
    inconsistent(|program, _| pmi(program).symbols[0].elements = Some(u32::MAX));
    inconsistent(|program, _| pmi(program).symbols[0].offset = 2055);
    inconsistent(|program, _| pmi(program).symbols[0].role = Role::TimerControl(0));
    inconsistent(|program, _| pmi(program).ports = 9);
    inconsistent(|program, _| pmi(program).special.ipl = 2056);
    inconsistent(|program, _| pmi(program).initial.push((2053, Type::Long, 1)));
}

/// Somebody puts the tables of one program beside the code of another and makes the digest right.
#[test]
fn tables_of_another_program_are_refused_although_the_digest_is_right() {
    let (first, code) = (program(), code());
    // Another layout: one function.
    let mut other = code.clone();
    other.functions = vec![FunctionRange { name: "chunk0".into(), offset: 16, len: 64 }];
    other.labels = vec![16];
    other.label_lines = Arc::default();
    other.lines = Arc::default();
    other.eh_frame.clear();
    function_marker::write(&mut other);
    let mut larger = first.clone();
    larger.image_size += 8;
    let enlarged = CodeParts { image_size: larger.image_size, ..code.clone() };
    let mixed =
        |bytes: &[u8], tables: &CodeParts| CodeParts { bytes: bytes.to_vec(), ..tables.clone() };
    let mut one_task = first.clone();
    one_task.tasks[0] = Task { name: "scan".into(), entry: 0, resume_points: vec![] };
    for (program, code) in [
        (&one_task, mixed(&code.bytes, &other)),
        (&one_task, mixed(&other.bytes, &code)),
        (&larger, enlarged),
    ] {
        let error = parse(&forged(program, &code)).unwrap_err();
        assert!(error.to_string().contains("does not belong to its tables"), "{error}");
    }
    assert!(parse(&forged(&one_task, &other)).is_ok());
}

#[test]
fn with_a_key_only_what_its_owner_signed_is_taken() {
    use ed25519_dalek::{Signer, SigningKey};

    let artifact = write(&program(), &code(), Attached::default()).unwrap();
    let signed = |seed: u8, artifact: &[u8]| {
        let key = SigningKey::from_bytes(&[seed; 32]);
        let public = key.verifying_key().to_bytes();
        let signature = Signature::new(public, key.sign(artifact).to_bytes());
        ([artifact, &signature.bytes()].concat(), PublicKey::from_bytes(public).unwrap())
    };
    let (mine, my_key) = signed(1, &artifact);
    let (theirs, their_key) = signed(2, &artifact);
    assert_eq!(Artifact::parse(&mine, Some(&my_key)).unwrap().program, program());
    // Without a key nothing is asked.
    assert_eq!(parse(&mine).unwrap().program, program());
    assert_eq!(read(&theirs, None).unwrap().signed_by, Some(their_key));
    let refused = |bytes: &[u8]| Artifact::parse(bytes, Some(&my_key)).unwrap_err();
    assert!(matches!(refused(&artifact), ArtifactError::NotSigned));
    assert!(matches!(refused(&theirs), ArtifactError::OtherKey));
    // Their signature under my name.
    let mut forged = theirs.clone();
    let key_at = artifact.len() + signature::MAGIC.len();
    forged[key_at..key_at + 32].copy_from_slice(&mine[key_at..key_at + 32]);
    assert!(matches!(refused(&forged), ArtifactError::WrongSignature));
    // The signature is looked at before anything else: whatever else is wrong goes unnoticed.
    for at in 0..artifact.len() {
        let mut changed = mine.clone();
        changed[at] ^= 0x10;
        assert!(matches!(refused(&changed), ArtifactError::WrongSignature), "byte {at}");
    }
    for at in artifact.len()..mine.len() {
        let mut changed = mine.clone();
        changed[at] ^= 0x10;
        assert!(Artifact::parse(&changed, Some(&my_key)).is_err(), "byte {at}");
    }
    assert!(matches!(refused(b""), ArtifactError::NotSigned));
}

#[test]
fn an_error_of_a_file_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.plcx");
    std::fs::write(&path, write(&program(), &code(), Attached::default()).unwrap()).unwrap();
    assert_eq!(Artifact::open(&path, None).unwrap().program, program());
    std::fs::remove_file(&path).unwrap();
    let error = Artifact::open(&path, None).unwrap_err();
    assert!(error.to_string().contains(&*path.to_string_lossy()), "{error}");
}
