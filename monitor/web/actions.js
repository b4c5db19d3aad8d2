// What can be done with a variable, the same on every screen.

import { ask, choose } from "./dialogs.js";
import { element } from "./dom.js";

// What the machine file says of a variable, in columns; those of which nothing is said are left out.
export function saidColumns() {
  const column = (title, key, kind = "") => ({ title, cell: (row) => row.said[key], has: (row) => row.said[key], class: kind });
  return [column("Alias", "alias", "code"), column("What it is", "text", "said"), column("Device", "device", "wide"), column("Terminal", "at", "wide")];
}

// Names that were typed: separated by blanks or commas outside of brackets.
export function splitNames(text) {
  return text.match(/[^\s,[\]]+(?:\[[^\]]*\])?/g) ?? [];
}

// Asks what to do with a variable, and does it.
export async function variableMenu(app, name) {
  const may = app.status ?? {};
  const actions = [
    ["watch it", () => app.apply({ command: "watch", names: [name] }, `${name} is watched`)],
    ["show it on the scope", () => app.apply({ command: "scope_add", names: [name] }, `${name} is on the scope`)],
    ["go back to its previous change", () => previousChange(app, name)],
    ["why it has its value", () => why(app, name)],
    ["where it occurs", () => references(app, name)],
    (may.may_write || may.may_swap) && ["change it", () => change(app, name)],
    may.may_force && ["force it", () => force(app, name)],
    may.may_force && ["end its force", () => app.apply({ command: "release", name })],
  ].filter(Boolean);
  const chosen = await choose({ title: name, rows: actions.map(([label]) => ({ label })) });
  if (chosen !== null) await actions[chosen][1]();
}

// Goes back to the statement that changed a variable last, and shows it.
export async function previousChange(app, name) {
  if (await app.apply({ command: "previous_change", name })) app.open("statements");
}

// Says why a variable has its value: what holds it, down to inputs. Each line of the answer can be asked for in turn.
export async function why(app, name, tick = null) {
  if (!(await app.apply({ command: "why", name, tick }))) return;
  const body = (await app.ask({ screen: "why" }))?.body;
  if (body?.screen !== "why") return;
  const rows = body.lines.map((line) => ({
    label: line.pieces.map((piece) => piece.text).join(""),
    shown: line.pieces.map((piece) => element("span", { class: `why-${piece.kind}` }, piece.text)),
  }));
  const at = body.tick === null ? "now" : `at the end of tick ${body.tick}`;
  const chosen = await choose({ title: `Why ${body.name} ${at}`, hint: "Enter on a variable asks why that has its value.", rows, kind: "why" });
  const line = body.lines[chosen];
  if (line?.name) await why(app, line.name, line.tick);
}

// Asks which variable is meant, and says why it has its value.
export async function askWhy(app, value = "") {
  const answer = await ask({ title: "Why has it its value?", fields: [{ name: "name", label: "Variable, or text of a fault or message", value }], confirm: "Why" });
  if (answer?.name) await why(app, answer.name);
}

// Sets a variable once.
export async function change(app, name, value = "") {
  const answer = await ask({
    title: "Change a variable", confirm: "Set",
    text: "The value is set once, between two scans. The program may overwrite it in its next scan. For a timer's delay or a constant the program is built with the new number and replaces the one that runs.",
    fields: [{ name: "name", label: "Variable", value: name }, { name: "value", label: "Value", value }],
  });
  if (answer?.name) await app.apply({ command: "change", ...answer });
}

// Holds an input or output at a value that is asked for.
export async function force(app, name) {
  const answer = await ask({ title: `Force ${name}`, fields: [{ name: "value", label: "Value" }], confirm: "Force" });
  if (answer) await forceTo(app, name, answer.value);
}

// Holds an input or output at a value.
export async function forceTo(app, name, value) {
  await app.apply({ command: "force", name, value });
}

// Shows where a variable, label or statement occurs, and goes to the chosen line.
export async function references(app, name) {
  const body = (await app.ask({ screen: "references", name }))?.body;
  if (!body) return;
  if (body.screen !== "references") return app.refuse({ message: body.reason });
  const kinds = [["written", "gets a value"], ["read", "is used"], ["tested", "is tested"], ["others", ""]];
  const rows = kinds.flatMap(([kind, note]) =>
    body[kind].map((row) => ({ number: row.number, label: row.name, note, value: row.row })));
  const row = await choose({ title: `${body.name} occurs in ${rows.length} lines`, hint: body.meaning ?? "", rows });
  if (row !== null) await goToRow(app, row);
}

// Puts the cursor on a line of the program and shows it.
export async function goToRow(app, row) {
  if (await app.apply({ command: "put_cursor", row })) app.open("statements");
}
