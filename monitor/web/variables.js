// Watch lists: variables by name with their values (PMI 5.2, PMAC's watch window).

import { change, saidColumns, splitNames, variableMenu } from "./actions.js";
import { ask, choose } from "./dialogs.js";
import { element, setText } from "./dom.js";
import { Table } from "./table.js";

const FORMATS = ["decimal", "hexadecimal", "binary"];

export class VariablesScreen {
  name = "variables";
  title = "Variables";

  constructor(app) {
    this.app = app;
    this.heading = element("h2", {});
    this.lists = [];
    this.list = "";
    this.table = new Table({
      label: "Watched variables",
      empty: "Nothing is watched yet: F1 (or i, or Insert) asks for names.",
      keyOf: (row) => `${row.entry}/${row.name}`,
      rowClass: (row) => (row.changed ? "changed" : ""),
      onActivate: (row) => variableMenu(app, row.name),
      columns: [
        { title: "Name", cell: (row) => row.name, class: "code" },
        { title: "", cell: (row) => row.title ?? "", has: (row) => row.title },
        ...saidColumns(),
        { title: "Value", class: "numeric", cell: (row) => element("span", {
          class: `value${row.forced ? " forced" : ""}${row.logical && row.value === "1" ? " true" : ""}`,
        }, row.value ?? "there is no such variable") },
        { title: "Format", cell: (row) => row.format, class: "wide" },
        { title: "", cell: (row) => [row.forced && element("span", { class: "badge" }, "forced"), row.changed && element("span", { class: "badge" }, "changed")] },
      ],
    });
    this.element = element("section", { "aria-label": this.title }, this.heading, this.table.element);
  }

  request() {
    return { screen: "variables" };
  }

  update(body) {
    this.lists = body.lists;
    this.list = body.list;
    setText(this.heading, `Watch list ${body.list} · values of ${body.moment}`);
    this.table.update(body.rows);
  }

  selectedName() {
    return this.table.selected?.name ?? "";
  }

  async add() {
    const answer = await ask({
      title: "Watch variables", confirm: "Watch",
      text: "Names, separated by blanks. Of an array: NAME[*], NAME[2] or NAME[2-5]; of a PMAC also P1..5.",
      fields: [{ name: "names", label: "Names" }],
    });
    const names = splitNames(answer?.names ?? "");
    if (names.length) await this.app.apply({ command: "watch", names });
  }

  async setFormat() {
    const row = this.table.selected;
    if (!row) return;
    const format = FORMATS[(FORMATS.indexOf(row.format) + 1) % FORMATS.length];
    await this.app.apply({ command: "set_format", name: row.entry, format }, `${row.entry} is shown as ${format}`);
  }

  async chooseList() {
    const rows = this.lists.map((list) => ({ label: list, value: list, current: list === this.list }));
    const chosen = await choose({ title: "Watch lists", rows: [...rows, { label: "a new list…", value: "" }] });
    if (chosen === null) return;
    const list = chosen || (await ask({ title: "New watch list", fields: [{ name: "list", label: "Name" }] }))?.list;
    if (list) await this.app.apply({ command: "choose_list", list });
  }

  unwatch() {
    const row = this.table.selected;
    if (row) this.app.apply({ command: "unwatch", name: row.entry });
  }

  async rollback() {
    const answer = await ask({
      title: "Take the last online change back", confirm: "Run it again",
      text: "The control runs the program again that was replaced last. Its variables keep the present values.",
      fields: [],
    });
    if (answer) await this.app.apply({ command: "rollback" });
  }

  menu() {
    const row = () => this.table.selected;
    return [
      { key: "F1", letter: "i", label: "display", help: "watch more variables (also Insert)", action: () => this.add() },
      { key: "F2", letter: "x", label: "clear", help: "empty the watch list", action: () => this.app.apply({ command: "clear_watch" }) },
      { key: "F3", letter: "e", label: "change", help: "set a variable once", action: () => change(this.app, row()?.name ?? "", row()?.value ?? "") },
      { key: "F4", letter: "f", label: "format", help: "decimal, hexadecimal, binary", action: () => this.setFormat() },
      { key: "F5", letter: "l", label: "lists", help: "another watch list", action: () => this.chooseList() },
      { key: "F6", letter: "u", label: "remove", help: "take the row out of the list (also Delete)", action: () => this.unwatch() },
      { key: "F7", letter: "B", label: "rollback", help: "take the last change of a delay or constant back", action: () => this.rollback() },
      { key: "F8", letter: "R", label: "remove list", help: "remove the whole watch list", action: () => this.app.apply({ command: "remove_list", list: this.list }) },
    ];
  }

  key(event) {
    if (event.key === "Insert") this.add();
    else if (event.key === "Delete") this.unwatch();
    else return false;
    return true;
  }

  focus() {
    this.table.element.focus();
  }
}
