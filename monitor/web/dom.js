// Making elements. Texts are always set as texts, never as HTML: they come from programs.

// An element with properties and children. Properties named `on…` are listeners, `class` and names
// with a dash or in the list below are attributes.
const ATTRIBUTES = new Set(["class", "role", "for", "id", "type", "tabindex", "colspan", "scope", "list"]);

export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (ATTRIBUTES.has(name) || name.includes("-")) made.setAttribute(name, value === true ? "" : value);
    else made[name] = value;
  }
  append(made, children);
  return made;
}

function append(parent, children) {
  for (const child of children) {
    if (Array.isArray(child)) append(parent, child);
    else if (child !== undefined && child !== null && child !== false) parent.append(child);
  }
}

// Takes away all children and puts others in their place.
export function refill(parent, ...children) {
  parent.replaceChildren();
  append(parent, children);
}

// Sets a text only if it is another one, so that a selection of it survives.
export function setText(target, text) {
  if (target.textContent !== text) target.textContent = text;
}

// Whether the keyboard belongs to a field that texts are typed into.
export function isTyping(target) {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement) return !["range", "checkbox", "radio", "button"].includes(target.type);
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}
