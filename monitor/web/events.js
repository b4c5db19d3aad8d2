// Faults and messages: what is on now, and what has happened.

import { why } from "./actions.js";
import { element, refill } from "./dom.js";
import { Table } from "./table.js";

export class EventsScreen {
  name = "events";
  title = "Faults and messages";

  constructor(app) {
    this.app = app;
    this.active = element("ul", { class: "active", "aria-label": "On now" });
    this.display = element("pre", { class: "display", "aria-label": "Display", hidden: true });
    this.log = new Table({
      label: "What has happened, the newest first",
      empty: "nothing has happened in the ticks that were looked at",
      keyOf: (row) => row.key,
      rowClass: (row) => row.kind,
      onActivate: (row) => app.apply({ command: "go_to_tick", tick: row.tick }).then((done) => done && app.open("statements")),
      columns: [
        { title: "Tick", cell: (row) => String(row.tick), class: "numeric" },
        { title: "Time", cell: (row) => row.time ?? "", has: (row) => row.time },
        { title: "Kind", cell: (row) => row.kind, class: "wide" },
        { title: "", cell: (row) => (row.on === null ? "" : row.on ? "on" : "off"), class: "wide" },
        { title: "Text", cell: (row) => row.text },
      ],
    });
    this.element = element("section", { "aria-label": this.title },
      element("h2", {}, "On now"), this.active, this.display, element("h2", {}, "Log"), this.log.element);
  }

  request() {
    return { screen: "events" };
  }

  update(body) {
    refill(this.active, body.active.length ? body.active.map((entry) => element("li", { class: entry.kind },
      element("span", { class: "kind" }, entry.kind.toUpperCase()), " ", element("strong", {}, entry.name), " ", entry.text,
      entry.since !== null && element("span", { class: "since" }, ` since tick ${entry.since}`),
      " ", element("button", { type: "button", onclick: () => why(this.app, entry.name) }, "why")))
      : element("li", { class: "empty" }, "no fault and no message"));
    this.display.hidden = !body.display.length;
    this.display.textContent = body.display.join("\n");
    const text = JSON.stringify(body.log);
    if (text === this.lastLog) return;
    this.lastLog = text;
    // The newest stands first. Equal events in a tick are told apart by their number.
    this.log.update(body.log.map((row, at) => ({ ...row, key: `${row.tick}/${at}` })).reverse().slice(0, 500));
  }

  selectedEvent() {
    const { asked, tick } = this.log.selected ?? {};
    return asked ? { name: asked, tick } : null;
  }

  menu() {
    return [{ key: "Enter", label: "go to its tick", action: () => this.log.selected && this.log.onActivate(this.log.selected) }];
  }

  focus() {
    this.log.element.focus();
  }
}
