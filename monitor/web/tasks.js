// Tasks: PMI's scan, NCT's modules, PMAC's PLCs and PLCCs, and where each waits.

import { goToRow } from "./actions.js";
import { element, refill } from "./dom.js";
import { Table } from "./table.js";

export class TasksScreen {
  name = "tasks";
  title = "Tasks";

  constructor(app) {
    this.app = app;
    this.table = new Table({
      label: "Tasks",
      keyOf: (row) => row.name,
      rowClass: (row) => row.state,
      onActivate: (row) => row.row !== null && goToRow(app, row.row),
      columns: [
        { title: "Task", cell: (row) => row.name, class: "short" },
        { title: "State", cell: (row) => row.state, class: "short" },
        { title: "Waits or goes on at", cell: (row) => row.place ?? "", class: "code" },
        { title: "Last ran in tick", cell: (row) => (row.tick ?? "–").toString(), class: "numeric wide" },
        { title: "Scans a second", cell: (row) => row.scans_per_second.toFixed(1), class: "numeric" },
        { title: "Statements in the last scan", cell: (row) => String(row.statements), class: "numeric wide" },
      ],
    });
    this.facts = element("dl", { class: "facts" });
    this.element = element("section", { "aria-label": this.title }, this.table.element, this.facts);
  }

  request() {
    return { screen: "tasks" };
  }

  update(body) {
    this.table.update(body.rows);
    refill(this.facts, body.facts.map((fact) => element("div", {}, element("dt", {}, fact.title), element("dd", {}, fact.value))));
  }

  menu() {
    return [{ key: "Enter", label: "go to its line", action: () => this.table.selected && this.table.onActivate(this.table.selected) }];
  }

  focus() {
    this.table.element.focus();
  }
}
