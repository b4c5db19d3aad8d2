// A table whose rows are selected by arrow keys. The table has the focus, its selected row is marked by
// a border and by `aria-activedescendant`, so that rows may be made again ten times a second.

import { element, refill } from "./dom.js";

let tables = 0;

export class Table {
  // `columns` have title, cell(row) (a text or elements), and optionally class, and has(row): a column that no row has is left
  // out. `keyOf(row)` is what a row is known by. `onActivate(row)` is called for Enter and double clicks.
  constructor({ label, columns, keyOf, rowClass = () => "", onActivate = () => {}, empty = "nothing" }) {
    Object.assign(this, { columns, keyOf, rowClass, onActivate, empty });
    this.rows = [];
    this.selectedKey = null;
    tables += 1;
    this.id = `table-${tables}`;
    this.body = element("tbody", {});
    this.head = element("tr", {});
    this.table = element("table", { role: "grid", "aria-label": label }, element("thead", {}, this.head), this.body);
    this.drawHead();
    this.element = element("div", {
      class: "table", tabindex: "0", role: "group", "aria-label": label,
      onkeydown: (event) => this.key(event),
      // Rows are made again while a button is held, so that a row itself would miss clicks.
      onpointerdown: (event) => {
        const row = event.target.closest?.("tbody tr[id]");
        if (row) this.select([...this.body.children].indexOf(row));
      },
      ondblclick: () => this.selected && this.onActivate(this.selected),
    }, this.table);
  }

  get selectedIndex() {
    const found = this.rows.findIndex((row) => this.keyOf(row) === this.selectedKey);
    return found >= 0 ? found : Math.min(this.lastIndex ?? 0, this.rows.length - 1);
  }

  get selected() {
    return this.rows[this.selectedIndex] ?? null;
  }

  update(rows) {
    const text = JSON.stringify(rows);
    if (text === this.lastText) return;
    this.lastText = text;
    this.rows = rows;
    this.draw();
  }

  get shownColumns() {
    return this.columns.filter((column) => !column.has || this.rows.some((row) => column.has(row)));
  }

  drawHead() {
    const titles = this.shownColumns.map((column) => column.title).join("|");
    if (titles === this.lastTitles) return;
    this.lastTitles = titles;
    refill(this.head, this.shownColumns.map((column) => element("th", { scope: "col", class: column.class }, column.title)));
  }

  draw() {
    this.drawHead();
    const columns = this.shownColumns;
    const selected = this.selectedIndex;
    this.lastIndex = Math.max(0, selected);
    if (this.rows.length) this.selectedKey = this.keyOf(this.rows[selected]);
    const made = this.rows.map((row, at) => element("tr", {
      id: `${this.id}-${at}`, "aria-selected": String(at === selected), class: this.rowClass(row),
    }, columns.map((column) => element("td", { class: column.class, role: "gridcell" }, column.cell(row)))));
    refill(this.body, made.length ? made
      : element("tr", {}, element("td", { colspan: columns.length, class: "empty" }, this.empty)));
    if (made.length) this.element.setAttribute("aria-activedescendant", `${this.id}-${selected}`);
    else this.element.removeAttribute("aria-activedescendant");
  }

  select(at) {
    const index = Math.max(0, Math.min(this.rows.length - 1, at));
    if (!this.rows[index]) return;
    this.selectedKey = this.keyOf(this.rows[index]);
    this.draw();
    this.body.children[index].scrollIntoView({ block: "nearest" });
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const at = this.selectedIndex;
    const moves = {
      ArrowUp: at - 1, ArrowDown: at + 1, PageUp: at - 15, PageDown: at + 15, Home: 0, End: this.rows.length - 1,
    };
    if (event.key in moves) this.select(moves[event.key]);
    else if (event.key === "Enter" && this.selected) this.onActivate(this.selected);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
