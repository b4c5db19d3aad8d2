"""Reads what `plcc convert --to mcap` writes with the reader of PyPI's `mcap`: indexes, checksums, schemas, and every value
of every tick against the table that `plcc convert --to csv` writes of the same record."""

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

from mcap.reader import make_reader

root = Path(__file__).resolve().parents[2]
work = Path(sys.argv[1])
plcc = os.environ["PLCC"]

PROGRAMS = [
    ("pmi", "examples/pmi/lathe.pmi", "docs/debugger/lathe.csv", 300),
    ("nct", "examples/nct/sample.plc", "examples/nct/sample.csv", 1100),
    ("pmac", "examples/pmac/mill.pmc", "examples/pmac/mill/encoder/stimulus.csv", 400),
]


def run(*words):
    subprocess.run([plcc, *map(str, words)], cwd=root, check=True, stdout=subprocess.DEVNULL)


def check(name, program, stimulus, ticks):
    record, table, file, events = (work / f"{name}.{end}" for end in ("plcrec", "csv", "mcap", "jsonl"))
    run("run", program, "--stimulus", stimulus, "--ticks", ticks, "--record", record, "--events", events)
    run("convert", record, "--to", "csv", "-o", table)
    run("convert", record, "--to", "mcap", "-o", file)
    with open(file, "rb") as opened:
        reader = make_reader(opened, validate_crcs=True)
        summary = reader.get_summary()
        assert reader.get_header().library.startswith("plcc "), reader.get_header()
        # The names of the variables, by topic and field.
        titles, topics = {}, set()
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            topics.add(channel.topic)
            for field, of in json.loads(schema.data)["properties"].items():
                titles[channel.topic, field] = of.get("title", field)
                assert re.fullmatch(r"[A-Za-z0-9_]+", field), field
        assert "/events" in topics
        # The value of each variable after each tick: that of the last message.
        values, logs, count, before = {}, [], 0, 0
        for schema, channel, message in reader.iter_messages():
            count += 1
            assert message.log_time >= before and message.publish_time == message.log_time
            before = message.log_time
            data = json.loads(message.data)
            if channel.topic == "/events":
                assert schema.name == "foxglove.Log"
                stamp = data["timestamp"]
                assert stamp["sec"] * 10**9 + stamp["nsec"] == message.log_time
                logs.append((data["tick"], data["level"]))
                continue
            for field, value in data.items():
                if field != "tick":
                    values.setdefault(titles[channel.topic, field], {})[data["tick"]] = value
        assert count == summary.statistics.message_count == sum(summary.statistics.channel_message_counts.values())
        # The table has a row where a value changes; so do the messages, apart from repetitions.
        changes = {}
        for row in csv.DictReader(open(table)):
            changes.setdefault(row["name"], {})[int(row["tick"])] = json.loads(row["value"])
        assert set(values) == set(changes), set(values) ^ set(changes)
        for variable, found in values.items():
            last, steps = None, {}
            for tick, value in sorted(found.items()):
                if value != last:
                    steps[tick] = last = value
            assert steps == changes[variable], (variable, steps, changes[variable])
            # The last tick has a message, so that plots go on to the end.
            assert max(found) == ticks - 1, (variable, max(found))
        told = [json.loads(line)["tick"] for line in open(events)]
        assert [tick for tick, _ in logs] == told, (logs, told)
        # The index leads to a time in the middle.
        first, last = summary.statistics.message_start_time, summary.statistics.message_end_time
        middle = (first + last) // 2
        later = [m for _, _, m in reader.iter_messages(start_time=middle)]
        assert later and all(m.log_time >= middle for m in later)
        print(f"{name}: {count} messages of {len(values)} variables and {len(logs)} events are as in the table")


for program in PROGRAMS:
    check(*program)
