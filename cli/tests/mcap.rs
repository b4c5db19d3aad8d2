//! `plcc convert --to mcap`, read back by the reader of the crate `mcap`. `tests/peers/run mcap` reads such files with the
//! readers for Python and JavaScript.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use std::collections::BTreeMap;
use std::fs;

use mcap::MessageStream;
use mcap::read::Summary;
use serde_json::Value;
use support::{COUNTER, Folder};

/// A folder with the record of a run of 400 ticks.
fn recorded() -> Folder {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("s.csv", "tick,name,value\n2,N,7\n5,N,1\n")]);
    folder.plcc("run a.pmi --ticks 400 --stimulus s.csv --record r.plcrec").exits(0);
    folder
}

#[test]
fn messages_have_the_values_of_each_tick_and_are_indexed() {
    let folder = recorded();
    folder.plcc("convert r.plcrec --to mcap").exits(0);
    folder.plcc("convert r.plcrec --to csv -o r.csv --watch N").exits(0);
    let bytes = fs::read(folder.path().join("r.mcap")).unwrap();

    let mut counts = BTreeMap::new();
    let mut count = 0;
    for message in MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert_eq!(message.channel.message_encoding, "json");
        assert_eq!(message.channel.schema.as_ref().unwrap().encoding, "jsonschema");
        assert_eq!(message.log_time, message.publish_time);
        count += 1;
        let value: Value = serde_json::from_slice(&message.data).unwrap();
        // A scan takes 20 ms.
        let tick = value["tick"].as_u64().unwrap();
        assert_eq!(message.log_time, tick * 20_000_000);
        if let Some(n) = value["N"].as_i64() {
            counts.insert(tick, n);
        }
    }
    let table = folder.read("r.csv");
    let expected: BTreeMap<u64, i64> = table
        .lines()
        .skip(1)
        .map(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            (cells[0].parse().unwrap(), cells[3].parse().unwrap())
        })
        .collect();
    assert!(expected.len() > 390, "{table}");
    assert_eq!(counts, expected);

    let summary = Summary::read(&bytes).unwrap().unwrap();
    let statistics = summary.stats.unwrap();
    assert_eq!(statistics.message_count, count);
    assert!(!summary.chunk_indexes.is_empty());
    assert!(summary.chunk_indexes.iter().all(|index| index.compression == "lz4"));
    let topics: Vec<&str> =
        summary.channels.values().map(|channel| channel.topic.as_str()).collect();
    assert!(topics.contains(&"/events"), "{topics:?}");
}

/// The file depends on nothing but the record: neither on the time nor on the order of a hash table.
#[test]
fn the_same_record_gives_the_same_bytes() {
    let folder = recorded();
    let files = ["a.mcap", "b.mcap"].map(|name| {
        folder.plcc(&format!("convert r.plcrec --to mcap -o {name}")).exits(0);
        fs::read(folder.path().join(name)).unwrap()
    });
    assert!(files[0] == files[1]);
}

#[test]
fn a_file_that_cannot_be_written_is_reported_with_the_reason() {
    let folder = recorded();
    folder
        .plcc("convert r.plcrec --to mcap -o -")
        .exits(2)
        .says(&["not written to standard output"]);
    folder.plcc("convert r.plcrec --to mcap -o none/r.mcap").exits(2).says(&["none/r.mcap"]);
    if cfg!(target_os = "linux") {
        // Each write to this device fails as on a full disk.
        folder
            .plcc("convert r.plcrec --to mcap -o /dev/full")
            .exits(2)
            .says(&["/dev/full", "the disk is full"]);
    }
}
