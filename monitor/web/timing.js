// How long ticks take, and where the time goes.

import { goToRow } from "./actions.js";
import { element, setText } from "./dom.js";
import { Table } from "./table.js";

const microseconds = (value) => value.toFixed(value < 100 ? 2 : 0);
const percent = (share) => `${(share * 100).toFixed(1)} %`;

export class TimingScreen {
  name = "timing";
  title = "Timing";

  constructor(app) {
    this.app = app;
    const time = (title, field, wide = "") => ({ title, cell: (row) => microseconds(row[field]), class: `numeric ${wide}` });
    this.times = new Table({
      label: "Times in microseconds",
      empty: "only a running control measures times",
      keyOf: (row) => row.name,
      columns: [
        { title: "What (µs)", cell: (row) => row.name },
        { title: "Count", cell: (row) => String(row.count), class: "numeric wide" },
        time("Last", "last_us", "wide"), time("Mean", "mean_us"), time("Median", "p50_us", "wide"), time("99 %", "p99_us"),
        time("99.9 %", "p999_us", "wide"), time("Largest", "max_us"),
      ],
    });
    this.counts = element("p", {});
    this.covered = element("h2", {});
    this.lines = new Table({
      label: "Lines that take most",
      keyOf: (row) => row.row,
      onActivate: (row) => goToRow(app, row.row),
      columns: [
        { title: "Line", cell: (row) => row.number, class: "numeric" },
        { title: "Text", cell: (row) => row.text, class: "code" },
        { title: "Nanoseconds a tick", cell: (row) => row.nanoseconds.toFixed(0), class: "numeric wide" },
        { title: "Executions", cell: (row) => String(row.executions), class: "numeric wide" },
        { title: "Share", cell: (row) => percent(row.share), class: "numeric" },
        { title: "", class: "wide", cell: (row) => element("meter", { min: 0, max: 1, value: row.share, "aria-label": percent(row.share) }) },
      ],
    });
    this.overruns = new Table({
      label: "Recorded overruns",
      empty: "none is recorded",
      keyOf: (row) => row.tick,
      onActivate: (row) => app.apply({ command: "go_to_tick", tick: Math.max(0, row.tick - 1) }).then((done) => done && app.open("statements")),
      columns: [
        { title: "Tick", cell: (row) => String(row.tick), class: "numeric" },
        { title: "Skipped ticks", cell: (row) => String(row.skipped), class: "numeric" },
        { title: "Statements before it", cell: (row) => String(row.statements ?? "not known"), class: "numeric wide" },
        { title: "Usual", cell: (row) => row.usual.toFixed(0), class: "numeric wide" },
        { title: "Line that was executed most", cell: (row) => row.line ?? "", class: "code" },
      ],
    });
    this.element = element("section", { "aria-label": this.title }, element("h2", {}, "Measured by the control"),
      this.times.element, this.counts, this.covered, this.lines.element, element("h2", {}, "Overruns"), this.overruns.element);
  }

  request() {
    return { screen: "timing" };
  }

  update(body) {
    this.times.update(body.times);
    const known = (value) => (value === null ? "not known" : String(value));
    setText(this.counts, `Ticks that began too late: ${known(body.overruns)} · skipped ticks: ${known(body.skipped)}`);
    const few = body.ticks < body.enough ? `; lines are shown as soon as ${body.enough} ticks were run again` : "";
    setText(this.covered, `Where the statement interpreter's time goes in ${body.ticks} ticks (compiled code is faster, and may differ)${few}`);
    this.lines.update(body.lines);
    this.overruns.update(body.recorded_overruns);
  }

  menu() {
    return [{ key: "Enter", label: "go to the line", action: () => {
      const table = [this.lines, this.overruns].find((candidate) => candidate.element.contains(document.activeElement));
      if (table?.selected) table.onActivate(table.selected);
    } }];
  }

  focus() {
    this.lines.element.focus();
  }
}
