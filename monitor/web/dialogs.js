// Questions to the user. Each is a modal dialog, which keeps the keyboard until it is answered.

import { element, refill } from "./dom.js";

function open(dialog) {
  const before = document.activeElement;
  document.body.append(dialog);
  dialog.addEventListener("close", () => {
    dialog.remove();
    if (before instanceof HTMLElement) before.focus();
  });
  dialog.showModal();
}

// Asks for values. `fields` have name, label, value and, for a choice, options. Gives an object with the
// values, or null when the user does not want.
export function ask({ title, text = "", fields = [], confirm = "OK", kind = "" }) {
  return new Promise((resolve) => {
    let answer = null;
    const controls = fields.map((field) => {
      const control = field.options
        ? element("select", { name: field.name }, field.options.map(([value, label]) =>
          element("option", { value, selected: value === field.value }, label)))
        : element("input", {
          name: field.name, value: field.value ?? "", autocomplete: "off", spellcheck: false,
          type: field.type ?? "text", checked: field.checked,
        });
      return [control, element("label", { class: field.type === "checkbox" ? "check" : "" }, field.label, control)];
    });
    const dialog = element("dialog", { class: kind, "aria-label": title },
      element("form", {
        method: "dialog",
        onsubmit: () => {
          answer = Object.fromEntries(controls.map(([control]) =>
            [control.name, control.type === "checkbox" ? control.checked : control.value.trim()]));
        },
      },
      element("h2", {}, title),
      text && element("p", { class: "text" }, text),
      controls.map(([, label]) => label),
      element("div", { class: "buttons" },
        element("button", { type: "submit", class: "confirm" }, confirm),
        element("button", { type: "button", onclick: () => dialog.close() }, "Cancel (Esc)"))));
    dialog.addEventListener("close", () => resolve(answer));
    open(dialog);
    (controls[0]?.[0] ?? dialog.querySelector(kind === "warning" ? "button[type=button]" : "button")).focus();
  });
}

// Lets the user choose rows of a list by arrow keys. `rows` have label, and optionally number, note,
// value, chosen and shown (elements in the place of the label). With `many`, Space and Enter mark rows, and Esc ends with all that are marked
// (PMI 5.1); otherwise Enter takes one, Esc none. A text that is typed goes to the next row with it.
export function choose({ title, rows, many = false, hint = "", kind = "" }) {
  return new Promise((resolve) => {
    let selected = Math.max(0, rows.findIndex((row) => row.current));
    let answer = null;
    const marked = new Set(rows.flatMap((row, at) => (row.chosen ? [at] : [])));
    const search = element("input", { type: "search", "aria-label": "Search", placeholder: "search" });
    const list = element("div", { class: "choices", role: "listbox", tabindex: "0", "aria-label": title });
    const items = rows.map((row, at) => element("div", {
      id: `choice-${at}`, role: "option", class: "choice",
      onclick: () => { select(at); take(); },
    },
    many && element("span", { class: "mark" }), row.number && element("span", { class: "number" }, row.number),
    element("span", { class: "label" }, row.shown ?? row.label), row.note && element("span", { class: "note" }, row.note)));
    refill(list, items.length ? items : element("p", {}, "nothing"));

    function select(at) {
      items[selected]?.classList.remove("selected");
      selected = Math.max(0, Math.min(rows.length - 1, at));
      const item = items[selected];
      if (!item) return;
      item.classList.add("selected");
      list.setAttribute("aria-activedescendant", item.id);
      item.scrollIntoView({ block: "nearest" });
    }
    function mark() {
      for (const [at, item] of items.entries()) {
        item.setAttribute("aria-selected", String(many ? marked.has(at) : at === selected));
        const sign = item.querySelector(".mark");
        if (sign) sign.textContent = marked.has(at) ? "✓" : "";
      }
    }
    function take() {
      if (!rows.length) return;
      if (many) {
        if (!marked.delete(selected)) marked.add(selected);
        mark();
      } else {
        answer = rows[selected].value ?? selected;
        dialog.close();
      }
    }
    function find(text, from) {
      const wanted = text.toLowerCase();
      const matches = (row) => `${row.number ?? ""} ${row.label}`.toLowerCase().includes(wanted);
      for (let step = 0; step < rows.length; step += 1) {
        const at = (from + step) % rows.length;
        if (matches(rows[at])) return select(at);
      }
    }
    search.addEventListener("input", () => find(search.value, selected));
    const dialog = element("dialog", {
      class: `list ${kind}`, "aria-label": title,
      onkeydown: (event) => {
        const page = 15;
        const moves = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page };
        if (event.key in moves) select(selected + moves[event.key]);
        else if (event.key === "Home" && event.target === list) select(0);
        else if (event.key === "End" && event.target === list) select(rows.length - 1);
        else if (event.key === "Enter" && event.target === search && search.value) find(search.value, selected + 1);
        else if (event.key === "Enter" || (event.key === " " && event.target === list)) take();
        else return;
        event.preventDefault();
      },
    },
    element("h2", {}, title), hint && element("p", {}, hint), search, list,
    element("div", { class: "buttons" },
      many && element("button", { type: "button", onclick: () => dialog.close() }, "Show the chosen ones (Esc)"),
      !many && element("button", { type: "button", onclick: () => dialog.close() }, "Close (Esc)")));
    dialog.addEventListener("close", () => {
      resolve(many ? [...marked].sort((one, other) => one - other).map((at) => rows[at].value ?? at) : answer);
    });
    open(dialog);
    select(selected);
    mark();
    list.focus();
  });
}

// Shows a text or elements until Esc.
export function tell(title, ...content) {
  const dialog = element("dialog", { class: "list", "aria-label": title },
    element("h2", {}, title), content,
    element("div", { class: "buttons" }, element("button", { type: "button", onclick: () => dialog.close() }, "Close (Esc)")));
  open(dialog);
}
