// Keys: what an event stands for, and the page of help.

import { element } from "./dom.js";
import { tell } from "./dialogs.js";

// The name of a key as menus have it: `F1`, `d`, `Insert`; empty with Ctrl, Alt or the system's key.
export function keyName(event) {
  if (event.ctrlKey || event.altKey || event.metaKey) return "";
  return event.key === "Backspace" ? "Delete" : event.key;
}

// Keys that work on every screen.
export const GLOBAL_KEYS = [
  ["0 … 9", "choose a screen"],
  ["Space", "follow the newest scan, or stay at this one"],
  ["← and →", "one tick back, one tick on (on the scope: move the cursor)"],
  ["< and >", "100 ticks back, 100 ticks on"],
  ["[ and ]", "one scan back, one scan on"],
  ["g", "go to a tick"],
  ["c", "go back to the previous change of a variable"],
  ["y", "why a variable has its value: what holds it"],
  ["S", "how fast a program runs that the monitor runs itself"],
  ["X", "end all forces (clear all)"],
  ["Esc", "close a question; from a field back to the screen"],
  ["Tab", "next part of the page"],
  ["?", "this help"],
];

// Shows the keys of a screen and those of all screens.
export function help(title, menu) {
  const row = ([key, text]) => element("tr", {}, element("th", { scope: "row" }, key), element("td", {}, text));
  const own = menu.map((item) => [[item.key, item.letter].filter(Boolean).join(" or "), item.help ?? item.label]);
  tell("Keys",
    element("h3", {}, title), element("table", { class: "keys" }, own.map(row)),
    element("h3", {}, "Everywhere"), element("table", { class: "keys" }, GLOBAL_KEYS.map(row)));
}
